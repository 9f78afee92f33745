// Shadow map: for each texel of each face of a light, the triangle that the light sees first.
//
// Ids, not depths: pass/direct intersects the triangles named around a receiver's texel, which
// makes shadow edges exact and a depth bias needless (shaders/common/shadow.glsl).

#ifndef BD_PASS_SHADOW_MAP_H
#define BD_PASS_SHADOW_MAP_H

#include "pass/first_hits.h"
#include "pass/pass.h"
#include "upload/gpu_scene.h"
#include "upload/light_setup.h"

struct bd_shadow_map {
    struct bd_tex *ids; // R32UI array, a layer a face: triangle id + 1, bit 31 = alpha-masked
    uint32_t side_px;
};

// `tracer` finds what the light sees; NULL: all is drawn.
BD_MUST_CHECK
enum bd_err bd_shadow_map_render(const struct bd_pass_context *context,
                                 const struct bd_gpu_scene *scene,
                                 const struct bd_light_setup *light, uint32_t side_px,
                                 const struct bd_tracer *tracer, struct bd_shadow_map **out,
                                 struct bd_err_detail *detail);
void bd_shadow_map_destroy(struct bd_gpu *gpu, struct bd_shadow_map **map);
uint64_t bd_shadow_map_bytes(const struct bd_shadow_map *map);

#endif
