// VPLs from a regular grid over a reflective shadow map: the virtual point lights of one light.
//
// Sum of outgoing flux over the list = sum over the map's texels, whatever the grid.

#ifndef BD_PASS_VPL_GRID_H
#define BD_PASS_VPL_GRID_H

#include "pass/pass.h"
#include "pass/rsm.h"

enum bd_vpl_kernel {
    BD_KERNEL_PATCH, // disk, and nearer than near_field radii the exact form of the patch
    BD_KERNEL_DISK,  // Wallace's disk-to-point form everywhere
    BD_KERNEL_POINT, // bare 1 / r^2: an oracle's kernel, unbounded near a VPL
};

struct bd_vpl_grid_inputs {
    const struct bd_rsm *rsm;
    const struct bd_light_setup *light;
    const struct bd_render_space *space;
    uint32_t grid_side; // VPLs along one face's side, 1 .. rsm->side_px
    enum bd_vpl_kernel kernel;
    double near_field; // radii of a VPL's disk, or half lengths of its patch if that is longer
};

struct bd_vpl_list {
    struct bd_buf *vpls, *quads; // shared/vpl.h
    struct bd_buf *groups; // of neighbours, of a long list in order (pass/vpl_groups.h), or NULL
    uint32_t count;
    // Of a list that was made soft (pass/vpl_order.h) the area of each, of one that was clamped the
    // bound of cos cos / r^2, in render units; else 0.
    float soft_area, clamp;
};

BD_MUST_CHECK
enum bd_err bd_vpl_grid_run(const struct bd_pass_context *context,
                            const struct bd_vpl_grid_inputs *inputs, struct bd_vpl_list **out,
                            struct bd_err_detail *detail);
// Its buffers, for whoever fills them. A list may be empty.
BD_MUST_CHECK
enum bd_err bd_vpl_list_create(struct bd_gpu *gpu, uint32_t count, struct bd_vpl_list **out,
                               struct bd_err_detail *detail);
void bd_vpl_list_destroy(struct bd_gpu *gpu, struct bd_vpl_list **list);
uint64_t bd_vpl_list_bytes(const struct bd_vpl_list *list);

#endif
