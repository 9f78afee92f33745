#include "pass/photon_cells.h"

#include <stdlib.h>

#include "pass/photon_places.h"

#define CELLS_MOST 8192u
// Photons that divide them, for each of so many cells.
#define PHOTONS_PER_CELL 4u
// That are divided at all.
#define CELLS_LEAST 64u

static enum bd_err no_memory(struct bd_err_detail *detail)
{
    return bd_err_set(detail, BD_ERR_NO_MEMORY, "photons", "no memory for cells of photons");
}

// One photon of `every`, whatever lamp it comes from.
static enum bd_err divide(const struct bd_photon_cells_inputs *in, uint32_t every, uint32_t count,
                          struct bd_irradiance_cells **out, struct bd_err_detail *detail)
{
    const float radius = (float)in->surfaces->space.radius;
    const uint32_t most = count / PHOTONS_PER_CELL + CELLS_LEAST;
    uint64_t *numbers = malloc((count + 1) * sizeof *numbers);
    if (!numbers) return no_memory(detail);
    for (uint32_t i = 0; i < count; i++) {
        const struct bd_photon *photon = &in->photons[(size_t)i * every];
        numbers[i] = bd_irradiance_cell_at(photon->position, photon->normal, radius);
    }
    const enum bd_err err = bd_irradiance_cells_create(
        numbers, count, most < CELLS_MOST ? most : CELLS_MOST, radius, out, detail);
    free(numbers);
    return err;
}

static enum bd_err tell(const struct bd_pass_context *context,
                        const struct bd_photon_cells_inputs *in, uint32_t every,
                        struct bd_irradiance_cells *cells, struct bd_err_detail *detail)
{
    struct bd_surface_point *places = calloc(cells->count + 1, sizeof *places);
    struct bd_ray_counts traced = {0}; // of light, which nobody counts
    if (!places) return no_memory(detail);
    for (uint32_t i = 0; i < cells->count; i++) {
        const struct bd_photon *photon = &in->photons[(size_t)cells->chosen[i] * every];
        cells->places[i] = (struct bd_cell_place){photon->position, photon->normal};
        places[i].position = photon->position;
        places[i].normal = photon->normal;
        places[i].triangle = BD_NO_TRIANGLE;
    }
    const struct bd_photon_places_inputs at = {.map = in->map,
                                               .visibility = in->visibility,
                                               .surfaces = in->surfaces,
                                               .places = places,
                                               .count = cells->count};
    const enum bd_err err = bd_photon_places_add(context, &at, cells->irradiance, &traced, detail);
    free(places);
    return err;
}

enum bd_err bd_photon_cells_run(const struct bd_pass_context *context,
                                const struct bd_photon_cells_inputs *inputs,
                                struct bd_irradiance_cells **out, struct bd_err_detail *detail)
{
    const uint32_t every = inputs->count / (PHOTONS_PER_CELL * CELLS_MOST) + 1;
    const uint32_t count = (inputs->count + every - 1) / every;
    *out = NULL;
    enum bd_err err = divide(inputs, every, count, out, detail);
    if (!err) err = bd_slicer_pause(context->slicer);
    if (!err) err = tell(context, inputs, every, *out, detail);
    if (err) bd_irradiance_cells_destroy(out);
    return err;
}
