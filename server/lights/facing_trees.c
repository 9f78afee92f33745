#include "lights/facing_trees.h"

#include <stdlib.h>

#include "kernel/light.h"

#define CELLS 4 // along a side of a face

static uint32_t facing_of(f3 normal)
{
    const uint32_t face = face_towards(normal);
    const f3 seen = seen_from_face(normal, face);
    const float ahead = f_max(seen.z, 1e-6f);
    const float x = f_min(f_max(0.5f * CELLS * (seen.x / ahead + 1), 0), CELLS - 0.5f);
    const float y = f_min(f_max(0.5f * CELLS * (seen.y / ahead + 1), 0), CELLS - 0.5f);
    return (face * CELLS + (uint32_t)y) * CELLS + (uint32_t)x;
}

// The cone that holds the normals of its points, of which it has some.
static void measure(struct bd_facing *facing, const struct bd_surface_points *own)
{
    f3 sum = f3_of(0, 0, 0);
    for (uint32_t i = 0; i < own->count; i++) sum = f3_add(sum, own->points[i].normal);
    facing->axis = f3_unit(sum);
    facing->cosine = 1;
    for (uint32_t i = 0; i < own->count; i++)
        facing->cosine = f_min(facing->cosine, f3_dot(facing->axis, own->points[i].normal));
    facing->sine = f_sqrt(f_max(1 - facing->cosine * facing->cosine, 0));
}

static enum bd_err no_memory(struct bd_err_detail *detail, uint32_t count)
{
    return bd_err_set(detail, BD_ERR_NO_MEMORY, "photons", "no memory for %u points", count);
}

// `own`: room for its points.
static enum bd_err plant(struct bd_facing *facing, const struct bd_surface_points *points,
                         struct bd_surface_points *own, enum bd_err (*pause)(void *user),
                         void *user, struct bd_err_detail *detail)
{
    for (uint32_t i = 0; i < own->count; i++) own->points[i] = points->points[facing->numbers[i]];
    measure(facing, own);
    return bd_point_tree_init(&facing->tree, own, pause, user, detail);
}

static enum bd_err sort(struct bd_facing_trees *trees, const struct bd_surface_points *points,
                        uint32_t counts[BD_FACINGS], struct bd_err_detail *detail)
{
    for (uint32_t i = 0; i < points->count; i++) counts[facing_of(points->points[i].normal)]++;
    for (uint32_t f = 0; f < BD_FACINGS; f++) {
        if (counts[f] == 0) continue;
        trees->facings[f].numbers = malloc(counts[f] * sizeof *trees->facings[f].numbers);
        if (!trees->facings[f].numbers) return no_memory(detail, points->count);
        counts[f] = 0;
    }
    for (uint32_t i = 0; i < points->count; i++) {
        const uint32_t f = facing_of(points->points[i].normal);
        trees->facings[f].numbers[counts[f]++] = i;
    }
    return BD_ERR_OK;
}

enum bd_err bd_facing_trees_init(struct bd_facing_trees *trees,
                                 const struct bd_surface_points *points,
                                 enum bd_err (*pause)(void *user), void *user,
                                 struct bd_err_detail *detail)
{
    uint32_t counts[BD_FACINGS] = {0};
    struct bd_surface_points own = {.area = points->area,
                                    .points = malloc((points->count + 1) * sizeof *own.points)};
    *trees = (struct bd_facing_trees){.count = points->count, .area = points->area};
    enum bd_err err =
        own.points ? sort(trees, points, counts, detail) : no_memory(detail, points->count);
    for (uint32_t f = 0; !err && f < BD_FACINGS; f++) {
        own.count = counts[f];
        if (own.count > 0) err = plant(&trees->facings[f], points, &own, pause, user, detail);
    }
    free(own.points);
    if (err) bd_facing_trees_finish(trees);
    return err;
}

void bd_facing_trees_finish(struct bd_facing_trees *trees)
{
    for (uint32_t f = 0; f < BD_FACINGS; f++) {
        bd_point_tree_finish(&trees->facings[f].tree);
        free(trees->facings[f].numbers);
    }
    *trees = (struct bd_facing_trees){0};
}

uint64_t bd_facing_trees_bytes(const struct bd_facing_trees *trees)
{
    return sizeof *trees + trees->count * (sizeof(struct bd_point_node) + sizeof(uint32_t));
}

// --- a place ------------------------------------------------------------------------------------

// A little to the safe side, for rounding.
#define ROUNDING 1e-5f

// By the cosine of both angles together.
bool bd_facing_has_alike(const struct bd_facing *facing, f3 normal, float cosine)
{
    const float sine = f_sqrt(f_max(1 - cosine * cosine, 0));
    return f3_dot(facing->axis, normal) >= cosine * facing->cosine - sine * facing->sine - ROUNDING;
}

// By that of the axis and the farthest of its points; of more than a half turn nothing is said.
bool bd_facing_is_alike(const struct bd_facing *facing, f3 normal, float cosine)
{
    const float axis = f3_dot(facing->axis, normal);
    const float sine = f_sqrt(f_max(1 - axis * axis, 0));
    return facing->cosine > 0 && axis > 0 &&
           axis * facing->cosine - sine * facing->sine >= cosine + ROUNDING;
}
