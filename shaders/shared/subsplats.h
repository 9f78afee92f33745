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
    BD_UINT list_first_block; // place in the buffer of the list's first block
    BD_UINT list_block_count; // in the list
    BD_UINT first_block;      // of the slice, in the list
    BD_UINT end_block;        // the one behind its last

    BD_UINT first_vpl; // of the batch
    BD_UINT vpl_count; // in it
    BD_UINT members;   // BD_SUBSPLAT_*: in whose lists the blocks are
    BD_UINT unused_0;

    // Radiance in the frame's light unit: a block is split where it varies by more than
    // threshold_absolute + threshold_relative (largest of it + of_mean_vpl irradiance of all VPLs).
    BD_FLOAT threshold_absolute;
    BD_FLOAT threshold_relative;
    BD_FLOAT of_mean_vpl; // radiance of a mean VPL, as a part of the irradiance of all
    BD_FLOAT unused_1;

    BD_UINT next_block_count_max; // blocks that the next list may hold
    BD_UINT scan_level;           // of the prefix sum
    BD_UINT unused_2;
    BD_UINT unused_3;

    BD_UINT first_row; // of the slice (spread)
    BD_UINT row_count; // in it
    BD_UINT unused_4;
    BD_UINT unused_5;
};

// What the host reads back. The first three add up over lists.
struct bd_subsplats_counts {
    BD_UINT tested; // subsplats that were looked at
    BD_UINT split;  // of those, into their children
    BD_UINT drawn;  // added to the image
    BD_UINT unused_0;

    BD_UINT next_wanted;  // blocks wanted in the next list
    BD_UINT next_fitting; // of those, blocks that fit into it
    BD_UINT unused_1;
    BD_UINT unused_2;
};

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_subsplats_args) == 80, "std140 size");
_Static_assert(sizeof(struct bd_subsplats_counts) == 32, "std430 size");
#endif

#endif
