// Which pixels of a picture stand for all: chosen with a probability each, so that what is known at
// them, divided by it, sums up to the picture's sum on average.
//
// A third of the probability is spread evenly, a third over pixels next to where depth or normals
// jump, a third by how much a rough picture of the light differs between neighbours: errors of
// methods that light blocks of pixels lie at the latter two. Along the Morton curve the chosen ones
// are evenly apart in probability, so that every part of the picture has its share.

#ifndef BD_TESTS_BENCH_VPL_PIXELS_H
#define BD_TESTS_BENCH_VPL_PIXELS_H

#include <stdbool.h>
#include <stdint.h>

struct vpl_picture {
    uint32_t width_px, height_px;
    const bool *lit;
    const float *depth;           // along the view axis
    const float (*normals)[3];    // unit, geometric
    const float (*irradiance)[4]; // roughly; RGB
};

struct vpl_pixel {
    uint32_t x, y;
    double probability; // above 0, at most 1
};

// At most `count` lit pixels, or all of them if they are fewer, along the curve. Caller frees;
// `*chosen` is how many there are.
struct vpl_pixel *vpl_pixels_choose(const struct vpl_picture *picture, uint32_t count,
                                    uint64_t seed, uint32_t *chosen);

#endif
