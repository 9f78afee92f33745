// Draws a scene into the current target with the variant of a shader that each material needs: its
// triangles, or for each pixel a point of the triangle that a ray met (pass/scene_points.h).
//
// The three raster passes (gbuffer, shadow_map, rsm) share this: same vertices, same materials,
// different fragment shader. A define is set only for what the material has, so that an
// untextured opaque scene compiles no texture and no alpha code.
//
// Thread: render thread, between bd_gpu_target_begin and bd_gpu_target_end.

#ifndef BD_PASS_SCENE_DRAWS_H
#define BD_PASS_SCENE_DRAWS_H

#include <stdbool.h>

#include "gpu/gpu.h"
#include "pass/first_hits.h"
#include "pass/slicer.h"
#include "upload/gpu_scene.h"

struct bd_scene_draws {
    const struct bd_gpu_scene *scene;
    const struct bd_viewpoint *viewpoint;
    const char *fragment;   // under shaders/
    bool surface;           // reads normals, colours and maps; otherwise positions and masks only
    bool emission;          // reads emission
    bool glass;             // reads transmission
    bool cull_single_sided; // back faces of single-sided materials: camera rays only
    bool lambert;           // brdf=lambert: no metallic and roughness
    const struct bd_tracer *tracer; // who finds what is seen; NULL: all is drawn
};

BD_MUST_CHECK
enum bd_err bd_scene_draws_record(struct bd_gpu *gpu, const struct bd_scene_draws *draws,
                                  struct bd_slicer *slicer, struct bd_err_detail *detail);

#endif
