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
// Checked against the makers' programs (github.com/NVlabs/flip: the C++ header of versions 1.3 and
// 1.4, the Python of 1.1): every constant, matrix, kernel with its radius and border, exponent, the
// knee, the tone curve and the rule for the exposures. A transcript of their single-precision C++,
// run on the unit test's pictures, gave the figures that the test holds: ours are within 6e-7, and
// 4e-5 where the root of a feature difference near 0 makes rounding larger. The range published of
// their own test picture gives their 14 exposures; its means (0.1597, HDR 0.2835) could not be
// repeated without the picture. Ours departs in three ways: the median of an even number of pixels
// is the middle of two, as theirs was until 1.4 made it the upper one; of a reference that is black
// for the most part it is that of the lit pixels, and a black one has exposures, where theirs are
// infinite; and there are at most BD_FLIP_EXPOSURE_MAX exposures.
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
                        float *error, struct bd_err_detail *detail);

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
                        struct bd_err_detail *detail);

#endif
