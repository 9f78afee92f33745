// Arguments of pass/subsplats.
//
// The lists of subsplats of 32 VPLs are one list of blocks, with a word of a bit mask each: whose
// lists the block is in. A batch of BD_SUBSPLAT_VPLS has BD_SUBSPLAT_WORDS such words a block.
#ifndef BD_SHARED_SUBSPLATS_H
#define BD_SHARED_SUBSPLATS_H

#include "shared/types.h"

#define BD_SUBSPLAT_WORDS 8u
#define BD_SUBSPLAT_VPLS  (32u * BD_SUBSPLAT_WORDS)
#define BD_SUBSPLAT_GROUP 64u // work-group size
#define BD_SUBSPLAT_RUN   64u // numbers that one invocation adds up

// In whose lists the blocks are.
#define BD_SUBSPLAT_ALL       0u // of every VPL of the batch: the first list
#define BD_SUBSPLAT_MASKED    1u
#define BD_SUBSPLAT_LEFT_OVER 2u // of those that wanted it split, where there was no room

struct bd_subsplats_args {
    // x = place in the buffer of the list's first block, y = blocks in the list, z = first of the
    // slice, w = the one behind its last
    BD_UVEC4 blocks;
    BD_UVEC4 vpls; // x = first VPL of the batch, y = VPLs in it, z = BD_SUBSPLAT_*
    // Radiance in the frame's light unit: a block is split where it varies by more than
    // x + y (largest of it + z irradiance of all VPLs).
    BD_VEC4 limits;
    BD_UVEC4 next; // x = blocks that the next list may hold, y = level of the scan
    BD_UVEC4 rows; // of spread: x = first row of the slice, y = rows in it
};

// What the host reads back. The first three add up over lists.
struct bd_subsplats_counts {
    BD_UVEC4 lists; // x = subsplats that were looked at, y = of those split, z = added to the image
    BD_UVEC4 next;  // x = blocks wanted in the next list, y = blocks that fit into it
};

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_subsplats_args) == 80, "std140 size");
_Static_assert(sizeof(struct bd_subsplats_counts) == 32, "std430 size");
#endif

#endif
