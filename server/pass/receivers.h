// Receivers that the processor's loops light (pass/native): the device writes them into a buffer,
// the processor sums, and the device stores their light from another. Points of surfaces, too,
// which the device has nothing to do with.
//
// Thread: render thread, and the pool's.

#ifndef BD_PASS_RECEIVERS_H
#define BD_PASS_RECEIVERS_H

#include "lights/surface_points.h"
#include "pass/choose.h"
#include "shared/receivers.h"

// Groups of receivers, of which the last may not be full: lanes behind its end are not lit. Their
// light is 0 at first.
struct bd_receiver_part {
    const struct bd_askers *askers; // NULL: points
    const struct bd_surface_point *points;
    struct bd_askers_slice slice;   // of either
    uint32_t count, group_count;
    struct bd_receivers *receivers;
    struct bd_ray_starts *starts;         // if asked for
    struct bd_glossy_receivers *surfaces; // of glossy ones
    struct bd_receiver_light *light;
    struct bd_lanes3 *glossy; // what lobes reflect, of glossy ones
};

struct bd_receivers_inputs {
    struct bd_askers askers;
    // Instead of the former; with `starts` and neither noise nor `bind`: `light` keeps their light.
    const struct bd_surface_point *points;
    uint32_t point_count;
    const char *pass;       // in the report; NULL: whoever calls has begun it
    bool spread;            // is summed too; wants `askers.vector`
    bool noise;             // of their light is kept too
    bool adds;              // to what the images hold
    bool surfaces;          // pixels have them
    bool glossy;            // the same, and what their lobes reflect is kept too,
    bool rough_apart;       // that of rough dielectrics by itself
    bool starts;            // where rays start is asked for,
    uint64_t seed;          // by which they choose
    uint32_t receivers_max; // of a part; 0 = as many as are convenient
    // Lights the groups of a part, in slices.
    enum bd_err (*light)(void *user, const struct bd_receiver_part *part);
    void *user;
    // Binds the images that shaders/pass/receivers/light.comp stores to. NULL: `light` keeps it.
    void (*bind)(const void *out, struct bd_bindings *bindings);
    const void *out;
};

// Of points: adds their light to what those of the list got.
void bd_receivers_keep(const struct bd_receiver_part *part, f3 *irradiance);

// All of them, a part after the other.
BD_MUST_CHECK
enum bd_err bd_receivers_run(const struct bd_pass_context *context,
                             const struct bd_receivers_inputs *inputs,
                             struct bd_err_detail *detail);

// Evaluations of VPLs, or nodes that are looked at, that a lane takes in one turn of the pool at
// most: a group's are milliseconds.
#define BD_TURN_EVALUATIONS 8192u

// Calls work(user, group) for all groups of a part, slice by slice on the processor's threads; a
// group takes so many units.
BD_MUST_CHECK
enum bd_err bd_receivers_each(const struct bd_pass_context *context, uint32_t group_count,
                              double units, void (*work)(void *user, uint32_t group), void *user);

#endif
