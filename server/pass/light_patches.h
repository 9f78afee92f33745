// Points that are lit, divided into patches of about equal flux, along the axis in which they
// differ most, by place or by facing: a patch is a VPL, with the flux of all its points, their mean
// place on the surface of the one in its middle, and their area. What lies apart from the others of
// its patch, on another surface or in another room, is one of its own, as far as an eighth of all
// goes. But for those neighbours in the list are neighbours in the scene. The flux of all VPLs is
// that of the points. Private to pass/.
//
// Patches that lie side by side are why points are not drawn by chance: squares about 1,024 points
// that were overlap and leave gaps, and a furnace's corners were off by 15 %, of patches by 2 %.
//
// Thread: render thread.

#ifndef BD_PASS_LIGHT_PATCHES_H
#define BD_PASS_LIGHT_PATCHES_H

#include "lights/surface_points.h"
#include "pass/slicer.h"
#include "pass/vpl_grid.h"
#include "shared/types.h"
#include "shared/vpl.h"

struct bd_light_patches_inputs {
    const struct bd_surface_points *points;
    const f3 *irradiance; // of each
    uint32_t count;       // of VPLs
    enum bd_vpl_kernel kernel;
    double near_field;  // as in pass/vpl_grid.h
    uint32_t root_side; // of a tree over them, `count` a square of a power of two; 0: none
    struct bd_slicer *slicer;
};

// Where fewer points are lit than VPLs, some send nothing.
struct bd_light_patches {
    struct bd_vec4 (*lights)[BD_VPL_VEC4S], (*quads)[BD_VPL_QUAD_VEC4S];
    double area, flux; // of all; what they were sent, of the strongest channel
};

// BD_ERR_NO_MEMORY, or what the slicer's pause returns.
BD_MUST_CHECK
enum bd_err bd_light_patches_init(struct bd_light_patches *patches,
                                  const struct bd_light_patches_inputs *inputs,
                                  struct bd_err_detail *detail);
void bd_light_patches_finish(struct bd_light_patches *patches);

#endif
