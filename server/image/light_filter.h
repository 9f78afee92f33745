// A filter for what is noisy: light that was sampled a few times a pixel, smoothed along surfaces
// as far as its noise goes.
//
// The light comes as two halves that share no random number. Their difference is the noise, and
// nothing is guessed of it from neighbours that may differ for a reason. Light is divided by what
// reflects it (albedo), smoothed by an edge-avoiding a-trous wavelet (Dammertz et al. 2010; with
// weights by variance: Schied et al. 2017, SVGF), and multiplied again. Each half is weighed by the
// other one, so that a sample does not decide on its own weight and means stay (cross filtering:
// Rousselle et al. 2012).
//
//   w(p, q) = B3(q - p) max(n_p . n_q, 0)^16 bump(plane) bump(|l_p - l_q| / (2 C sigma))
//   bump(x) = max(1 - x^2, 0)^2, C = 2
//
// plane: how far 1 / depth at q is off what its gradient at p says, times the larger depth, over
// 1 %: 0 on any plane, however slanted. sigma^2: of both places, the halves' squared difference,
// smoothed along the surface. Where there is no noise nothing is smoothed, and as it goes to 0 the
// result goes to the mean of the halves. Pixels without a surface, or whose light is no number,
// stay. Where the result is one of several pictures whose mean is shown, a part of sigma^2 is
// enough: what is smoothed less and less goes to the truth.
//
// The number of levels follows the height of the picture: 3 at 192 rows, one more for each
// doubling.
//
// Thread: one pass at a time, its rows on any. The same bytes, however rows are spread.

#ifndef BD_IMAGE_LIGHT_FILTER_H
#define BD_IMAGE_LIGHT_FILTER_H

#include <stdbool.h>

#include "image/image.h"

// All of one size. Borrowed until the filter is destroyed.
struct bd_light_filter_inputs {
    const struct bd_image *half[2]; // 3 channels
    const struct bd_image *albedo;  // 3 channels; NULL: the light is divided by it already
    const struct bd_image *normal;  // 3 channels, unit; zero where there is no surface
    const struct bd_image *depth;   // 1 channel, > 0, along the view axis
    uint32_t level_count;           // 0 = by the height; fewer for noise of high frequencies alone
    float variance_part;            // of sigma^2, above 0 to 1; 0 = 1
    const struct bd_image *parts;   // 1 channel, of that at each pixel, above 0 to 1; NULL: all
};

struct bd_light_filter;

// 88 bytes a pixel. BD_ERR_NO_MEMORY.
BD_MUST_CHECK
enum bd_err bd_light_filter_create(const struct bd_light_filter_inputs *inputs,
                                   struct bd_light_filter **out, struct bd_err_detail *detail);
void bd_light_filter_destroy(struct bd_light_filter **filter);

// False: the halves are the same everywhere, and there is nothing to be done.
bool bd_light_filter_is_needed(const struct bd_light_filter *filter);

// Every row of a pass before any of the next.
uint32_t bd_light_filter_pass_count(const struct bd_light_filter *filter);
void bd_light_filter_row(struct bd_light_filter *filter, uint32_t pass, uint32_t y_px);

// After the last pass: the smoothed light, into an image of 3 channels.
void bd_light_filter_store(const struct bd_light_filter *filter, struct bd_image *light);
// How wrong it still is, by what the halves tell: into an image of 4 channels half the difference
// of the smoothed halves, whose square is in the mean the variance of their mean, but for what both
// have in common; and the square of blur, a mean over channels, taken to be a tenth of the variance
// that smoothing took off, times that part of sigma^2: edges are smoothed as far as they drown in
// noise. (The product of what it changed in each half would tell without a guess if they did not
// weigh each other: it is below 0.) 0 where nothing was smoothed. Before `store`, if that goes to
// one of the halves.
void bd_light_filter_store_doubt(const struct bd_light_filter *filter, struct bd_image *doubt);

// All of it, on this thread. BD_ERR_NO_MEMORY leaves `light` alone.
BD_MUST_CHECK
enum bd_err bd_light_filter_run(const struct bd_light_filter_inputs *inputs, struct bd_image *light,
                                struct bd_err_detail *detail);

// Beauty of what became of its parts: direct, indirect and emission, of 3 channels. Its alpha
// stays.
void bd_light_add_up(const struct bd_image *const parts[3], struct bd_image *beauty);

#endif
