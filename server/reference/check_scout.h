// A first look for a spot check: one sample of each half all over the picture, before pixels are
// chosen. What the frame itself does not hint at (a punctual light that it leaves out, light from
// behind the camera, a pole thinner than a pixel) is seen here, roughly; the samples take no part
// in the estimate. Private to reference/.

#ifndef BD_REFERENCE_CHECK_SCOUT_H
#define BD_REFERENCE_CHECK_SCOUT_H

#include "reference/check.h"
#include "reference/check_cache.h"

struct bd_check_surprise {
    uint32_t step_px, columns; // of blocks, rows from the top: 4,096 at most, each looked at once
    double *blocks; // two numbers each: how far the frame is off there, squared, and the same over
                    // the neighbourhood
};

// The two numbers of a pixel's block.
static inline const double *bd_check_surprise_at(const struct bd_check_surprise *surprise,
                                                 uint32_t x_px, uint32_t y_px)
{
    return surprise->blocks +
           2 * ((size_t)(y_px / surprise->step_px) * surprise->columns + x_px / surprise->step_px);
}

// What `cache` (or NULL) has of the view is not traced again. The same frame, seed and tracer make
// the same surprises. The caller frees out->blocks, also after an error. Adds what was traced to
// `*sample_count`.
BD_MUST_CHECK
enum bd_err bd_check_scout(const struct bd_check_frame *frame, uint64_t seed,
                           const struct bd_check_tracer *tracer, struct bd_check_cache *cache,
                           uint64_t *sample_count, struct bd_check_surprise *out,
                           struct bd_err_detail *detail);

#endif
