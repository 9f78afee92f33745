#include "pass/first_hits.h"

#include <math.h>
#include <stdlib.h>

#include "base/assert.h"
#include "kernel/pixel.h"

// Rays of a tile go through the same part of the structure, which is read once for all of them. A
// tile is one piece of work.
#define TILE_SIDE 32u
#define TILE_RAYS (TILE_SIDE * TILE_SIDE)
#define TILES_MAX 128u // of a slice
// What rays cost shows when they are traced: thousands of surfaces may lie in one place. So a slice
// may hold so many times what the last one did, from one tile on, or as many as would have lasted a
// slice at that one's pace.
#define SLICE_GROWTH 4.0

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

// A slice of the picture's tiles, row by row; those at its right and lower border reach beyond it.
struct hits_slice {
    const struct bd_viewpoint *viewpoint;
    const struct bd_render_space *space;
    bool passes_backs;
    bd_dvec3 position; // render space
    uint32_t tiles_along;
    uint64_t first; // tile
    uint32_t count;
    struct bd_ray *rays;
    struct bd_ray_hit *hits;
    uint32_t *numbers;
};

static bd_dvec3 turned(const struct bd_viewpoint *v, const double at[3])
{
    return bd_dvec3_add(
        bd_dvec3_scale(v->axis_x, at[0]),
        bd_dvec3_add(bd_dvec3_scale(v->axis_y, at[1]), bd_dvec3_scale(v->axis_z, at[2])));
}

// What is said of the surface is that of the place itself.
static struct bd_sample_ray beside_edges(const struct bd_viewpoint *v,
                                         const struct bd_render_space *space, uint32_t x,
                                         uint32_t y)
{
    struct bd_sample_ray sample = bd_sample_ray_of(v, space, x, y);
    const double scale = v->orthographic ? space->render_per_m : 1;
    double *at = v->orthographic ? sample.origin : sample.direction;
    at[0] += 2 * BD_TIE_RIGHT * v->half_width * scale;
    at[1] += 2 * BD_TIE_UP * v->half_height * scale;
    return sample;
}

static struct bd_ray ray_through(const struct hits_slice *slice, uint32_t x, uint32_t y)
{
    const struct bd_viewpoint *v = slice->viewpoint;
    const struct bd_sample_ray sample = beside_edges(v, slice->space, x, y);
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

// Of one of the slice's tiles: where it begins, and how much of it is in the picture.
static struct bd_tile tile_at(const struct hits_slice *slice, uint32_t i)
{
    const uint64_t tile = slice->first + i;
    const uint32_t x = (uint32_t)(tile % slice->tiles_along) * TILE_SIDE;
    const uint32_t y = (uint32_t)(tile / slice->tiles_along) * TILE_SIDE;
    const uint32_t right = slice->viewpoint->width_px - x, below = slice->viewpoint->height_px - y;
    return (struct bd_tile){x, y, right < TILE_SIDE ? right : TILE_SIDE,
                            below < TILE_SIDE ? below : TILE_SIDE};
}

// Beyond the picture rays have no direction, and meet nothing.
static void make_rays(void *user, uint32_t piece)
{
    struct hits_slice *slice = user;
    struct bd_ray *rays = slice->rays + (size_t)piece * TILE_RAYS;
    const struct bd_tile tile = tile_at(slice, piece);
    for (uint32_t i = 0; i < TILE_RAYS; i++) {
        const uint32_t x = i % TILE_SIDE, y = i / TILE_SIDE;
        rays[i] = x < tile.width && y < tile.height ? ray_through(slice, tile.x + x, tile.y + y)
                                                    : (struct bd_ray){0};
    }
}

static void take_hits(const struct hits_slice *slice)
{
    for (uint32_t t = 0; t < slice->count; t++) {
        const struct bd_tile tile = tile_at(slice, t);
        const struct bd_ray_hit *hits = slice->hits + (size_t)t * TILE_RAYS;
        for (uint32_t y = 0; y < tile.height; y++) {
            uint32_t *to =
                slice->numbers + (size_t)(tile.y + y) * slice->viewpoint->width_px + tile.x;
            for (uint32_t x = 0; x < tile.width; x++) to[x] = hits[y * TILE_SIDE + x].triangle;
        }
    }
}

static void trace(const struct bd_tracer *tracer, struct hits_slice *slice)
{
    if (bd_pool_run(tracer->pool, slice->count, make_rays, NULL, slice)) return; // nobody stops it
    bd_rays_nearest_seen(tracer->rays, tracer->pool, slice->viewpoint->sub_frame, slice->rays,
                         (size_t)slice->count * TILE_RAYS, slice->hits);
    take_hits(slice);
}

static uint32_t tiles_that_fit(const struct bd_slicer *slicer, double tiles_max, uint64_t left)
{
    const double fit = fmin(bd_slicer_units(slicer) / TILE_RAYS, fmin(tiles_max, TILES_MAX));
    const uint32_t count = fit > 1 ? (uint32_t)fit : 1;
    return left < count ? (uint32_t)left : count;
}

enum bd_err bd_first_hits(const struct bd_tracer *tracer, const struct bd_viewpoint *viewpoint,
                          const struct bd_render_space *space, bool passes_backs,
                          struct bd_slicer *slicer, uint32_t *numbers)
{
    const uint32_t tiles_along = (viewpoint->width_px + TILE_SIDE - 1) / TILE_SIDE;
    const uint64_t tiles =
        (uint64_t)tiles_along * ((viewpoint->height_px + TILE_SIDE - 1) / TILE_SIDE);
    struct hits_slice slice = {.viewpoint = viewpoint,
                               .space = space,
                               .passes_backs = passes_backs,
                               .position = bd_render_from_world(space, viewpoint->position_m),
                               .tiles_along = tiles_along,
                               .rays = calloc((size_t)TILES_MAX * TILE_RAYS, sizeof *slice.rays),
                               .hits = calloc((size_t)TILES_MAX * TILE_RAYS, sizeof *slice.hits),
                               .numbers = numbers};
    BD_ASSERT(slice.rays && slice.hits);
    enum bd_err err = BD_ERR_OK;
    double tiles_max = 1;
    bd_slicer_work(slicer, "first hits");
    for (; !err && slice.first < tiles; slice.first += slice.count) {
        slice.count = tiles_that_fit(slicer, tiles_max, tiles - slice.first);
        trace(tracer, &slice);
        err = bd_slicer_checkpoint(slicer, (double)slice.count * TILE_RAYS);
        tiles_max = slice.count * fmin(1 / fmax(slicer->last_share, 1e-3), SLICE_GROWTH);
    }
    free(slice.rays);
    free(slice.hits);
    return err;
}
