// Segments from every receiver of a slice to every VPL of a range: 32 for each word of answers.
#include "common/segments.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

void main()
{
    asker_place place = asker_place_at(gl_GlobalInvocationID.xy);
    if (!place.exists) return;
    ivec2 pixel;
    receiver r = asker_receiver(place, pixel);
    ray_start start = ray_start_at(pixel);
    uint first = place.index * args.words_per_receiver * 32u;
    for (uint i = 0u; i < args.words_per_receiver * 32u; i++) {
        uint vpl = args.first_item + min(i, args.item_count - 1u);
        if (i < args.item_count && is_reached(r, vpl_at(vpl)))
            store_segment_to(first + i, start, vpl);
        else
            store_no_segment(first + i);
    }
}
