// What the raster passes' shaders are told of a draw's material: the variant, the numbers, the
// maps.
//
// Thread: render thread.

#ifndef BD_PASS_SCENE_MATERIAL_H
#define BD_PASS_SCENE_MATERIAL_H

#include "pass/scene_draws.h"
#include "shared/material.h"

// Of what is not opaque it depends on the place whether something is there.
bool bd_material_has_holes(const struct bd_material *m);

struct bd_defines bd_material_defines(const struct bd_scene_draws *draws,
                                      const struct bd_scene_draw *draw);
struct bd_material_uniform bd_material_uniform_of(const struct bd_scene_draws *draws,
                                                  const struct bd_scene_draw *draw);
void bd_material_bind_maps(struct bd_bindings *bindings, const struct bd_gpu_scene *scene,
                           const struct bd_material *m);

#endif
