// Spot checks: how wrong a frame is, from a few of its pixels traced by the reference.
//
// The figure is the headline of `bounce compare`, for the whole frame: relative RMSE
// sqrt(mean d) / mean R with d = (I - A)(I - B), over all channels of all pixels whose image is
// finite (algorithms.md E1, E2; image/metric.h). Only some pixels are traced:
//
//   - A first look traces one sample of each half all over the picture (check_scout.h).
//   - A ray to each pixel on an edge finds those where the frame shows another surface than the
//     reference (check_ties.h).
//   - A score says for each pixel how large its squared error may be: a mixture of what these looks
//     found, luminance, indirect light, contrast to the neighbours (beauty, indirect light, and how
//     far the indirect light sticks out of its neighbours), edges in depth, normal and albedo, the
//     level at which a multiresolution technique shaded it, and a constant.
//   - Pixels that score so high that each deserves a sample of its own are all traced. The rest is
//     cut into strata of equal total score; each gets the same number of samples, chosen without
//     replacement. A sample stands for (pixels of its stratum) / (samples of its stratum) pixels.
//   - Which pixels of a stratum are chosen is decided by a number that hangs on seed and pixel
//   alone:
//     frames of one view that differ a little choose mostly the same pixels, whose traced values
//     can be kept (struct bd_check_cache).
//
// The 95 % interval is one on the log of the error, by Student's t with a correction for skewness
// at the upper end, widened by what a pixel that was not looked at would add if it were as badly
// predicted as the worst that was. It includes the reference's own noise and the uncertainty of
// mean R. tests/bench/results/NOTES.md has its coverage.
//
// Thread: any one; tracing uses the pool's. Knows no scheduler and no technique.

#ifndef BD_REFERENCE_CHECK_H
#define BD_REFERENCE_CHECK_H

#include <stdbool.h>
#include <stdint.h>

#include "base/err.h"
#include "image/image.h"
#include "reference/reference.h"

#define BD_CHECK_PIXELS_MIN 16
#define BD_CHECK_PIXELS_MAX 65536

struct bd_check_surprise;
struct bd_check_ties;

// Layers of the frame, of one size; borrowed. All but beauty may be NULL: the score does without.
struct bd_check_frame {
    const struct bd_image *beauty;   // 3 or 4 channels; only RGB is read
    const struct bd_image *indirect; // 3
    const struct bd_image *normal;   // 3, unit; 0 where nothing is
    const struct bd_image *depth;    // 1, metres; 1e10 where nothing is
    const struct bd_image *albedo;   // 3
    const struct bd_image *level;    // 1: 0 = shaded at full resolution, 1 = at half, ...
    // What bd_check_run finds out by itself: NULL.
    const struct bd_check_surprise *surprise; // reference/check_scout.h
    const struct bd_check_ties *ties;         // reference/check_ties.h
};

// What traces, with everything but the pixel bound.
struct bd_check_tracer {
    // bd_reference_trace. Called on the loop's threads, for a handful of samples at once.
    void (*trace)(void *user, uint32_t x_px, uint32_t y_px, uint32_t first, uint32_t count,
                  struct bd_reference_pixel *pixel);
    // Calls work(work_user, i) for 0 <= i < count, each i once, in no order, on any threads, and
    // returns when all were; or stops early and says why. An item takes some milliseconds at most.
    enum bd_err (*loop)(void *user, uint32_t count, void (*work)(void *work_user, uint32_t i),
                        void *work_user);
    void *user;
    // What the camera sees through the middle of a pixel: adds coverage, albedo, normal and depth
    // of at least one sample. NULL where the frame's pixels are means over more than that.
    void (*first_surface)(void *user, uint32_t x_px, uint32_t y_px,
                          struct bd_reference_pixel *pixel);
};

struct bd_check_options {
    uint32_t pixel_count; // to trace; a frame with fewer is traced whole
    uint64_t seed;        // of the choice; the tracer has its own
    bool blind;           // nobody looks first: for means, which are not as uneven as errors
    uint64_t samples_max; // of both halves, all pixels together: where noise asks for more
    // NULL, or told the share that is done, 0 to 1, between pieces of the tracing.
    void (*progress)(void *user, double share);
    void *user;
};

extern const struct bd_check_options bd_check_options_default;

struct bd_check_result {
    // Relative RMSE and its 95 % interval. An error that drowns in the reference's noise has value
    // and low 0 and a finite high.
    double value, low, high;
    bool black; // no traced pixel has any light: all three are absolute, an RMSE in cd/m^2
    bool tail;  // 1 % of the samples carries over half of the sum: `high` is infinite
    uint32_t pixel_count;       // traced, or taken from the cache
    uint64_t sample_count;      // traced now, both halves
    uint64_t refused_ray_count; // of the samples behind the figure: beyond what can be traced
    double noise_share;         // the reference's, of the variance behind the interval; 0 to 1
    double noise;               // its relative standard deviation in `value`
    double sample_variance; // of one sample of the reference, as a part of mean_reference squared:
                            // its own relative RMSE at n samples a pixel is the root of this / n
    double mean_square;     // the two estimates that make `value`; mean_square may be below 0
    double mean_reference;
};

struct bd_check_cache;

// Chooses, traces and estimates. `cache` holds values of this very view, integrand and seed, or is
// NULL; what it holds saves time and changes no figure. BD_ERR_USAGE names what is wrong with the
// frame or the options; what made the loop stop is returned as it is.
BD_MUST_CHECK
enum bd_err bd_check_run(const struct bd_check_frame *frame, const struct bd_check_options *options,
                         const struct bd_check_tracer *tracer, struct bd_check_cache *cache,
                         struct bd_check_result *out, struct bd_err_detail *detail);

#endif
