// Reflective shadow map: the surfaces that a light sees, with the flux through each texel
// (Dachsbacher and Stamminger 2005; algorithms.md A0.2).

#ifndef BD_PASS_RSM_H
#define BD_PASS_RSM_H

#include <stdbool.h>

#include "pass/first_hits.h"
#include "pass/pass.h"
#include "upload/gpu_scene.h"
#include "upload/light_setup.h"

// Texel weights on the device. They follow the light's shape alone: maps of one light share them
// wherever it goes, because to work them out takes longer than to draw the map.
struct bd_rsm_weight_map {
    struct bd_tex *tex;   // RG32F, an array; pass/rsm_weights.h
    uint32_t layer_count; // 1 if all faces are alike, otherwise 6
    uint32_t owner_count;
};

struct bd_rsm_inputs {
    const struct bd_gpu_scene *scene;
    const struct bd_light_setup *light;
    uint32_t side_px;
    bool lambert;                   // brdf=lambert: metals reflect their base colour diffusely
    bool paper_mode;                // equal solid angles
    const struct bd_tracer *tracer; // who finds what is seen; NULL: all is drawn
    // Of a light of this shape, at this side and mode; NULL: made for this map.
    struct bd_rsm_weight_map *weights;
};

// Arrays, a layer a face.
struct bd_rsm {
    struct bd_tex *position; // RGBA32F render space, w = 1 where something is
    struct bd_tex *normals;  // RG32UI, octahedral: shading, geometric; on the light's side
    struct bd_tex *albedo;   // RGBA16, of the diffuse lobe
    struct bd_rsm_weight_map *weights;
    uint32_t side_px, face_count;
};

// The caller is its one owner; each map that takes it becomes another.
BD_MUST_CHECK
enum bd_err bd_rsm_weight_map_create(const struct bd_pass_context *context,
                                     const struct bd_rsm_inputs *inputs,
                                     struct bd_rsm_weight_map **out, struct bd_err_detail *detail);
// Nulls; takes NULL. The last owner's release frees it.
void bd_rsm_weight_map_release(struct bd_gpu *gpu, struct bd_rsm_weight_map **map);

BD_MUST_CHECK
enum bd_err bd_rsm_render(const struct bd_pass_context *context, const struct bd_rsm_inputs *inputs,
                          struct bd_rsm **out, struct bd_err_detail *detail);
void bd_rsm_destroy(struct bd_gpu *gpu, struct bd_rsm **rsm);
// Without its weights, which it may share.
uint64_t bd_rsm_bytes(const struct bd_rsm *rsm);

#endif
