// What a clamp of cos cos / r^2 takes off light that surfaces near a receiver send it, from what
// the camera sees of those: screen-space bias compensation (Novak, Engelhardt, Dachsbacher 2011).
//
//   X_0 = direct + clamped indirect light, as surfaces send it on, without emission
//   X_n = T_r X_(n-1), n = 1 .. iterations;   what is added: their sum
//
// algorithms.md A3, its errors mended: X, not the virtual lights (S2); a projected sphere's exact
// bounds (S3); power that is conserved (S4). What surfaces send on is all that their BRDF reflects,
// but evenly. The operator never creates energy: a part sends no more than its share of the
// hemisphere, less what the clamp left. Lobes reflect each part for themselves, as if they were as
// wide as it, and no more than comes.
//
// Exact as pixels become small, for surfaces that are in the picture, face the receiver and hide
// nothing from it. What hides behind others, or lies outside, is missing; surfaces that face it
// from behind others give it light. Where the screen is not seen to hold all that is near both can
// be left to rays (pass/screen.h).
//
// Cost: iterations x pixels x parts that are looked at, 100 to 1,000 (ReportCounts.screen_parts),
// by the device or the processor's loops; some .7 to 2 us a pixel and iteration of two cores.
// Levels are put together by the processor, whatever the device.
//
// Thread: render thread, and the pool's.

#ifndef BD_PASS_RESIDUAL_H
#define BD_PASS_RESIDUAL_H

#include "pass/gather.h"
#include "pass/screen.h"

struct bd_residual_inputs {
    struct bd_screen *screen; // what it sends is set
    struct bd_pool *pool;
    // What falls on surfaces that are seen, of direct light: RGBA32F, NULL where there is none.
    const struct bd_tex *direct, *area_light;
    float clamp;              // b, per render unit squared; above 0
    uint32_t iterations;      // at least 1
    bool once; // light is reflected once: direct light alone is sent on, in one iteration
    float smooth_sr, edge_sr; // above which a part is looked at closer, and one that spans an edge
};

// Adds to the irradiance of `indirect`, to what lobes reflect if the screen has surfaces, and to
// its count of parts, in a pass "residual".
BD_MUST_CHECK
enum bd_err bd_residual_run(const struct bd_pass_context *context,
                            const struct bd_residual_inputs *inputs, struct bd_indirect *indirect,
                            struct bd_err_detail *detail);

#endif
