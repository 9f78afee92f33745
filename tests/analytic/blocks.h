// A picture of a plane made by hand, cut into fragments by hand, with VPLs before it: what the
// passes over blocks of pixels get, without the passes that make it.

#ifndef BD_TESTS_ANALYTIC_BLOCKS_H
#define BD_TESTS_ANALYTIC_BLOCKS_H

#include "pass/gather_fragments.h"
#include "pass/upsample.h"

// What the picture holds. Pixels look along -z at the plane z = `height` above (x, y) in [-1, 1]^2.
struct blocks_scene {
    uint32_t width_px, height_px, coarsest_side;
    bool (*lit)(uint32_t x, uint32_t y);           // NULL: every pixel
    bool (*discontinuous)(uint32_t x, uint32_t y); // at this pixel something jumps; NULL: nowhere
    double (*height)(uint32_t x, uint32_t y);      // NULL: 0
    void (*normal)(uint32_t x, uint32_t y, double n[3]); // unit, n[2] > 0; NULL: (0, 0, 1)
    uint32_t vpl_count;
};

struct blocks {
    struct bd_gpu *gpu; // borrowed
    struct bd_slicer slicer;
    struct bd_pass_context context;
    struct bd_gpu_scene scene;
    struct bd_viewpoint viewpoint;
    struct bd_gbuffer gbuffer;
    struct bd_discontinuity discontinuity;
    struct bd_fragments fragments;
    uint32_t *list;                                    // of the fragments
    struct bd_fragments *parts[BD_MULTIRES_LEVEL_MAX]; // that a test split them into
    uint32_t part_count;
    struct bd_vpl_list vpls;
    const struct bd_vpl_list *lists[1];
};

void blocks_create(struct bd_gpu *gpu, const struct blocks_scene *scene, struct blocks *out);
void blocks_destroy(struct blocks *blocks);

// Irradiance at every pixel by the full-resolution gather. Caller frees.
float *blocks_gathered(struct blocks *blocks);
struct bd_multires_light *blocks_light(struct blocks *blocks, enum bd_fragment_visit visit,
                                       bool vector);
// Light that is 1, x and y at the centre of each fragment, in pixels: red, green, blue.
struct bd_multires_light *blocks_linear_light(struct blocks *blocks);
// Every pixel's irradiance from the light, which is destroyed. Caller frees.
float *blocks_upsampled(struct blocks *blocks, struct bd_multires_light **light,
                        enum bd_surface_detail detail);
// A texture's RGBA. Caller frees.
float *blocks_texels(struct bd_gpu *gpu, const struct bd_tex *tex);
// Where a block lies in the texture of its level.
size_t blocks_texel(const struct blocks *blocks, uint32_t level, uint32_t x, uint32_t y);
// First and last pixel of a block along an axis of so many pixels.
void blocks_pixels(uint32_t level, uint32_t at, uint32_t side_px, uint32_t *first, uint32_t *last);

#endif
