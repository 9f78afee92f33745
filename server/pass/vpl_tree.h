// A quadtree of VPLs over each face of a reflective shadow map (Nichols, Shopf and Wyman 2009, 3.5;
// algorithms.md A2.4): leaves are a grid of VPLs, each inner node sums up its four children, so
// that a receiver may take a whole patch of the map for one light where that is good enough. By the
// processor's loops (pass/native) where the context has them.

#ifndef BD_PASS_VPL_TREE_H
#define BD_PASS_VPL_TREE_H

#include "pass/vpl_grid.h"

// Nodes of all faces, face by face, in a face level by level from the roots, in a level by Morton
// order: the children of a node lie together (shared/vpl_tree.h).
struct bd_vpl_tree {
    struct bd_buf *nodes;
    uint32_t face_count;
    uint32_t root_side, leaf_side; // nodes along a face's side; powers of two
    // Of the light, in render space and the frame's light unit, for who cuts the tree: solid angle
    // of a face (directional: its area), its peak intensity (lux), and the flux of the whole light,
    // both of the strongest channel. Of the first set (pass/light_paths.h) the surfaces' area and
    // their mean irradiance, as if they were lit from far away.
    double face_extent, intensity, flux;
};

struct bd_vpl_tree_inputs {
    const struct bd_vpl_list
        *leaves; // a grid of leaf_side x leaf_side a face, kernel disk or patch
    uint32_t leaf_side, face_count;
    uint32_t root_side; // at most leaf_side
    const struct bd_light_setup *light; // that the grid is a map of; NULL: leaves of the first set
    const struct bd_render_space *space;
    double area, flux; // where there is no light: of all leaves, and what they were sent
};

// Nodes of a face above level `level`, which has the roots as level 0.
uint32_t bd_vpl_tree_level_first(const struct bd_vpl_tree *tree, uint32_t level);
// Levels from the roots to the leaves, both counted.
uint32_t bd_vpl_tree_level_count(const struct bd_vpl_tree *tree);

BD_MUST_CHECK
enum bd_err bd_vpl_tree_run(const struct bd_pass_context *context,
                            const struct bd_vpl_tree_inputs *inputs, struct bd_vpl_tree **out,
                            struct bd_err_detail *detail);
void bd_vpl_tree_destroy(struct bd_gpu *gpu, struct bd_vpl_tree **tree);
uint64_t bd_vpl_tree_bytes(const struct bd_vpl_tree *tree);

#endif
