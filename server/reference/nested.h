// Solids that a way is within. Where several are at one place the smallest is
// (bd_solid_size_m2, scene/model/scene.h); edges of others there are none, nor are those between
// two of one material. A solid that was entered and never left counts no further than its box.
//
// Schmidt and Budge 2002 (nested dielectrics). For the files of the path only.

#ifndef BD_REFERENCE_NESTED_H
#define BD_REFERENCE_NESTED_H

#include "reference/geometry.h"

struct bd_medium;
struct bd_reference;

#define BD_NESTED_MAX 4u // of more the first is forgotten

struct bd_nested {
    uint32_t count;
    const struct bd_part *in[BD_NESTED_MAX];
};

struct bd_nested_edge {
    bool is_none;                             // another is there on both sides
    float ior;                                // of the solid, by that of what is beyond
    const struct bd_medium *inside, *outside; // NULL: takes nothing
};

// The edge of a solid (bd_material_is_solid) as a way that is within `stack` meets it.
struct bd_nested_edge bd_nested_edge_at(const struct bd_reference *reference,
                                        const struct bd_nested *stack,
                                        const struct bd_intersection *at, bool entering);
// What is at a place, of those that the stack holds.
const struct bd_medium *bd_nested_medium_at(const struct bd_reference *reference,
                                            const struct bd_nested *stack, const float position[3]);
// The way passes an edge.
void bd_nested_cross(struct bd_nested *stack, const struct bd_part *part, bool entering);

#endif
