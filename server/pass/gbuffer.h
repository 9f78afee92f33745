// G-buffer: what the camera sees (algorithms.md A0.1).
//
// Base colour is stored, not the diffuse albedo: the split into lobes belongs to who shades.
// Nothing is marked by `material`.w = 0, never by a large depth.

#ifndef BD_PASS_GBUFFER_H
#define BD_PASS_GBUFFER_H

#include <stdbool.h>

#include "pass/first_hits.h"
#include "pass/pass.h"
#include "upload/gpu_scene.h"

struct bd_gbuffer_inputs {
    const struct bd_gpu_scene *scene;
    const struct bd_viewpoint *viewpoint;
    bool lambert;                   // brdf=lambert
    bool emission;                  // some surface emits or is unlit
    bool glass;                     // lets light through: base colour is of what does not
    const struct bd_tracer *tracer; // who finds what is seen; NULL: all is drawn
};

struct bd_gbuffer {
    struct bd_tex *depth;    // R32F, along the view axis, render units
    struct bd_tex *normals;  // RGBA32UI, octahedral: shading, geometric; on the viewer's side
    struct bd_tex *albedo;   // RGBA16: base colour, metallic
    struct bd_tex *material; // RGBA16: roughness, F0 of a dielectric, unlit, covered
    struct bd_tex *triangle; // R32UI: id + 1
    struct bd_tex *emission; // RGBA32F, or NULL
};

BD_MUST_CHECK
enum bd_err bd_gbuffer_render(const struct bd_pass_context *context,
                              const struct bd_gbuffer_inputs *inputs, struct bd_gbuffer **out,
                              struct bd_err_detail *detail);
void bd_gbuffer_destroy(struct bd_gpu *gpu, struct bd_gbuffer **gbuffer);
uint64_t bd_gbuffer_bytes(const struct bd_gbuffer *gbuffer);

// Binds depth, normals, albedo and material for a compute pass (common/gbuffer.glsl).
void bd_gbuffer_bind(const struct bd_gbuffer *gbuffer, struct bd_bindings *bindings);

#endif
