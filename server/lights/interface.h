// A surface from which light goes on, through it or as from a mirror, as a ray meets it, and how
// the ray does.
//
// Mirrors are metals, as rough as `hits` say (bd_material_may_mirror), by their share of metal:
// their facets reflect.
//
// glTF's glass: of the share of a surface that transmits, microfacets reflect by Fresnel's
// equations and let pass the rest, coloured by the base colour. Thin walls turn nothing, solids
// refract, and absorb on the way between their walls (Beer). Normals are interpolated; maps of
// normals are not read.
//
// KHR_materials_transmission, _volume, _ior; Walter, Marschner, Li, Torrance 2007; Heitz 2018.
//
// Thread: any.

#ifndef BD_LIGHTS_INTERFACE_H
#define BD_LIGHTS_INTERFACE_H

#include "lights/surface_hits.h"

struct bd_interface {
    f3 position;                 // render space
    f3 normal, normal_geometric; // unit, to the side that the ray comes from
    f3 tint;                     // of what passes
    f3 extinction;               // per render unit, of the solid behind the surface
    float share;                 // of the light that comes to the surface, what goes on
    float alpha;                 // of the facets; 0: smooth
    float ior;                   // of the solid behind the surface, by that of what is before it
    bool thin, entering; // no solid behind it; the ray is outside of that
    bool mirrors;        // nothing passes
    uint32_t triangle;
};

// What a ray from there, unit, meets at a triangle. False where nothing goes on: `out` is not
// filled.
bool bd_interface_at(const struct bd_surface_hits *hits, uint32_t triangle, float u, float v,
                     f3 direction, struct bd_interface *out);
// The same at a point of the triangle that a picture shows, whose viewer is in that direction.
bool bd_interface_seen_at(const struct bd_surface_hits *hits, uint32_t triangle, f3 position,
                          f3 to_viewer, struct bd_interface *out);

// Of the solid behind surfaces of that material, per render unit.
f3 bd_interface_extinction(const struct bd_surface_hits *hits, int32_t material);

struct bd_onward {
    f3 direction; // unit
    f3 weight;    // of flux that goes along the ray
    float spread; // radiance that comes back along it is so many times that
    bool passes;  // else it is reflected
};

enum bd_onward_choice { BD_ONWARD_EITHER, BD_ONWARD_PASSES };

// Of that share alone, which is the caller's. `number`: two in [0, 1) for a facet, one for the
// choice, by what each way carries. False: the ray ends, by total reflection where it had to pass,
// or under the surface.
bool bd_interface_go_on(const struct bd_interface *at, f3 direction, enum bd_onward_choice choice,
                        const float number[3], struct bd_onward *out);

// What is left of light on a way of that length through a solid (Beer).
f3 bd_interface_absorbed(f3 light, f3 extinction, float distance);

// Of which glass a straight way goes through.
enum bd_straight {
    BD_STRAIGHT_PANES, // smooth and thin, where it is what light does
    BD_STRAIGHT_ALL,   // any, as if it were: solids absorb, and turn nothing
};

bool bd_interface_is_pane(const struct bd_interface *at);

// What passes there straight on, of all that comes along a unit direction; 0 where nothing does.
// Solids absorb beside that (`extinction`).
f3 bd_interface_straight(const struct bd_interface *at, enum bd_straight straight, f3 direction);

#endif
