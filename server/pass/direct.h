// Direct light of all punctual lights, with exact shadows, under the glTF BRDF.

#ifndef BD_PASS_DIRECT_H
#define BD_PASS_DIRECT_H

#include <stdbool.h>

#include "pass/gbuffer.h"
#include "pass/pass.h"
#include "pass/shadow_map.h"
#include "upload/light_setup.h"

struct bd_direct_light {
    const struct bd_light_setup *setup;
    const struct bd_shadow_map *shadow_map;
};

struct bd_direct_inputs {
    const struct bd_gpu_scene *scene;
    const struct bd_viewpoint *viewpoint;
    const struct bd_gbuffer *gbuffer;
    const struct bd_direct_light *lights; // in the order that they are summed in
    uint32_t light_count;                 // 0 is fine: the result is black
    bool lambert;
    bool irradiance; // is asked for, too
};

// RGBA32F, in the frame's light unit: outgoing radiance, and what falls on the surface's side that
// is seen; or NULL.
struct bd_direct {
    struct bd_tex *radiance, *irradiance;
};

BD_MUST_CHECK
enum bd_err bd_direct_run(const struct bd_pass_context *context,
                          const struct bd_direct_inputs *inputs, struct bd_direct **out,
                          struct bd_err_detail *detail);
void bd_direct_destroy(struct bd_gpu *gpu, struct bd_direct **direct);
uint64_t bd_direct_bytes(const struct bd_direct *direct);

#endif
