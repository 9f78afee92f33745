#include "pass/landed.h"

// Points, where disks hold the nearest photons alone: such are small, and mostly whole.
#define POINTS_LEAST 65536u
// Else for each photon, and at least: most surfaces may be dark, and photons dense on the others.
#define POINTS_PER_PHOTON 4u
#define POINTS_OF_WIDE    262144u

static uint32_t wide_of(uint32_t count)
{
    const uint32_t most = BD_SURFACE_POINTS_MAX / POINTS_PER_PHOTON;
    const uint32_t wanted = POINTS_PER_PHOTON * (count < most ? count : most);
    return wanted > POINTS_OF_WIDE ? wanted : POINTS_OF_WIDE;
}

enum bd_err bd_landed_map(const struct bd_pass_context *context, const struct bd_scene *snapshot,
                          bool by_coverage, const struct bd_photon *photons, uint32_t count,
                          const struct bd_photon_map_how *how, struct bd_photon_map **out,
                          struct bd_err_detail *detail)
{
    const uint32_t wanted = how->near > BD_PHOTONS_NEAR ? wide_of(count) : POINTS_LEAST;
    struct bd_surface_points surfaces = {0};
    struct bd_photon_map_how whole = *how;
    whole.surfaces = &surfaces;
    bd_slicer_work(context->slicer, "surface points");
    const struct bd_surface_points_how evenly = {
        .count = wanted < BD_SURFACE_POINTS_MAX ? wanted : BD_SURFACE_POINTS_MAX,
        .sends = BD_SENDS_LAMBERT,
        .by_coverage = by_coverage,
    };
    enum bd_err err = bd_surface_points_init(&surfaces, snapshot, &evenly, bd_slicer_pause,
                                             context->slicer, detail);
    bd_slicer_work(context->slicer, "photon map");
    if (!err)
        err = bd_photon_map_create(photons, count, &whole, bd_slicer_pause, context->slicer, out,
                                   detail);
    bd_surface_points_finish(&surfaces);
    return err;
}
