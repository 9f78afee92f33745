#include "pass/first_hits.h"

#include <math.h>
#include <stdlib.h>

#include "base/assert.h"
#include "kernel/pixel.h"

#define RAYS_PER_PIECE 1024u
#define RAYS_MAX       (1u << 17) // of a slice

struct bd_sample_ray bd_sample_ray_of(const struct bd_viewpoint *viewpoint,
                                      const struct bd_render_space *space, uint32_t x, uint32_t y)
{
    const float at_x = (float)x + (float)viewpoint->sample_x_px;
    const float at_y = (float)y + (float)viewpoint->sample_y_px;
    const double right =
        viewpoint->half_width * (double)ndc_to_right(at_x, (float)viewpoint->width_px);
    const double up = viewpoint->half_height * (double)ndc_up(at_y, (float)viewpoint->height_px);
    if (!viewpoint->orthographic) return (struct bd_sample_ray){{0, 0, 0}, {right, up, -1}};
    const double scale = space->render_per_m;
    return (struct bd_sample_ray){{right * scale, up * scale, 0}, {0, 0, -1}};
}

// A slice of the picture's samples, row by row.
struct hits_slice {
    const struct bd_viewpoint *viewpoint;
    const struct bd_render_space *space;
    bool passes_backs;
    bd_dvec3 position; // render space
    uint64_t first;    // pixel
    uint32_t count;
    struct bd_ray *rays;
    struct bd_ray_hit *hits;
};

static bd_dvec3 turned(const struct bd_viewpoint *v, const double at[3])
{
    return bd_dvec3_add(
        bd_dvec3_scale(v->axis_x, at[0]),
        bd_dvec3_add(bd_dvec3_scale(v->axis_y, at[1]), bd_dvec3_scale(v->axis_z, at[2])));
}

static struct bd_ray ray_through(const struct hits_slice *slice, uint64_t pixel)
{
    const struct bd_viewpoint *v = slice->viewpoint;
    const struct bd_sample_ray sample = bd_sample_ray_of(
        v, slice->space, (uint32_t)(pixel % v->width_px), (uint32_t)(pixel / v->width_px));
    const bd_dvec3 from = bd_dvec3_add(slice->position, turned(v, sample.origin));
    const bd_dvec3 to = turned(v, sample.direction);
    const double scale = slice->space->render_per_m;
    return (struct bd_ray){
        .origin = {(float)from.x, (float)from.y, (float)from.z},
        .from_triangle = BD_NO_TRIANGLE,
        .direction = {(float)to.x, (float)to.y, (float)to.z},
        .far = v->orthographic ? (float)(v->far_m * scale) : INFINITY,
        .near = (float)(v->near_m * scale),
        .passes_backs = slice->passes_backs,
    };
}

static void make_rays(void *user, uint32_t piece)
{
    struct hits_slice *slice = user;
    const uint32_t begin = piece * RAYS_PER_PIECE;
    for (uint32_t i = begin; i < slice->count && i < begin + RAYS_PER_PIECE; i++)
        slice->rays[i] = ray_through(slice, slice->first + i);
}

static void trace(const struct bd_tracer *tracer, struct hits_slice *slice, uint32_t *numbers)
{
    const uint32_t pieces = (slice->count + RAYS_PER_PIECE - 1) / RAYS_PER_PIECE;
    if (bd_pool_run(tracer->pool, pieces, make_rays, NULL, slice)) return; // nobody stops it
    bd_rays_nearest(tracer->rays, tracer->pool, BD_RAYS_ALPHA_MASK, slice->rays, slice->count,
                    slice->hits);
    for (uint32_t i = 0; i < slice->count; i++) numbers[slice->first + i] = slice->hits[i].triangle;
}

// How many rays one slice takes, in whole pieces.
static uint32_t rays_that_fit(const struct bd_slicer *slicer, uint64_t left)
{
    const double fit = fmin(bd_slicer_units(slicer), RAYS_MAX);
    const uint32_t whole = (uint32_t)(fit / RAYS_PER_PIECE) * RAYS_PER_PIECE;
    const uint32_t count = whole > RAYS_PER_PIECE ? whole : RAYS_PER_PIECE;
    return left < count ? (uint32_t)left : count;
}

enum bd_err bd_first_hits(const struct bd_tracer *tracer, const struct bd_viewpoint *viewpoint,
                          const struct bd_render_space *space, bool passes_backs,
                          struct bd_slicer *slicer, uint32_t *numbers)
{
    const uint64_t pixels = (uint64_t)viewpoint->width_px * viewpoint->height_px;
    struct hits_slice slice = {.viewpoint = viewpoint,
                               .space = space,
                               .passes_backs = passes_backs,
                               .position = bd_render_from_world(space, viewpoint->position_m),
                               .rays = calloc(RAYS_MAX, sizeof *slice.rays),
                               .hits = calloc(RAYS_MAX, sizeof *slice.hits)};
    BD_ASSERT(slice.rays && slice.hits);
    enum bd_err err = BD_ERR_OK;
    bd_slicer_work(slicer, "first hits");
    for (; !err && slice.first < pixels; slice.first += slice.count) {
        slice.count = rays_that_fit(slicer, pixels - slice.first);
        trace(tracer, &slice, numbers);
        err = bd_slicer_checkpoint(slicer, slice.count);
    }
    free(slice.rays);
    free(slice.hits);
    return err;
}
