// What is asked of a frame, and how it is checked. Plain data: a job is this, a snapshot and a
// seed, and renders the same bytes wherever it runs on the same class of device.

#ifndef BD_FRAME_REQUEST_H
#define BD_FRAME_REQUEST_H

#include <stdbool.h>
#include <stdint.h>

#include "base/err.h"
#include "base/vec.h"
#include "protocol/frame_words.h"
#include "scene/model/framing.h"
#include "technique/params.h"

enum bd_layer {
    BD_LAYER_BEAUTY,   // RGBA: direct + indirect + emission in cd/m^2, alpha = coverage
    BD_LAYER_DIRECT,   // RGB, outgoing radiance, albedo included
    BD_LAYER_INDIRECT, // RGB
    BD_LAYER_EMISSION, // RGB
    BD_LAYER_ALBEDO,   // RGB
    BD_LAYER_NORMAL,   // XYZ, world space, unit where covered; 0 where nothing is
    BD_LAYER_DEPTH,    // Z, metres along the view axis; 1e10 where nothing is
    // RGB: half the difference of the two pictures whose mean beauty is, by what half of the random
    // numbers each. Its square is in the mean the variance of beauty, but for what both have in
    // common. 0 where nothing is decided by chance.
    BD_LAYER_NOISE,
    // Y, (cd/m^2)^2: the square of what smoothing is taken to have made wrong, a mean over channels
    // (image/light_filter.h); sums of it tell something, single pixels do not, and can be negative.
    BD_LAYER_BLUR,
    BD_LAYER_RENDERED_COUNT,

    // Of technique reference alone: the layers of light as means over each half of the samples, in
    // the order beauty, direct, indirect, emission; the layer itself is the mean of its halves.
    BD_LAYER_HALF_A = BD_LAYER_RENDERED_COUNT, // RGB each
    BD_LAYER_HALF_B = BD_LAYER_HALF_A + 4,
    // Variance of the mean over both halves, (cd/m^2)^2, channel by channel.
    BD_LAYER_VARIANCE = BD_LAYER_HALF_B + 4, // RGB, of beauty
    BD_LAYER_DIRECT_VARIANCE,                // RGB
    BD_LAYER_INDIRECT_VARIANCE,              // RGB
    // Length of the mean of the normals met, 1 where they agree: `normal` times this is their mean.
    BD_LAYER_NORMAL_LENGTH,
    BD_LAYER_COUNT,
};

// What its own estimate of a frame's error is made from.
#define BD_LAYERS_DOUBT (1u << BD_LAYER_NOISE | 1u << BD_LAYER_BLUR)

// What auto exposure is measured on where indirect light comes through walls.
#define BD_LAYERS_METERED (1u << BD_LAYER_DIRECT | 1u << BD_LAYER_EMISSION)

// "beauty", "half_a.direct", "variance", ...; NULL for an index out of range.
const char *bd_layer_name(enum bd_layer layer);
// 4, 3 or 1.
uint32_t bd_layer_channel_count(enum bd_layer layer);
// The layers that a name in a list of layers stands for, as bits; 0 if there are none. "halves" is
// all eight, "variance" all three; every other name is one.
uint32_t bd_layers_named(const char *name);

// Ranges are those of protocol/frame_options.h, which whoever reads a request holds it to.
struct bd_frame_request {
    char technique[32];          // "" and "auto": by what is given and what the scene has
    struct bd_param_list params; // KEY=VALUE pairs as given; technique/params.h checks them
    uint32_t width_px, height_px;
    char camera[64];  // node name, camera name or index; "" = the scene's first
    struct bd_pose pose; // instead of a camera
    uint32_t layers;  // bit (1 << enum bd_layer); beauty is always rendered
    bool auto_exposure; // what it is measured on is rendered too (BD_LAYERS_METERED)
    uint32_t region[4]; // x, y, width, height of what technique reference traces; all 0 = all
    uint32_t aa;        // sub-frames averaged, 1 to 4096 (frame/sub_frames.h)
    uint64_t seed;
    uint32_t deadline_ms; // 0 = none; counted from submission
    // 0 = none; with one the best settings of the technique's ladder that it is likely good for,
    // what is done once (programs, uploads) not counted. The clock decides.
    uint32_t budget_ms;
    // Estimate the error of the frame from so many pixels traced by the reference; 0 = do not.
    // Relative error to refine for, 0 = none: then `check_pixels` 0 stands for 512.
    uint32_t check_pixels;
    double target_error;
    enum bd_against against; // what decides; the other figure is in the report too
    enum bd_fresh fresh;
    bool plan_only;       // report what would run and what is left out; render nothing
};

// One beauty layer at 512x512, the default technique, aa 1.
extern const struct bd_frame_request bd_frame_request_default;

struct bd_frame_limits {
    uint32_t side_px_max;     // width or height
    uint64_t pixel_count_max; // width x height
    uint64_t reply_bytes_max; // layers of a traced frame, as floats; 0 = any
};

// Whether the processor traces it instead of the device rendering it.
bool bd_frame_request_is_traced(const struct bd_frame_request *request);

// Whether its error is to be estimated: by `check_pixels`, or for `target_error`.
bool bd_frame_request_is_checked(const struct bd_frame_request *request);

// The checks that need no scene. Names the field and the limit.
BD_MUST_CHECK
enum bd_err bd_frame_request_check(const struct bd_frame_request *request,
                                   const struct bd_frame_limits *limits,
                                   struct bd_err_detail *detail);

#endif
