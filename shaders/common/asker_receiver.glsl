// The receiver that an asker is.
#include "common/asker.glsl"
#include "common/gbuffer.glsl"
#ifdef BD_FRAGMENTS
#include "common/block_receiver.glsl"
#endif

// What is lit, and a pixel on its surface: a block's receiver lies between pixels, on a curved
// surface off it, so that rays start from the pixel.
receiver asker_receiver(asker_place place, out ivec2 pixel)
{
#ifdef BD_FRAGMENTS
    receiver r = block_receiver(place.level, place.block, pixel);
#else
    pixel = place.block;
    receiver r = gbuffer_receiver(pixel);
#endif
    r.lit = is_asked(r);
    return r;
}
