#include "pass/project_points.h"

#include <string.h>

#include "base/assert.h"
#include "kernel/point_draws.h"
#include "kernel/projected_point.h"
#include "lights/directions.h"
#include "pass/point_counts.h"

struct bd_native_place bd_projected_place(f3 position, f3 normal, uint32_t chance)
{
    // A quarter turn looks like none.
    const float tangent = 0.41421356f * part_of_one(stirred(chance));
    const float per = 1 / (1 + tangent * tangent);
    const float cosine = (1 - tangent * tangent) * per, sine = 2 * tangent * per;
    const struct bd_basis basis = bd_basis_of(normal);
    const f3 across = f3_add(f3_scale(basis.x, cosine), f3_scale(basis.y, sine));
    return (struct bd_native_place){position, across, f3_cross(normal, across), normal, chance};
}

// --- points in rows of lanes --------------------------------------------------------------------

static point_steps steps_of(const struct bd_point_cut *cut, uint32_t cluster, uint32_t chance,
                            uint32_t wanted)
{
    const struct bd_point_cluster *of = &cut->clusters[cluster];
    return steps_of_cluster(of->first, of->count, of->name, of->step, wanted, chance);
}

typedef void light_row_fn(const struct bd_projector *p, const struct bd_native_place *place,
                          struct bd_projected *seen);

// `cluster`: or NO_CLUSTER, and lanes are named by their points.
#define NO_CLUSTER UINT32_MAX
static inline void add_points(const struct bd_projector *p, const struct bd_native_place *place,
                              const point_steps *steps, float area, uint32_t cluster,
                              light_row_fn *row_is_full, struct bd_projected *seen)
{
    uint32_t at = steps->at;
    for (uint32_t i = 0; i < steps->count; i++, at = next_place(*steps, at)) {
        const uint32_t point = steps->first + at;
        const uint32_t lane = seen->row.count++;
        seen->row.points[lane] = p->points->points[point];
        seen->row.names[lane] = p->points->names[point];
        seen->row.area[lane] = area;
        seen->row_names[lane] = cluster == NO_CLUSTER ? point : cluster;
        if (lane == BD_LANES - 1) row_is_full(p, place, seen);
    }
}

// --- what clusters may give ---------------------------------------------------------------------

static void weigh_row(const struct bd_projector *p, const struct bd_native_place *place,
                      struct bd_projected *seen)
{
    float importance[BD_LANES];
    if (seen->row.count == 0) return;
    p->loops->weigh_points(place, &seen->row, p->as_printed, importance);
    for (uint32_t i = 0; i < seen->row.count; i++)
        seen->importance[seen->row_names[i]] += importance[i];
    seen->row.count = 0;
}

static void weigh_clusters(const struct bd_projector *p, const struct bd_point_cut *cut,
                           const struct bd_native_place *place, uint32_t chance,
                           struct bd_projected *seen)
{
    memset(seen->importance, 0, cut->count * sizeof *seen->importance);
    for (uint32_t k = 0; k < cut->count; k++) {
        const point_steps steps = steps_of(cut, k, chance, p->explore);
        add_points(p, place, &steps, p->points->area * steps.part, k, weigh_row, seen);
    }
    weigh_row(p, place, seen);
}

static void count_points(const struct bd_projector *p, const struct bd_point_cut *cut,
                         const struct bd_native_place *place, uint32_t chance,
                         struct bd_projected *seen)
{
    const uint32_t by = chance_of_counts(chance);
    for (uint32_t k = 0; k < cut->count; k++) {
        seen->importance[k] = 1;
        seen->drawn[k] = cut->clusters[k].count;
    }
    if (p->projection == BD_PROJECTION_ALL) return;
    if (p->projection == BD_PROJECTION_IMPORTANCE) weigh_clusters(p, cut, place, chance, seen);
    if (p->as_printed) {
        bd_point_counts_printed(seen->importance, cut->count, p->exploit, by, seen->drawn);
        return;
    }
    const uint32_t sum = bd_point_shares(seen->importance, cut->count, seen->shares);
    bd_point_counts(seen->shares, cut->count, sum, p->exploit, part_of_one(stirred(by)),
                    seen->drawn);
}

// --- what texels keep ---------------------------------------------------------------------------

// Slot 0 is that of who was kept before.
static void keep_seen(const struct bd_projector *p, struct bd_projected *seen)
{
    for (uint32_t t = 0; t < p->side * p->side; t++) {
        const uint32_t slot = seen->map[t] & SLOT_MASK;
        if (seen->map[t] == NO_POINT || slot == 0) continue;
        seen->point[t] = seen->of_slot[slot];
        seen->map[t] &= ~SLOT_MASK;
    }
    seen->first_slot = 1;
}

