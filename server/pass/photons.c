#include "pass/photons.h"

#include <stdlib.h>

#include "base/assert.h"
#include "pass/caustic_photons.h"
#include "pass/photon_paths.h"

static enum bd_err send_all(const struct bd_pass_context *context,
                            const struct bd_photons_inputs *in, struct bd_photons *out,
                            struct bd_err_detail *detail)
{
    const struct bd_render_space *space = &in->scene->space;
    struct bd_visibility_inputs visibility = in->visibility;
    visibility.images = in->images;
    const struct bd_photon_paths_inputs paths = {
        .snapshot = in->snapshot,
        .visibility = &visibility,
        .punctuals = in->punctuals,
        .punctual_count = in->punctual_count,
        .lights = in->lights,
        .from_cd_m2 = (float)(1 / space->unit_cd_m2),
        .count = in->count,
        .reflections = in->reflections,
        .lambert = in->lambert,
        .glass = in->glass,
        .caustics_apart = in->caustics,
        .radius = (float)(in->radius_m * space->render_per_m),
        .seed = in->seed,
    };
    struct bd_photon_account account;
    const enum bd_err err =
        bd_photon_paths_run(context, &paths, &out->global, &out->cells, &account, detail);
    out->flux_sent = account.sent;
    out->flux_lost = account.left + account.lost;
    return err;
}

static enum bd_err send_through_glass(const struct bd_pass_context *context,
                                      const struct bd_photons_inputs *in, struct bd_photons *out,
                                      struct bd_err_detail *detail)
{
    struct bd_visibility_inputs visibility = in->visibility;
    visibility.images = in->images;
    const struct bd_caustic_photons_inputs caustics = {
        .snapshot = in->snapshot,
        .visibility = &visibility,
        .punctuals = in->punctuals,
        .punctual_count = in->punctual_count,
        .emitters = in->lights && in->lights->count > 0 ? in->lights : NULL,
        .from_cd_m2 = (float)(1 / in->scene->space.unit_cd_m2),
        .count = in->count,
        .seed = in->seed,
    };
    return bd_caustic_photons_run(context, &caustics, &out->caustics, NULL, detail);
}

enum bd_err bd_photons_run(const struct bd_pass_context *context,
                           const struct bd_photons_inputs *inputs, struct bd_photons **out,
                           struct bd_err_detail *detail)
{
    // Threads of the pool, whatever the device.
    const struct bd_processor processor = {inputs->visibility.pool, NULL};
    struct bd_pass_context own = *context;
    own.processor = &processor;
    *out = calloc(1, sizeof **out);
    BD_ASSERT(*out);
    enum bd_err err = send_all(&own, inputs, *out, detail);
    if (!err && inputs->caustics) err = send_through_glass(&own, inputs, *out, detail);
    if (err) bd_photons_destroy(context->gpu, out);
    return err;
}

void bd_photons_destroy(struct bd_gpu *gpu, struct bd_photons **photons)
{
    (void)gpu;
    if (!*photons) return;
    bd_photon_map_destroy(&(*photons)->global);
    bd_photon_map_destroy(&(*photons)->caustics);
    bd_irradiance_cells_destroy(&(*photons)->cells);
    free(*photons);
    *photons = NULL;
}

uint64_t bd_photons_bytes(const struct bd_photons *photons)
{
    uint64_t bytes = sizeof *photons + bd_photon_map_bytes(photons->global);
    if (photons->cells) bytes += bd_irradiance_cells_bytes(photons->cells);
    if (photons->caustics) bytes += bd_photon_map_bytes(photons->caustics);
    return bytes;
}
