// A tree of VPLs (algorithms.md A2.4) and the arguments of the pass that builds it.
//
// Faces one after the other; in a face the levels from the roots on; in a level the nodes in Morton
// order of their place in the face, so that the children of node m are 4 m .. 4 m + 3 of the next
// level. Level l of a face has root_side^2 4^l nodes and begins at root_side^2 (4^l - 1) / 3.
//
// A node, seven vec4s. Sums and means are over the leaves below that send light; where there is
// none flux, area and radiosity are 0, and the box is turned inside out.
//   0: xyz position, mean weighted by flux; w = area in the kernel's denominator, summed
//   1: xyz mean of the unit normals, weighted by flux: shorter than 1 where they differ;
//      w = chord: no leaf's normal, nor that of its patch, is farther from the mean than this
//   2: xyz outgoing flux, summed; w = radiosity: the strongest channel of P / A, summed (for the
//      bare kernel, which has no bound, a large number)
//   3: xyz least corner of the box around all patches; w = largest squared distance from the light
//      (directional: 1)
//   4: xyz greatest corner; w = of a leaf: square of the distance below which its patch is
//      integrated exactly (shared/vpl.h), else 0
//   5, 6: the first of the node's two lobes: 5.xyz mean position, weighted by flux; 5.w = its share
//      of the flux; 6.xyz mean normal times that share; 6.w unused. What is left of 0 and 1 is the
//      second lobe's
//
// A lobe is leaves that face alike. Two surfaces that meet under a node are far from one in the
// middle: some receivers see one of them alone, at its own place. A leaf has one lobe.
//
// What all leaves of a node together send to a point is at most their summed radiosity, since no
// form factor exceeds 1. Not the largest radiosity among them: without occlusion two patches one
// behind the other both fill the point's view.
#ifndef BD_SHARED_VPL_TREE_H
#define BD_SHARED_VPL_TREE_H

#include "shared/types.h"

#define BD_TREE_NODE_VEC4S 7

struct bd_vpl_tree_args {
    BD_UINT level_node_count; // nodes of this level in a face
    BD_UINT level_first_node; // index of its first one in the face
    BD_UINT face_node_count;  // nodes of a face, all levels
    BD_UINT has_leaves;       // 1: nodes of this level are made from the list of VPLs

    BD_UINT face_count; // of the light
    BD_UINT leaf_side;  // leaves along a face's side
    BD_UINT first_node; // of the slice, in each face's level
    BD_UINT node_count; // in it
};

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_vpl_tree_args) == 32, "std140 size");
#endif

#endif
