// Draws what a viewpoint sees as points, one a pixel, each of the triangle that the pixel's ray met
// first (pass/first_hits.h). What a vertex says is interpolated here, over the triangle's corners,
// in double precision and relative to the viewpoint; what follows from it is the shaders', as it is
// of triangles that are drawn. Corners' normals and tangents go in weighted by what the shader's
// turning makes of their lengths.
//
// Thread: render thread, between bd_gpu_target_begin and bd_gpu_target_end.

#ifndef BD_PASS_SCENE_POINTS_H
#define BD_PASS_SCENE_POINTS_H

#include "pass/scene_draws.h"

// With a tracer.
BD_MUST_CHECK
enum bd_err bd_scene_points_record(struct bd_gpu *gpu, const struct bd_scene_draws *draws,
                                   struct bd_slicer *slicer, struct bd_err_detail *detail);

#endif
