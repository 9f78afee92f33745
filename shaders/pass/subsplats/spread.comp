// From the multiresolution image to the pixels: at each, the planes of all blocks that it lies in.
// No neighbour has a say: a VPL's neighbouring block may be of another level, in another image.
#include "common/blocks.glsl"
#include "common/gbuffer.glsl"
#include "shared/subsplats.h"

layout(local_size_x = 8, local_size_y = 8) in;
layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_subsplats_args args; };
layout(binding = BD_IMAGE_GLOSSY_FINE, rgba32f) readonly uniform image2D fine;
layout(binding = BD_IMAGE_GLOSSY_COARSE, rgba32f) readonly uniform image2D coarse;
layout(binding = BD_IMAGE_GLOSSY_SLOPE_X, rgba32f) readonly uniform image2D slope_x;
layout(binding = BD_IMAGE_GLOSSY_SLOPE_Y, rgba32f) readonly uniform image2D slope_y;
layout(binding = BD_IMAGE_GLOSSY, rgba32f) writeonly uniform image2D glossy;

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, args.first_row);
    if (gl_GlobalInvocationID.y >= args.row_count || pixel.x >= int(multires.width_px)) return;
    receiver r = gbuffer_receiver(pixel);
    vec4 sum = imageLoad(fine, pixel);
    bool member = r.lit && has_glossy_lobe(r.metallic, r.roughness);
    uint levels = member ? multires.level_count : 0u;
    for (uint level = 1u; level < levels; level++) {
        ivec2 block = pixel >> int(level), at = in_stack(level, block);
        vec2 from_centre = vec2(pixel) + 0.5 - centre_of_block(level, block);
        sum += imageLoad(coarse, at) + from_centre.x * imageLoad(slope_x, at) +
               from_centre.y * imageLoad(slope_y, at);
    }
    imageStore(glossy, pixel, sum);
}
