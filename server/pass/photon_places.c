#include "pass/photon_places.h"

#include <stdlib.h>

#include "pass/receivers.h"

// Places at once.
#define AT_ONCE 8192u
// Of the slicer, one for each evaluation of a VPL.
#define UNITS_PER_DISK 300.0
#define UNITS_PER_LOOK 300.0

struct telling {
    const struct bd_photon_places_inputs *inputs;
    uint32_t first, count; // of the places that are told now
    struct bd_photon_disk *disks;
    uint32_t *triangles;
    struct bd_disk_cuts cuts;
    f3 *irradiance;
};

static uint32_t groups_of(uint32_t count)
{
    return (count + BD_LANES - 1) / BD_LANES;
}

static void find_disks(void *user, uint32_t group)
{
    const struct telling *t = user;
    const struct bd_photon_places_inputs *in = t->inputs;
    for (uint32_t k = group * BD_LANES; k < (group + 1) * BD_LANES && k < t->count; k++) {
        const struct bd_surface_point *at = &in->places[t->first + k];
        t->triangles[k] = at->triangle;
        t->disks[k] = bd_photon_disk_of(in->map, at->position, at->normal, in->least);
    }
}

static void tell_group(void *user, uint32_t group)
{
    const struct telling *t = user;
    for (uint32_t k = group * BD_LANES; k < (group + 1) * BD_LANES && k < t->count; k++) {
        f3 *to = &t->irradiance[t->first + k];
        const f3 told =
            bd_photon_map_tell(t->inputs->map, &t->disks[k], bd_disk_cuts_of(&t->cuts, k), NULL);
        *to = f3_add(*to, told);
    }
}

static enum bd_err tell_some(const struct bd_pass_context *context, struct telling *t,
                             struct bd_err_detail *detail)
{
    bd_slicer_work(context->slicer, "photon disks of places");
    enum bd_err err =
        bd_receivers_each(context, groups_of(t->count), UNITS_PER_DISK * BD_LANES, find_disks, t);
    if (!err) err = bd_disk_cuts_find(context, &t->cuts, t->disks, t->triangles, t->count, detail);
    bd_slicer_work(context->slicer, "photons at places");
    return err ? err
               : bd_receivers_each(context, groups_of(t->count), UNITS_PER_LOOK * BD_LANES,
                                   tell_group, t);
}

enum bd_err bd_photon_places_add(const struct bd_pass_context *context,
                                 const struct bd_photon_places_inputs *inputs, f3 *irradiance,
                                 struct bd_ray_counts *traced, struct bd_err_detail *detail)
{
    const uint32_t room = inputs->count < AT_ONCE ? inputs->count : AT_ONCE;
    struct telling t = {.inputs = inputs,
                        .disks = malloc((room + 1) * sizeof *t.disks),
                        .triangles = malloc((room + 1) * sizeof *t.triangles),
                        .cuts = {.visibility = inputs->visibility, .surfaces = inputs->surfaces},
                        .irradiance = irradiance};
    enum bd_err err = BD_ERR_OK;
    if (!t.disks || !t.triangles)
        err = bd_err_set(detail, BD_ERR_NO_MEMORY, "photons", "no memory for disks of photons");
    for (; !err && t.first < inputs->count; t.first += t.count) {
        t.count = inputs->count - t.first < room ? inputs->count - t.first : room;
        err = tell_some(context, &t, detail);
    }
    bd_ray_counts_add(traced, t.cuts.traced);
    bd_disk_cuts_finish(&t.cuts);
    free(t.disks);
    free(t.triangles);
    return err;
}
