// Arguments of pass/fragments.
//
// What is to be listed is a bit mask, 32 bits a word, and two words are one number of the prefix
// sum.
//
// Blocks are handled in tiles of 8 x 8, numbered through all levels from the coarsest, in a level
// by rows. Half a tile, four rows of it, is one word of a bit mask: bit 8 (y % 4) + x % 8. So the
// order of the list is that of the masks' bits, and a fragment's place is the number of bits before
// its own. Parts of fragments (refine.comp) have a word for each fragment that may be split, in the
// order of their list, with a bit for each child.
#ifndef BD_SHARED_FRAGMENTS_H
#define BD_SHARED_FRAGMENTS_H

#include "shared/multires.h"

#define BD_FRAGMENT_TILE_SIDE  8u
#define BD_FRAGMENT_SCAN_RUN   64u    // numbers that one invocation adds up
#define BD_FRAGMENT_GROUP      64u    // work-group size of who works through the list
#define BD_FRAGMENT_GROUPS_MAX 65535u // in one direction

// Of a level.
struct bd_fragment_tiles {
    BD_UINT first;      // tile
    BD_UINT columns;    // tiles in a row
    BD_UINT first_word; // of the mask
    BD_UINT unused_0;
};

#ifdef BD_GLSL
#define BD_FRAGMENT_TILES bd_fragment_tiles
#else
#define BD_FRAGMENT_TILES struct bd_fragment_tiles
#endif

struct bd_fragments_args {
    BD_MULTIRES_LAYOUT multires;

    BD_UINT first_item; // of the slice: words, or runs of the scan
    BD_UINT end_item;   // the one behind its last
    BD_UINT scan_level; // of the prefix sum
    BD_UINT face;       // of the light's map

    BD_FRAGMENT_TILES tiles[BD_MULTIRES_LEVEL_MAX];

    BD_UINT number_count; // of the prefix sum
    BD_UINT finest_level; // whose blocks are not split
    BD_UINT unused_0;
    BD_UINT unused_1;

    BD_FLOAT spread_threshold; // spread of light that is too much, as a part of it
    BD_FLOAT unused_2;
    BD_FLOAT unused_3;
    BD_FLOAT unused_4;
};

// What the host reads back.
struct bd_fragments_summary {
    BD_UINT fragment_count; // of all levels
    BD_UINT unused_0;
    BD_UINT unused_1;
    BD_UINT unused_2;

    BD_UINT first[BD_MULTIRES_LEVEL_MAX]; // place of the level's first fragment
    BD_UINT unused_3;
};

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_fragments_args) == 544, "std140 size");
_Static_assert(sizeof(struct bd_fragments_summary) == 80, "std430 size");
#endif

#endif
