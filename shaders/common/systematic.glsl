// Systematic sampling over a running sum: one sample from each of as many equal parts as there are
// rays, all at the same place of their part. Neighbouring receivers take other places (Bayer 1973),
// and so does every seed and sub-frame.
#include "common/asker.glsl"
#include "common/view.glsl"

// Jarzynski and Olano 2020: PCG in one dimension.
uint stir(uint x)
{
    x = x * 747796405u + 2891336453u;
    x = ((x >> ((x >> 28u) + 4u)) ^ x) * 277803737u;
    return x >> 22u ^ x;
}

float bayer(uvec2 at)
{
    uint x = at.x ^ at.y, y = at.y;
    uint order = (x & 1u) << 3u | (y & 1u) << 2u | (x & 2u) | (y & 2u) >> 1u;
    return (float(order) + 0.5) / 16.0;
}

// In [0, 1).
float place_in_part(uvec2 pixel)
{
    uint hash = stir(args.seed ^ stir(floatBitsToUint(view.sample_px.x)));
    hash = stir(hash ^ stir(floatBitsToUint(view.sample_px.y)));
    return fract(bayer(pixel & 3u) + float(hash >> 8u) * (1.0 / 16777216.0));
}
