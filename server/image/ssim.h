// Structural similarity: Wang, Bovik, Sheikh, Simoncelli, "Image Quality Assessment: From Error
// Visibility to Structural Similarity", IEEE TIP 13(4), 2004.
//
// Gaussian window of 11 x 11 with sigma 1.5, K1 = 0.01, K2 = 0.03, range 1, population moments, on
// one plane of display values in [0, 1]. Beyond an edge its last sample repeats; whoever wants the
// paper's mean takes pixels at least BD_SSIM_MARGIN_PX from every edge. Any thread.

#ifndef BD_IMAGE_SSIM_H
#define BD_IMAGE_SSIM_H

#include "base/err.h"
#include "image/filter.h"

#define BD_SSIM_MARGIN_PX 5

// The map, 1 where the planes are alike, -1 at the least. Symmetric. BD_ERR_NO_MEMORY.
BD_MUST_CHECK
enum bd_err bd_ssim(const float *a, const float *b, struct bd_plane_size size, float *map,
                    struct bd_err_detail *detail);

#endif
