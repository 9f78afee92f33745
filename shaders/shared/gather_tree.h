// Arguments of pass/gather_tree.
#ifndef BD_SHARED_GATHER_TREE_H
#define BD_SHARED_GATHER_TREE_H

#include "shared/types.h"

#define BD_TREE_CRITERION_LIGHTCUTS 0u
#define BD_TREE_CRITERION_BOUND     1u
#define BD_TREE_CRITERION_LEVEL     2u
#define BD_TREE_CRITERION_PRINTED   3u

struct bd_gather_tree_args {
    BD_UINT first_row;  // of the slice, where receivers are pixels
    BD_UINT row_count;  // in it
    BD_UINT is_first;   // 1: nothing was added before
    BD_UINT is_resumed; // 1: walks go on where they were; 0 in the light's first round

    BD_UINT first_root;  // counted over all faces
    BD_UINT root_count;  // from there on
    BD_UINT root_side;   // roots along a face's side
    BD_UINT level_count; // levels from the roots to the leaves, both counted

    BD_UINT criterion;       // BD_TREE_CRITERION_*
    BD_UINT nodes_per_round; // that a receiver may visit
    BD_UINT nodes_per_root;  // with itself
    BD_UINT round;           // its number, above 0

    BD_FLOAT tau_relative;   // how far off a node may be, as a part of the estimate
    BD_FLOAT tau_absolute;   // the same as irradiance in the frame's light unit
    BD_FLOAT estimate_min;   // of a receiver's irradiance; for less nothing is refined
    BD_FLOAT steps_per_unit; // of irradiance: estimates are whole numbers of steps

    BD_FLOAT face_flux;   // of the light, through a face
    BD_FLOAT face_extent; // solid angle of a face (directional: area)
    BD_FLOAT per_m2;      // 1 / m^2 in render space: printed formulas have units
    BD_UINT finest_level; // whose blocks may hold several surfaces

    BD_UINT first_column;   // of the slice, where receivers are pixels
    BD_UINT column_count;   // in it
    BD_UINT first_fragment; // of the slice, where receivers are fragments
    BD_UINT fragment_count; // in it
};

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_gather_tree_args) == 96, "std140 size");
#endif

#endif
