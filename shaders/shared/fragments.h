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

struct bd_fragments_args {
    BD_MULTIRES_LAYOUT multires;
    BD_UVEC4 range; // x = first word, or first run of the scan; y = the one behind the last;
                    // z = level of the scan; w = face of the light's map
    BD_UVEC4 tiles[BD_MULTIRES_LEVEL_MAX]; // of a level: x = the first, y = tiles in a row; z =
                                           // first word of the mask
    BD_UVEC4 total; // x = numbers of the prefix sum, y = level whose blocks are not split
    BD_VEC4 limits; // x = spread of light that is too much, as a part of it
};

// What the host reads back.
struct bd_fragments_summary {
    BD_UVEC4 count;                        // x
    BD_UVEC4 first[BD_MULTIRES_LEVEL_MAX]; // x = place of the level's first fragment
};

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_fragments_args) == 544, "std140 size");
_Static_assert(sizeof(struct bd_fragments_summary) == 256, "std430 size");
#endif

#endif
