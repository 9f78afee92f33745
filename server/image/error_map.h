// A picture of where another one is wrong: |I - R| over the mean of R, logarithmic, with its scale
// beside it.
//
// The scale is the same for every map, so that two can be laid side by side: four decades, from
// 0.001 (nearly black) to 10 times the mean (nearly white); what lies beyond takes the end's
// colour. Lightness grows evenly along the bar, in CIE L*, so that it reads in grey too; pixels
// that are NaN or infinite are green, which the bar never is.
//
// The map's pixel (x, y) is the picture's; the bar and its labels lie to the right of it, and a low
// picture is padded below. Any thread.

#ifndef BD_IMAGE_ERROR_MAP_H
#define BD_IMAGE_ERROR_MAP_H

#include <stdint.h>

#include "base/err.h"
#include "image/glyphs.h"
#include "image/metric.h"

#define BD_ERROR_MAP_LOW  1e-3
#define BD_ERROR_MAP_HIGH 10.0

extern const uint8_t bd_error_map_nonfinite[3];

// The colour of an error, 0 and more, over the mean.
void bd_error_map_colour(double relative, uint8_t rgb[3]);

// `mean` is that of the reference; 0 shows every error as the largest. Free `out->rgb8`.
BD_MUST_CHECK
enum bd_err bd_error_map(const struct bd_metric_input *input, double mean, struct bd_canvas *out,
                         struct bd_err_detail *detail);

#endif
