// Of many small triangles, those that can cover a sample of a viewpoint's picture.
//
// A software device takes some 300 ns for each triangle that it is given, most of it before it
// finds that no sample lies in it. Where triangles outnumber pixels, most are such. The sieve takes
// 15 ns a triangle.
//
// Conservative: a triangle that is dropped covers no sample on a device that keeps corners to a
// 256th of a pixel, whatever the rounding of its shaders.
//
// Pure arithmetic. Thread: any.

#ifndef BD_PASS_SCENE_SIEVE_H
#define BD_PASS_SCENE_SIEVE_H

#include "upload/view_bounds.h"

// Numbers of triangles are kept as floats.
#define BD_SIEVE_TRIANGLES_MAX (1u << 24)

// From a mesh's space to places in the picture, in pixels, times the depth.
struct bd_sieve {
    float x[4], y[4], depth[4];
    float depth_near;  // nothing nearer is drawn
    float depth_least; // nearer than which a place in the picture is not certain enough
    float width_px, height_px;
};

// `rows` and `box` as bd_view_bounds_in_mesh takes them.
struct bd_sieve bd_sieve_of(const struct bd_viewpoint *viewpoint,
                            const struct bd_render_space *space, const float rows[12],
                            const struct bd_box *box);

// Of `count` triangles from the `first` of a primitive on: writes three indices and the number of
// each that is left, in order, and returns how many are.
uint32_t bd_sieve_triangles(const struct bd_sieve *sieve, const float *position,
                            const uint32_t *index, uint32_t first, uint32_t count,
                            uint32_t *kept_index, float *kept_number);

#endif
