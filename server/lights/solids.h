// Solids of glass that a ray is within, one in another or overlapping: a drink in a glass, a bubble
// in a paperweight. Of several at one place the smallest is there (bd_solid_size_m2), so that it
// does not matter which a ray met first, nor whether a drink ends at the glass or within it. Edges
// that lie within a smaller solid are none, nor are those between two of one material.
//
// A solid that a ray went into without leaving it, such as a sheet that bounds none, counts no
// further than its mesh's box.
//
// Schmidt and Budge 2002 (nested dielectrics, by priorities that are told).
//
// Thread: any.

#ifndef BD_LIGHTS_SOLIDS_H
#define BD_LIGHTS_SOLIDS_H

#include "lights/interface.h"

// At once; of more the first is forgotten.
#define BD_SOLIDS_MAX 4u

struct bd_solids {
    uint32_t count;
    uint32_t triangle[BD_SOLIDS_MAX]; // by which it went in
};

// What a ray within `solids` meets at an edge of another, or of one of them.
struct bd_solid_edge {
    bool is_none; // another solid is there on both sides
    float ior;    // of the solid that the edge is of, by that of what is beyond it
    f3 inside;    // extinction on either side
    f3 outside;
};

// Of a thin wall or a mirror, which are edges of none, neither index nor media say anything.
struct bd_solid_edge bd_solid_edge_at(const struct bd_surface_hits *hits,
                                      const struct bd_solids *solids,
                                      const struct bd_interface *at);
// The ray passes.
void bd_solids_cross(const struct bd_surface_hits *hits, struct bd_solids *solids,
                     const struct bd_interface *at);

#endif
