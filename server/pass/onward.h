// Rays that go on: through glass, in at one side and out at another, mirrored within and on its
// way, and from metals that are mirrors, until one meets what sends light out evenly, or nothing
// (lights/interface.h). In what follows, and with whoever asks, glass is either.
//
// At each wall one way is chosen by what it carries, so that a ray stays one ray; a wall of which
// only a part is glass is met as glass as often. What the ways cost is in its weight. Unbiased but
// for rays that are still within glass after BD_ONWARD_EVENTS_MAX walls, whose light is lost.
//
// Private to pass/. Thread: render thread, and the pool's.

#ifndef BD_PASS_ONWARD_H
#define BD_PASS_ONWARD_H

#include "lights/solids.h"
#include "pass/first_light.h"
#include "pass/visibility.h"

#define BD_ONWARD_EVENTS_MAX 24u

// A ray's way so far. At first weight 1 and the rest 0, unless it begins on glass.
struct bd_way {
    f3 weight;       // of what it brings
    f3 extinction;   // per render unit, of what it goes through
    struct bd_solids solids; // that it is within
    uint32_t events; // walls of glass that it met
    // Who looks for lights from where it begins has looked along it (pass/straight.h): so far it
    // met panes that those look through, or nothing.
    bool straight;
    // Of the surface that it ended at, the share that is neither glass nor mirror: as often rays
    // end there, so that each brings it so many times less than falls there. At least
    // BD_REST_LEAST, or a few photons would outshine what lies beside next to clear glass.
    float rest;
};
#define BD_REST_LEAST 0.125f
extern const struct bd_way bd_way_begins;

// Photons carry flux with a ray, others bring radiance back along it.
enum bd_carries { BD_CARRIES_RADIANCE, BD_CARRIES_FLUX };

// Called where ray `i` meets brushed metal (scene/model/scene.h), before that wall changes the ray,
// from any thread. NULL: nothing is told of such walls.
struct bd_onward_look {
    void (*look)(void *user, uint32_t i, const struct bd_interface *at, const struct bd_ray *ray,
                 const struct bd_ray_hit *hit, const struct bd_way *way);
    void *user;
};

// Of rays that are asked already: where one met glass it goes on, and `rays` and `hits` are those
// of its last leg, as are distances. A ray that is lost meets nothing, and has no weight.
// Directions are unit; `numbers` are the rays' own. `count` any; in slices of their own.
BD_MUST_CHECK
enum bd_err bd_onward_run(const struct bd_pass_context *context,
                          const struct bd_surface_hits *surfaces,
                          const struct bd_visibility_inputs *visibility, enum bd_carries carries,
                          uint64_t seed, const uint32_t *numbers, struct bd_ray *rays,
                          struct bd_ray_hit *hits, struct bd_way *ways, uint32_t count,
                          const struct bd_onward_look *look, struct bd_ray_counts *traced,
                          struct bd_err_detail *detail);

// The first wall, of a pixel that shows glass: the ray that passes, into `ray` and `way`. `number`
// as above. False: none does.
bool bd_onward_enter(const struct bd_surface_hits *surfaces, const struct bd_interface *at,
                     f3 to_viewer, uint64_t seed, uint32_t number, struct bd_ray *ray,
                     struct bd_way *way);

// What such a ray brings of lights that it meets itself, where nobody else has looked for those:
// of an emitter, or of the sky where it meets nothing. In the frame's unit, with its weight.
f3 bd_onward_emission(const struct bd_first_light *light, const struct bd_ray *ray,
                      const struct bd_ray_hit *hit, const struct bd_way *way);

#endif
