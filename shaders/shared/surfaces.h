// What pass/surfaces leaves of each block of level 1 or coarser, and its arguments.
#ifndef BD_SHARED_SURFACES_H
#define BD_SHARED_SURFACES_H

#include "shared/multires.h"

// A word a block: what is left of it in the end.
#define BD_SURFACES_INNER 1u // the eight around it hold light of its surface; its children are lit
#define BD_SURFACES_DEEP  2u // and nothing jumps in any of the nine, or in what they lie in

// On the way there pairs of neighbours are looked at, once each: bits 0 to 3 tell of the blocks at
// (1, 0), (0, 1), (1, 1), (-1, 1) from this one whether they hold light of the same surface, and
// the other four neighbours have bits that tell of this one.
#define BD_SURFACES_ALL_PAIRS 15u

// Of the children of a block, one by one. x: six bits each, whether it is one surface with its
// parent, with the parent's neighbour beside it along x, along y, along both, and with the opposite
// one along x, along y; then a bit each, whether it can be lit.
#define BD_SURFACES_CHILD(x, i) ((x) >> (6 * (i)) & 0x3fu)
#define BD_SURFACES_LIT(x, i)   ((x) >> (24 + (i)) & 1u)
#define BD_SURFACES_HOME        0x01u
#define BD_SURFACES_BESIDE(i)   (2u << (i))
#define BD_SURFACES_OPPOSITE(i) (16u << (i))
// y: five bits each, for fragments of its surface and its own level in neighbours of the parent
// that hold no light: beside it along x, along y, along both; along x and back along y; the
// reverse.
#define BD_SURFACES_CELLS(y, i) ((y) >> (5 * (i)) & 0x1fu)

struct bd_surfaces_args {
    BD_UINT first_row;    // of the slice, where it is rows of blocks
    BD_UINT row_count;    // in it
    BD_UINT finest_level; // whose blocks are not split (pass/fragments.h)
    BD_UINT first_outer;  // where the level's outer blocks begin in their list

    BD_MULTIRES_LEVEL level;   // of the blocks
    BD_MULTIRES_LEVEL finer;   // of their children
    BD_MULTIRES_LEVEL coarser; // of their parents

    BD_UINT width_px; // of the picture
    BD_UINT height_px;
    BD_UINT unused_0;
    BD_UINT unused_1;

    BD_UINT first_children; // where the words of the level's children begin in theirs
    BD_UINT first_item;     // of the slice, where it is a list of the level's blocks
    BD_UINT item_count;     // in it
    BD_UINT unused_2;
};

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_surfaces_args) == 96, "std140 size");
#endif

#endif
