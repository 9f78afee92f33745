// Reflective shadow map: the surfaces that a light sees, with the flux through each texel
// (Dachsbacher and Stamminger 2005; algorithms.md A0.2).

#ifndef BD_PASS_RSM_H
#define BD_PASS_RSM_H

#include <stdbool.h>

#include "pass/pass.h"
#include "upload/gpu_scene.h"
#include "upload/light_setup.h"

struct bd_rsm_inputs {
    const struct bd_gpu_scene *scene;
    const struct bd_light_setup *light;
    uint32_t side_px;
    bool lambert;    // brdf=lambert: metals reflect their base colour diffusely
    bool paper_mode; // equal solid angles
};

// Arrays, a layer a face.
struct bd_rsm {
    struct bd_tex *position; // RGBA32F render space, w = 1 where something is
    struct bd_tex *normals;  // RG32UI, octahedral: shading, geometric; on the light's side
    struct bd_tex *albedo;   // RGBA16, of the diffuse lobe
    struct bd_tex *weight;   // RG32F, pass/rsm_weights.h; one layer if all faces are alike
    uint32_t side_px, face_count, weight_layer_count;
};

BD_MUST_CHECK
enum bd_err bd_rsm_render(const struct bd_pass_context *context, const struct bd_rsm_inputs *inputs,
                          struct bd_rsm **out, struct bd_fault *fault);
void bd_rsm_destroy(struct bd_gpu *gpu, struct bd_rsm **rsm);
uint64_t bd_rsm_bytes(const struct bd_rsm *rsm);

#endif
