// What microfacets do with light, as whoever follows it finds it. Private to lights/.
//
// Heitz 2014, 2018; Walter, Marschner, Li, Torrance 2007.
//
// Thread: any.

#ifndef BD_LIGHTS_FACETS_H
#define BD_LIGHTS_FACETS_H

#include "kernel/brdf.h"

// At a facet of that normal; the viewer's direction points away.
static inline f3 bd_mirrored(f3 viewer, f3 h)
{
    return f3_unit(f3_sub(f3_scale(h, 2 * f3_dot(viewer, h)), viewer));
}

// Of light that facets reflect, chosen as the viewer sees them, what other facets leave: Smith's
// terms of both directions together, correlated, by that of the viewer's. Cosines to the normal.
static inline float bd_facets_leave(float to_viewer, float to_light, float alpha)
{
    const float o = f_max(to_viewer, 1e-4f), i = f_max(to_light, 0);
    const float root_o = smith_root(o, alpha), root_i = smith_root(i, alpha);
    return i * (o + root_o) / f_max(i * root_o + o * root_i, 1e-12f);
}

#endif
