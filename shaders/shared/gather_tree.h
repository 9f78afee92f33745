// Arguments of pass/gather_tree.
#ifndef BD_SHARED_GATHER_TREE_H
#define BD_SHARED_GATHER_TREE_H

#include "shared/types.h"

#define BD_TREE_CRITERION_LIGHTCUTS 0u
#define BD_TREE_CRITERION_BOUND     1u
#define BD_TREE_CRITERION_LEVEL     2u
#define BD_TREE_CRITERION_PRINTED   3u

struct bd_gather_tree_args {
    BD_UVEC4 rows; // x = first row (fragment) of the slice, y = how many, z = 1 if nothing was
                   // added before, w = 0 if this is the light's first round
    BD_UVEC4 tree; // x = first root, counted over all faces, y = how many, z = roots along a face's
                   // side, w = levels from the roots to the leaves, both counted
    BD_UVEC4 cut;  // x = BD_TREE_CRITERION_*, y = nodes that a receiver may visit in a round,
                   // z = nodes of a root, itself counted, w = number of the round, above 0
    BD_VEC4 tau;   // x = relative, y = as irradiance in the frame's light unit, z = least estimate
                   // of a receiver's irradiance that is worth refining for, w = steps in which
                   // estimates are counted, of a unit
    BD_VEC4 light; // x = flux through a face, y = solid angle of a face (directional: area),
                   // z = metres^-2 in render space: printed formulas have units
    BD_UVEC4 blocks; // x = finest level, whose blocks may hold several surfaces; of pixels:
                     // y = first column of the slice, z = how many
};

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_gather_tree_args) == 96, "std140 size");
#endif

#endif