static void project_row(const struct bd_projector *p, const struct bd_native_place *place,
                        struct bd_projected *seen)
{
    uint32_t turns_away[BD_LANES];
    if (seen->row.count == 0) return;
    if (seen->first_slot + BD_LANES > BD_PROJECTED_MOST) keep_seen(p, seen);
    const struct bd_native_map map = {seen->map, p->side, p->as_printed};
    p->loops->project(place, &seen->row, seen->first_slot, &map, turns_away);
    for (uint32_t i = 0; i < seen->row.count; i++)
        seen->of_slot[stirred_slot(seen->first_slot + i)] = 2 * seen->row_names[i] + turns_away[i];
    seen->first_slot += seen->row.count;
    seen->row.count = 0;
}

// Of four beside a texel, those that are not empty, beyond the map's edge, too; one of them, if
// any.
static uint32_t count_beside(const struct bd_projector *p, const uint32_t *point, uint32_t t,
                             uint32_t *one)
{
    const uint32_t u = t % p->side, v = t / p->side, last = p->side - 1;
    const uint32_t beside[4] = {u > 0 ? t - 1 : t, u < last ? t + 1 : t, v > 0 ? t - p->side : t,
                                v < last ? t + p->side : t};
    uint32_t count = 0;
    for (uint32_t k = 0; k < 4; k++) {
        const uint32_t other = beside[(k + t) % 4];
        count += other == t || point[other] != BD_SEES_NOTHING;
        if (point[other] != BD_SEES_NOTHING) *one = point[other];
    }
    return count;
}

#define HOLE_ROUNDS 2

// An empty texel is a hole between points if at most one beside it is empty, too.
static void fill_holes(const struct bd_projector *p, struct bd_projected *seen)
{
    const uint32_t texels = p->side * p->side;
    memcpy(seen->of_slot, seen->point, texels * sizeof *seen->point);
    for (uint32_t t = 0; t < texels; t++) {
        uint32_t one = BD_SEES_NOTHING;
        if (seen->of_slot[t] == BD_SEES_NOTHING && count_beside(p, seen->of_slot, t, &one) >= 3)
            seen->point[t] = one;
    }
}

// Of a cluster all that are drawn, each for as much of it.
static void project_drawn(const struct bd_projector *p, const struct bd_point_cut *cut,
                          const struct bd_native_place *place, uint32_t chance,
                          struct bd_projected *seen)
{
    for (uint32_t k = 0; k < cut->count; k++) {
        const point_steps steps = steps_of(cut, k, chance, p->explore + seen->drawn[k]);
        const float area = p->points->area * steps.part;
        add_points(p, place, &steps, area, NO_CLUSTER, project_row, seen);
    }
}

// Of a cluster those that it was explored by, which stand for all of it; and those that exploit it,
// which stand for all of it again, by what was wanted of them (Eq. 3). Where none was, and the loop
// drew some, they share it: the paper divides by 0.
static void project_printed(const struct bd_projector *p, const struct bd_point_cut *cut,
                            const struct bd_native_place *place, uint32_t chance,
                            struct bd_projected *seen)
{
    float sum = 0;
    for (uint32_t k = 0; k < cut->count; k++) sum += seen->importance[k];
    for (uint32_t k = 0; k < cut->count; k++) {
        const point_steps explored = steps_of(cut, k, chance, p->explore);
        const float each = p->points->area * explored.part;
        add_points(p, place, &explored, each, NO_CLUSTER, project_row, seen);
        if (seen->drawn[k] == 0) continue;
        const point_steps exploited = steps_of(cut, k, ~chance, seen->drawn[k]);
        const float wanted = sum > 0 ? (float)p->exploit * seen->importance[k] / sum : 0;
        const float parts = (float)cut->clusters[k].count / wanted;
        const float area = p->points->area * (wanted > 0 ? parts : exploited.part);
        add_points(p, place, &exploited, area, NO_CLUSTER, project_row, seen);
    }
}

_Static_assert(BD_PROJECTED_MOST <= BD_MICROBUFFER_SIDE_MAX * BD_MICROBUFFER_SIDE_MAX, "room");

void bd_project_points(const struct bd_projector *p, const struct bd_point_cut *cut,
                       const struct bd_native_place *place, uint32_t chance,
                       struct bd_projected *seen)
{
    BD_ASSERT(cut->count <= BD_CLUSTERS_MAX);
    seen->row = (struct bd_native_points){0};
    seen->first_slot = 1;
    for (uint32_t t = 0; t < p->side * p->side; t++) {
        seen->map[t] = NO_POINT;
        seen->point[t] = BD_SEES_NOTHING;
    }
    if (cut->count == 0) return;
    count_points(p, cut, place, chance, seen);
    if (p->as_printed && p->projection != BD_PROJECTION_ALL)
        project_printed(p, cut, place, chance, seen);
    else
        project_drawn(p, cut, place, chance, seen);
    project_row(p, place, seen);
    keep_seen(p, seen);
    for (int round = 0; round < HOLE_ROUNDS && !p->as_printed; round++) fill_holes(p, seen);
}
