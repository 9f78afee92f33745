// Arguments of pass/choose and of what gathers the VPLs that were chosen.
#ifndef BD_SHARED_CHOOSE_H
#define BD_SHARED_CHOOSE_H

#include "shared/types.h"

struct bd_choose_args {
    // The slice: a tile of the picture's pixels; or fragments, in rows as wide as the tile.
    BD_UINT tile_x;
    BD_UINT tile_y;
    BD_UINT tile_width;
    BD_UINT tile_height;

    BD_UINT first_fragment;     // of the slice, in the list
    BD_UINT fragment_count;     // in it
    BD_UINT finest_level;       // whose blocks may hold several surfaces
    BD_UINT words_per_receiver; // of answers, 32 VPLs each (all)

    // What the dispatch works through: VPLs (all, weigh), or rays of each receiver (choose, pick).
    BD_UINT first_item;
    BD_UINT item_count;
    BD_UINT vpls_per_group; // of the list's groups
    // Of a receiver: up to each group of the list, or up to each light; behind them is the spread.
    BD_UINT running_sum_count;

    BD_UINT rays_per_receiver; // for each of which a VPL is chosen
    BD_UINT seed;              // of the frame
    BD_UINT list_vpl_count;    // of the whole list
    BD_UINT light_index;       // whose tree is walked (choose_tree)

    // Of the list, or of that light's leaves: which map a VPL has (pass/imperfect_shadows.h).
    BD_UINT first_map;
    BD_UINT vpls_per_map; // 0: there are none
    BD_UINT unused_0;
    BD_UINT unused_1;
};

// Of a VPL that was chosen: rgb of its light, seen or not, times how many it stands for; the same
// of the specular lobe, or of the irradiance vector.
#define BD_PICK_VEC4S 2

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_choose_args) == 80, "std140 size");
#endif

#endif
