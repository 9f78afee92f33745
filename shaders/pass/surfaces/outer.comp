// The blocks of a level that hold light and are not inner ones: a list, in a
// texture that is laid out as the levels are. Its order is that in which they come, which nothing
// depends on: each is worked on by itself.
#include "common/surfaces.glsl"
#include "shared/multires.h"

layout(local_size_x = 8, local_size_y = 8) in;
layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_surfaces_args args; };
layout(binding = 0, r32ui) writeonly uniform uimage2D list;
layout(std430, binding = BD_STORAGE_OUTER_COUNTS) buffer count_block { uint counts[]; };

void main()
{
    ivec2 block = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, args.rows.x);
    if (gl_GlobalInvocationID.y >= args.rows.y || !multires_has(args.level, uvec2(block))) return;
    uint word = word_of(args.level, block), nine = nine_of(args.level, block, word);
    if ((word & BD_SURFACES_HOLDS) == 0u || is_inner(args.level, block, word, nine, args.size_px.xy)) return;
    uint place = atomicAdd(counts[args.level.w], 1u), width = args.level.x;
    uvec2 at = uvec2(place % width, place / width);
    imageStore(list, multires_texel(args.level, at), uvec4(BD_PIXEL_PACK(uint(block.x), uint(block.y))));
}
