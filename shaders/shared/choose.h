// Arguments of pass/choose and of what gathers the VPLs that were chosen.
#ifndef BD_SHARED_CHOOSE_H
#define BD_SHARED_CHOOSE_H

#include "shared/types.h"

struct bd_choose_args {
    BD_UVEC4 tile; // of the slice: xy = its first pixel, zw = its width and height
    BD_UVEC4 fragments; // of a list instead: x = first of the slice, y = how many, z = finest
                        // level, whose blocks may hold several surfaces
    BD_UVEC4 vpls; // x = first VPL of the slice, y = VPLs in it (choose.comp: rays); all.comp: z =
                   // words a receiver; else z = VPLs of a group, w = groups of the whole list
    BD_UVEC4 rays; // x = VPLs that are chosen for a receiver, y = seed, z = VPLs of the whole list
};

// Of a VPL that was chosen: rgb of its light, seen or not, times how many it stands for; the same
// of the specular lobe, or of the irradiance vector.
#define BD_PICK_VEC4S 2

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_choose_args) == 64, "std140 size");
#endif

#endif
