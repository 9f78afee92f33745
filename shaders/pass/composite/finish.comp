// One layer of the picture from the sum of its sub-frames, which stays as it is: more may be added.
#include "common/view.glsl"
#include "pass/composite/finished.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0, rgba32f) writeonly uniform image2D layer;
layout(binding = 1, rgba32f) readonly uniform image2D sums;

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, args.first_row);
    if (pixel.x >= int(view.size_px.x) || gl_GlobalInvocationID.y >= args.row_count) return;
    imageStore(layer, pixel, finished(args.layer, imageLoad(sums, pixel) * args.sub_frame_weight));
}
