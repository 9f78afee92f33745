#include "pass/landed.h"

// Points for each photon that a disk holds more than the least, and at least: a disk of few has
// none of its own, and is whole.
#define POINTS_LEAST 65536u

enum bd_err bd_landed_map(const struct bd_pass_context *context, const struct bd_scene *snapshot,
                          const struct bd_photon *photons, uint32_t count,
                          const struct bd_photon_map_how *how, struct bd_photon_map **out,
                          struct bd_err_detail *detail)
{
    const uint32_t wanted =
        how->near > BD_PHOTONS_NEAR && count > POINTS_LEAST ? count : POINTS_LEAST;
    struct bd_surface_points points = {0};
    struct bd_photon_map_how whole = *how;
    whole.surfaces = &points;
    bd_slicer_work(context->slicer, "surface points");
    enum bd_err err = bd_surface_points_init(
        &points, snapshot, wanted < BD_SURFACE_POINTS_MAX ? wanted : BD_SURFACE_POINTS_MAX,
        BD_SENDS_LAMBERT, bd_slicer_pause, context->slicer, detail);
    bd_slicer_work(context->slicer, "photon map");
    if (!err)
        err = bd_photon_map_create(photons, count, &whole, bd_slicer_pause, context->slicer, out,
                                   detail);
    bd_surface_points_finish(&points);
    return err;
}
