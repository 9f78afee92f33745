// A multiresolution image: blocks of pixels at several levels (algorithms.md A1, A2.1).
//
// Block (x, y) of level k covers the pixels [x 2^k, (x+1) 2^k) x [y 2^k, (y+1) 2^k) of the picture
// as far as they lie in it: level k has ceil(width / 2^k) x ceil(height / 2^k) blocks, the last
// ones may be cut, and no row is ever dropped. Level 0 is a texture of the picture's size; the
// coarser levels share a second one, stacked from level 1 down, level k beginning at row
// `levels[k].first_row`. (The papers stack them beside the picture, where the widest picture of a
// device leaves no room.)
#ifndef BD_SHARED_MULTIRES_H
#define BD_SHARED_MULTIRES_H

#include "shared/types.h"

// Pictures up to 16384 px a side, in blocks up to 16384 px.
#define BD_MULTIRES_LEVEL_MAX 15

struct bd_multires_level {
    BD_UINT columns; // of blocks
    BD_UINT rows;
    BD_UINT first_row; // in the stack; level 0: 0
    BD_UINT number;    // which it is, where it is an argument by itself; in a layout unused
};

// As members of other structs: GLSL knows no `struct NAME`.
#ifdef BD_GLSL
#define BD_MULTIRES_LEVEL  bd_multires_level
#define BD_MULTIRES_LAYOUT bd_multires_layout
#else
#define BD_MULTIRES_LEVEL  struct bd_multires_level
#define BD_MULTIRES_LAYOUT struct bd_multires_layout
#endif

struct bd_multires_layout {
    BD_UINT width_px; // of the picture
    BD_UINT height_px;
    BD_UINT level_count;
    BD_UINT unused_0;

    BD_MULTIRES_LEVEL levels[BD_MULTIRES_LEVEL_MAX];
};

// A fragment is one block that is lit as a whole, packed in 32 bits.
#define BD_FRAGMENT_PACK(level, x, y) ((level) << 28 | (y) << 14 | (x))
#define BD_FRAGMENT_LEVEL(packed)     ((packed) >> 28)
#define BD_FRAGMENT_X(packed)         ((packed) & 16383u)
#define BD_FRAGMENT_Y(packed)         ((packed) >> 14 & 16383u)

// What a block is, in the texture of flags: its kind, and with it what who looks at pixels would ask
// for next.
#define BD_BLOCK_KIND(word)    ((word) & 3u)
#define BD_BLOCK_EMPTY         0u // nothing in it can be lit: background, unlit surfaces
#define BD_BLOCK_SMOOTH        1u
#define BD_BLOCK_DISCONTINUOUS 2u // holds a discontinuity; so do all its parents
#define BD_BLOCK_HAS_UNLIT     4u // it has pixels that cannot be lit
// A bit for each child, (x & 1) + 2 (y & 1), that is not empty.
#define BD_BLOCK_CHILDREN(word) ((word) >> 4 & 15u)
#define BD_BLOCK_WITH_CHILD(i)  (16u << (i))

// The pixel that stands for a block: of those that can be lit the nearest to its centre.
#define BD_PIXEL_PACK(x, y) ((y) << 16 | (x))
#define BD_PIXEL_X(packed)  ((packed) & 65535u)
#define BD_PIXEL_Y(packed)  ((packed) >> 16)

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_multires_layout) == 256, "std140 size");
#endif

#endif
