// The pixel that stands for a block, from level 2 on: of those that can be lit the nearest to the block's
// centre; of equals the first, by rows.
//
// The centre is that of a whole block, also where the picture's edge cuts it: light is interpolated
// over a regular grid of blocks. In a block that is lit throughout it is found at once. Else the
// block's quadtree is searched, nearest blocks first, without what is empty or farther than the best.
#include "common/multires.glsl"
#include "common/seen_surface.glsl"
#include "shared/discontinuity.h"

layout(local_size_x = 8, local_size_y = 8) in;
layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_discontinuity_args args; };
layout(binding = BD_UNIT_BLOCK_FLAGS) uniform usampler2D flags;
layout(binding = BD_IMAGE_REPRESENTATIVES, r32ui) writeonly uniform uimage2D representative;

struct candidate {
    uint distance; // squared, in half pixels: below 2^31
    uint pixel;
};

// In half pixels, so that pixels' and blocks' centres are whole numbers.
uint distance_to(ivec2 centre, uvec2 pixel)
{
    ivec2 d = abs(ivec2(2u * pixel + 1u) - centre);
    return uint(d.x * d.x) + uint(d.y * d.y);
}

bool has_lit(uint level, uvec2 block)
{
    if (!multires_has(args.multires.levels[level], block)) return false;
    if (level == 0u) return seen_lit(ivec2(block), args.face);
    ivec2 texel = multires_texel(args.multires.levels[level], block);
    return BD_BLOCK_KIND(texelFetch(flags, texel, 0).x) != BD_BLOCK_EMPTY;
}

// Even bits of a 28 bit number.
uint even_bits(uint n)
{
    n &= 0x55555555u;
    n = (n | n >> 1u) & 0x33333333u;
    n = (n | n >> 2u) & 0x0f0f0f0fu;
    n = (n | n >> 4u) & 0x00ff00ffu;
    return (n | n >> 8u) & 0x0000ffffu;
}

// Searches one quarter of a block. All its blocks see the centre in the same direction, so one order
// of children, counted from the nearest, serves them all, and the way through the quadtree is a
// number with two bits a level.
void search_quarter(uint level, uvec2 quarter, uvec2 side, ivec2 centre, inout candidate best)
{
    uint at = level, way = 0u;
    uvec2 mirror = uvec2(side.x == 0u ? ~0u : 0u, side.y == 0u ? ~0u : 0u);
    while (at <= level) {
        uint depth = level - at, mask = (1u << depth) - 1u;
        uvec2 block = (quarter << depth) +
                      ((uvec2(even_bits(way), even_bits(way >> 1u)) ^ mirror) & mask);
        // The block's pixel nearest to the centre is in its corner.
        uvec2 corner = (block << at) + ((mirror & 1u) << at) - (mirror & 1u);
        uint distance = distance_to(centre, corner);
        if (distance <= best.distance && has_lit(at, block)) {
            if (at > 0u) {
                at--;
                way <<= 2u;
                continue;
            }
            uint pixel = BD_PIXEL_PACK(corner.x, corner.y);
            if (distance < best.distance || pixel < best.pixel)
                best = candidate(distance, pixel);
        }
        // On to the next, up as often as the last of four was done.
        while (at < level && (way & 3u) == 3u) {
            at++;
            way >>= 2u;
        }
        if (at == level) break;
        way++;
    }
}

void main()
{
    uint level = args.level;
    uvec2 block = gl_GlobalInvocationID.xy + uvec2(0u, args.first_row);
    if (gl_GlobalInvocationID.y >= args.row_count || !has_lit(level, block)) return;
    ivec2 centre = ivec2((2u * block + 1u) << level);
    uvec2 before = uvec2(centre / 2 - 1); // of the four around the centre
    bool found = has_lit(0u, before);
    candidate best = candidate(found ? 0u : ~0u, BD_PIXEL_PACK(before.x, before.y));
    for (uint i = 0u; i < (found ? 0u : 4u); i++) {
        uvec2 side = uvec2(i & 1u, i >> 1u);
        search_quarter(level - 1u, block * 2u + side, side, centre, best);
    }
    imageStore(representative, multires_texel(args.multires.levels[level], block), uvec4(best.pixel));
}
