// FLIP: how different two pictures look to someone who flips between them, 0 to 1 a pixel.
//
//   LDR  Andersson, Nilsson, Akenine-Moller, Oskarsson, Astrom, Fairchild, "FLIP: A Difference
//        Evaluator for Alternating Images", HPG 2020: both pictures blurred by the eye's contrast
//        sensitivity, their colours compared by HyAB in Hunt-adjusted L*a*b*, and the result raised
//        where edges and points differ.
//   HDR  Andersson, Nilsson, Shirley, Akenine-Moller, "Visualizing Errors in Rendered High Dynamic
//        Range Images", Eurographics 2021 short papers: the largest LDR error of each pixel over a
//        range of exposures that the reference decides.
//
// Symmetric in LDR; in HDR but for the exposures. Two threads of its own within a call. Otherwise
// any thread.

#ifndef BD_IMAGE_FLIP_H
#define BD_IMAGE_FLIP_H

#include <stdint.h>

#include "base/err.h"
#include "image/image.h"

// Pixels per degree of vision: a display 0.7 m and 3840 pixels wide, seen from 0.7 m.
#define BD_FLIP_PPD_DEFAULT 67.0206432766
#define BD_FLIP_PPD_MIN     5.0
#define BD_FLIP_PPD_MAX     400.0

#define BD_FLIP_EXPOSURE_MAX 48

// Both pictures have 3 channels and one size, display-linear in [0, 1] (image/display.h); `error`
// one float a pixel. BD_ERR_NO_MEMORY.
BD_MUST_CHECK
enum bd_err bd_flip_ldr(const struct bd_image *reference, const struct bd_image *image, double ppd,
                        float *error, struct bd_fault *fault);

// In stops. At the first the reference's brightest pixel, at the last its median one are at 0.85 of
// the display's range.
struct bd_flip_exposures {
    double start, stop;
    uint32_t count; // spread evenly, about a stop apart: 2 to BD_FLIP_EXPOSURE_MAX
};

// `median` and `max` of the reference's luminance (struct bd_luminance_range). A black reference
// gets two exposures of 0 stops.
struct bd_flip_exposures bd_flip_exposures(double median, double max);

// Scene-linear pictures of 3 channels and one size. The same exposures make figures comparable.
BD_MUST_CHECK
enum bd_err bd_flip_hdr(const struct bd_image *reference, const struct bd_image *image, double ppd,
                        const struct bd_flip_exposures *exposures, float *error,
                        struct bd_fault *fault);

#endif
