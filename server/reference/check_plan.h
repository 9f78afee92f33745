// Which pixels a spot check traces. Private to reference/: check.h tells the method.

#ifndef BD_REFERENCE_CHECK_PLAN_H
#define BD_REFERENCE_CHECK_PLAN_H

#include "reference/check.h"

struct bd_check_stratum {
    uint32_t pixel_count;  // that it has; equal to sample_count: all are traced
    uint32_t sample_count; // that were chosen
    uint32_t first;        // index of its first sample
    double score;          // sum over its pixels
};

struct bd_check_sample {
    uint32_t index; // y * width + x
    float score;
    float contrast; // largest squared difference to a neighbour: what an edge in the wrong place
                    // costs
};

struct bd_check_plan {
    uint32_t width_px, height_px;
    uint64_t pixel_count; // whose image is finite: the ones that are measured
    double mean_image;    // over those and their channels
    uint32_t stratum_count, sample_count;
    struct bd_check_stratum *strata;
    struct bd_check_sample *samples; // in the order of their strata
};

// Chooses `sample_count` pixels, or all that are finite if they are fewer. The same frame, count
// and seed make the same plan. `bd_check_plan_finish` also after a failure.
BD_MUST_CHECK
enum bd_err bd_check_plan_make(const struct bd_check_frame *frame, uint32_t sample_count,
                               uint64_t seed, struct bd_check_plan *out,
                               struct bd_err_detail *detail);
void bd_check_plan_finish(struct bd_check_plan *plan);

// Whether the layers fit together: BD_ERR_USAGE names what is wrong.
BD_MUST_CHECK
enum bd_err bd_check_frame_check(const struct bd_check_frame *frame, struct bd_err_detail *detail);

#define BD_CHECK_DEPTH_OF_NOTHING_M 1e10f

// What is seen through the middle of a pixel.
struct bd_check_surface {
    float depth_m, normal[3], albedo[3];
};

// What the frame has there; 0 for layers that it has not.
struct bd_check_surface bd_check_surface_at(const struct bd_check_frame *frame, uint32_t x_px,
                                            uint32_t y_px);

// Whether two are so different that an edge lies between them.
bool bd_check_is_other_surface(const struct bd_check_surface *a, const struct bd_check_surface *b);

// Whether one of the pixel's eight neighbours shows another surface, as far as the frame tells.
bool bd_check_is_edge(const struct bd_check_frame *frame, uint32_t x_px, uint32_t y_px);

// The score of every pixel, rows from the top, adding up to about 1; 0 where beauty is not finite.
// NULL without memory. The caller frees it.
float *bd_check_scores(const struct bd_check_frame *frame);

// Of a pixel whose beauty is finite.
float bd_check_contrast(const struct bd_image *beauty, uint32_t index);

#endif
