// Final gather: a few rays from every receiver that go as its diffuse lobe looks, and bring what
// virtual point lights leave out: light that was reflected more often, from a cache of irradiance;
// and of their own light what their kernel takes off near them.
//
// Wallace's kernel with area A gives pi r^2 / (pi r^2 + A) of a point's light at distance r. A ray
// that meets a surface there brings the rest of what falls on it, so that both together have all of
// it, whatever A: a large one makes light of few virtual lights smooth, and noise of it.
//
// The same of virtual lights that are clamped (algorithms.md A3), whose cos cos / r^2 is at most b:
// within 1 / sqrt(b) a ray brings what that takes off, of all light. Where a screen is seen to hold
// all that is so near, which gives that back, none is asked.
//
// What stands behind glass no virtual light sees: rays that go on through it (pass/onward.h) bring
// all of its light, and what it emits.
//
// Of each receiver half of the rays make one picture and half another, which share no random
// number. Unbiased but for the cache. Cost: a ray and a look into the cache, some .5 us of one
// core.
//
// Kollig and Keller 2004 (what a bounded kernel leaves out); Jensen 1996 (final gather).
//
// Thread: render thread, and the pool's.

#ifndef BD_PASS_FAR_H
#define BD_PASS_FAR_H

#include "lights/irradiance_cells.h"
#include "lights/irradiance_points.h"
#include "lights/photon_map.h"
#include "pass/first_light.h"
#include "pass/gather_fragments.h"

struct bd_screen;

#define BD_FAR_RAYS_MAX 1024u
// Of the scene's radius, over which what lies behind glass is spread where rays end.
#define BD_FAR_CAUSTICS_SPREAD 0.03f

enum bd_far_glass {
    BD_GLASS_HIDES,
    BD_GLASS_PASSES,    // rays go on through it, and bring what shines behind it
    BD_GLASS_SHOWS_SKY, // nothing but the sky
};

// Of receivers that are the places of cells: where their rays ended among those, and how much of
// what falls there each brings. What falls there is yet to be told.
struct bd_far_sight {
    uint32_t receiver, cell;
    f3 weight;
};
struct bd_far_sights {
    const struct bd_irradiance_cells *cells;
    uint32_t count, room;
    struct bd_far_sight *sights;
};

struct bd_far_inputs {
    const struct bd_scene *snapshot;
    const struct bd_visibility_inputs *visibility;
    // What is brought of every place that is met, whatever the distance; of clamped lights as far
    // as those leave it out; or NULL.
    const struct bd_irradiance_cells *cells;
    // What is brought beside first light where virtual lights leave something out, of points that
    // are the receivers; or NULL.
    const struct bd_irradiance_points *points;
    // Added to, instead of what points tell, where a ray ends in a cell; or NULL.
    struct bd_far_sights *sights;
    const struct bd_first_light *first;
    float area;    // A, render units squared; 0: nothing was left out near virtual lights
    float clamp;   // b, per render unit squared, instead of A; 0: none
    const struct bd_screen *screen; // of clamped lights: who needs no rays; or NULL
    uint32_t rays; // of a receiver: even, 2 to BD_FAR_RAYS_MAX
    uint64_t seed;
    enum bd_sends sends; // what surfaces do
    enum bd_far_glass glass;
    // Where lamps' light lies behind glass, as first light does: virtual lights have it, rays what
    // those leave out of it, and nothing of lamps themselves. NULL: rays bring all.
    const struct bd_photon_map *caustics;
    // Where that lies behind glass again, once it was sent on: rays that came through glass bring
    // nothing of `caustics`, then, but to mirrors and glass. Not of places where rays end: cells
    // have it. NULL: rays bring it.
    const struct bd_photon_map *caustics_again;
    // Of glass alone: virtual lights, in order, that light what it shows; or NULL.
    struct {
        const struct bd_vpl_list *list;
        uint32_t rays; // of a place
        const struct bd_visibility_inputs *visibility;
    } seen;
};

// Of pixels, in a pass "far". Adds to `irradiance`, `noise` and `rays` of `indirect`.
BD_MUST_CHECK
enum bd_err bd_far_run(const struct bd_pass_context *context, const struct bd_far_inputs *inputs,
                       const struct bd_gather_inputs *gather, struct bd_indirect *indirect,
                       struct bd_err_detail *detail);

// Of fragments, in a pass "far". Adds to `light`: to its noise, too, where it has any.
BD_MUST_CHECK
enum bd_err bd_far_of_fragments(const struct bd_pass_context *context,
                                const struct bd_far_inputs *inputs,
                                const struct bd_gather_fragments_inputs *gather,
                                struct bd_multires_light *light, struct bd_err_detail *detail);

// Of points, within whatever pass. Adds to what they got, which stands for what comes to places
// beside them that nobody else knows.
BD_MUST_CHECK
enum bd_err bd_far_of_points(const struct bd_pass_context *context,
                             const struct bd_far_inputs *inputs,
                             const struct bd_surface_point *points, uint32_t count, f3 *irradiance,
                             struct bd_ray_counts *traced, struct bd_err_detail *detail);

#endif
