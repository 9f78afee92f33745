// Image-space radiosity's VPLs: blocks of several sizes over a reflective shadow map, large where
// the map is smooth, so that they follow what the light sees (Nichols, Shopf and Wyman 2009, 3.4;
// algorithms.md A2.3). The blocks are the fragments of the light's view; each carries the summed
// flux of its texels, so that the total is that of the map whatever the clustering.

#ifndef BD_PASS_VPL_CLUSTERS_H
#define BD_PASS_VPL_CLUSTERS_H

#include "pass/fragments.h"
#include "pass/vpl_grid.h"

struct bd_vpl_clusters_inputs {
    const struct bd_rsm *rsm;
    const struct bd_light_setup *light;
    const struct bd_render_space *space;
    struct bd_discontinuity_settings settings; // of the light's view
    uint32_t finest_block_texels;              // a cluster's least side, a power of two
    enum bd_vpl_kernel kernel;
    double near_field;
};

// The same list that vpl_grid makes (shared/vpl.h).
BD_MUST_CHECK
enum bd_err bd_vpl_clusters_run(const struct bd_pass_context *context,
                                const struct bd_vpl_clusters_inputs *inputs,
                                struct bd_vpl_list **out, struct bd_err_detail *detail);

#endif
