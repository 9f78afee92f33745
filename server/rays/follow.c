// What a structure of one snapshot takes over from that of another: the triangles of instances that
// both have, in the same place. What is new or moved is a part of its own beside it.

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "rays/structure.h"

// What a ray may cost in two parts, by the one that all of the snapshot would be.
#define COST_MAX 1.5
// In steps down a tree: of beginning a trace, and of a second part that most rays pass by.
#define BEGIN_STEPS  3.0
#define BESIDE_STEPS 1.0
// What is no more is met, and passed over; a part built in a hurry has a worse tree.
#define STALE_FACTOR 1.5
#define HURRY_FACTOR 1.5
// Up to so many triangles a part takes some milliseconds however it is built.
#define HURRY_TRIANGLES_MIN 16384u

// Triangles built in a hurry in the time of one that is not.
#define WASTED_MAX 4u

// --- what both have ---------------------------------------------------------------------------

// Of both scenes' instances, which are ordered so (scene/model/draw_order.c).
static int compare(const struct bd_scene *a, const struct bd_instance *left,
                   const struct bd_scene *b, const struct bd_instance *right)
{
    const uint64_t hash_a = a->meshes[left->mesh]->content_hash;
    const uint64_t hash_b = b->meshes[right->mesh]->content_hash;
    if (hash_a != hash_b) return hash_a < hash_b ? -1 : 1;
    return memcmp(&left->world_from_mesh, &right->world_from_mesh, sizeof left->world_from_mesh);
}

struct match {
    uint32_t *now;  // of each that the part shows: the snapshot's instance, or BD_NOWHERE
    bool *is_moved; // of each of the snapshot's: it is not in the part
};

static bool is_same(const struct bd_rays *rays, uint32_t instance, const struct bd_rays_part *part,
                    const struct bd_shown *shown)
{
    return rays->places[instance].first_run != BD_NOWHERE &&
           rays->places[instance].is_kept == shown->is_kept &&
           bd_rays_same_mesh(rays->scene, (uint32_t)rays->scene->instances[instance].mesh,
                             part->scene, (uint32_t)part->scene->instances[shown->instance].mesh);
}

static struct match match_part(const struct bd_rays *rays, const struct bd_rays_part *part)
{
    const struct bd_scene *scene = rays->scene;
    struct match match = {calloc((size_t)part->shown_count + 1, sizeof *match.now),
                          calloc((size_t)scene->instance_count + 1, sizeof *match.is_moved)};
    BD_ASSERT(match.now && match.is_moved);
    for (uint32_t s = 0; s < part->shown_count; s++) match.now[s] = BD_NOWHERE;
    for (uint32_t i = 0; i < scene->instance_count; i++) match.is_moved[i] = true;
    for (uint32_t s = 0, i = 0; s < part->shown_count && i < scene->instance_count;) {
        const int order = compare(scene, &scene->instances[i], part->scene,
                                  &part->scene->instances[part->shown[s].instance]);
        if (order == 0 && is_same(rays, i, part, &part->shown[s])) {
            match.now[s] = i;
            match.is_moved[i] = false;
        }
        if (order <= 0) i++;
        if (order >= 0) s++;
    }
    return match;
}

static void free_match(struct match *match)
{
    free(match->now);
    free(match->is_moved);
}

// --- what it costs ----------------------------------------------------------------------------

// Some instances: how many triangles, and what a ray that comes by does for them.
struct share {
    uint64_t triangles;
    double steps;
};

static double area(bd_dvec3 low, bd_dvec3 high)
{
    const bd_dvec3 d = bd_dvec3_sub(high, low);
    return d.x * d.y + d.y * d.z + d.z * d.x;
}

// By the surface of its box and of the scene's.
static double pdf_of(const struct bd_scene *scene, const bd_dmat4 *matrix,
                     const struct bd_primitive *p)
{
    bd_dvec3 low = {INFINITY, INFINITY, INFINITY}, high = {-INFINITY, -INFINITY, -INFINITY};
    for (int corner = 0; corner < 8; corner++) {
        const bd_dvec3 at =
            bd_dmat4_point(matrix, (bd_dvec3){corner & 1 ? p->bounds_max[0] : p->bounds_min[0],
                                              corner & 2 ? p->bounds_max[1] : p->bounds_min[1],
                                              corner & 4 ? p->bounds_max[2] : p->bounds_min[2]});
        low = (bd_dvec3){fmin(low.x, at.x), fmin(low.y, at.y), fmin(low.z, at.z)};
        high = (bd_dvec3){fmax(high.x, at.x), fmax(high.y, at.y), fmax(high.z, at.z)};
    }
    const double whole = area(scene->features.bounds_min, scene->features.bounds_max);
    const double pdf = area(low, high) / whole;
    return pdf >= 0 && pdf <= 1 ? pdf : 1;
}

static void add_to(struct share *share, const struct bd_scene *scene, uint32_t instance)
{
    const struct bd_instance *at = &scene->instances[instance];
    const struct bd_mesh *mesh = scene->meshes[at->mesh];
    for (uint32_t p = 0; p < mesh->primitive_count; p++) {
        const uint32_t triangles = mesh->primitives[p].index_count / 3;
        if (triangles == 0) continue;
        share->triangles += triangles;
        share->steps +=
            log2(1.0 + triangles) * pdf_of(scene, &at->world_from_mesh, &mesh->primitives[p]);
    }
}

static enum RTCBuildQuality quality_for(uint64_t triangles)
{
    return triangles < HURRY_TRIANGLES_MIN ? RTC_BUILD_QUALITY_MEDIUM : RTC_BUILD_QUALITY_LOW;
}

// What a ray costs in two parts, by what it would in one. Of the snapshot `is_moved` is the second;
// `part`, if there is one, the first with what of it is no more.
struct cost {
    struct share all, moved;
    double of_ray;
};

static struct cost cost_of(const struct bd_rays *rays, const bool *is_moved,
                           const struct bd_rays_part *part, const uint32_t *now)
{
    struct share stale = {0};
    struct cost cost = {0};
    for (uint32_t i = 0; i < rays->scene->instance_count; i++) {
        add_to(&cost.all, rays->scene, i);
        if (is_moved[i]) add_to(&cost.moved, rays->scene, i);
    }
    for (uint32_t s = 0; part && s < part->shown_count; s++)
        if (now[s] == BD_NOWHERE) add_to(&stale, part->scene, part->shown[s].instance);
    const bool in_a_hurry = quality_for(cost.moved.triangles) == RTC_BUILD_QUALITY_LOW;
    const double whole = BEGIN_STEPS + cost.all.steps;
    const double settled = whole - cost.moved.steps + STALE_FACTOR * stale.steps;
    const double moved = cost.moved.triangles
                             ? BESIDE_STEPS + (in_a_hurry ? HURRY_FACTOR : 1) * cost.moved.steps
                             : 0;
    cost.of_ray = (settled + moved) / whole;
    return cost;
}

// --- following --------------------------------------------------------------------------------

static enum bd_err add_moved(struct bd_rays *rays, const bool *is_moved, const struct cost *cost,
                             const struct bd_rays_build *build, struct bd_err_detail *detail)
{
    const struct bd_rays_wish wish = {.wanted = is_moved,
                                      .lender = rays->levels[0].part,
                                      .quality = quality_for(cost->moved.triangles)};
    return cost->moved.triangles ? bd_rays_add_built(rays, &wish, build, detail) : BD_ERR_OK;
}

// What of `is_moved` the earlier one has in its second part: it is left as `is_new` only what none
// has. Returns how many triangles that takes away.
static uint64_t find_settled(const struct bd_rays *rays, const struct bd_rays *earlier,
                             const bool *is_moved, bool *is_new)
{
    const uint32_t count = rays->scene->instance_count;
    struct share settled = {0};
    memcpy(is_new, is_moved, count * sizeof *is_new);
    if (earlier->level_count < 2) return 0;
    struct match second = match_part(rays, earlier->levels[1].part);
    for (uint32_t i = 0; i < count; i++) {
        if (!is_moved[i] || second.is_moved[i]) continue;
        is_new[i] = false;
        add_to(&settled, rays->scene, i);
    }
    free_match(&second);
    return settled.triangles;
}

// On the first part of the earlier one, all else beside it.
static enum bd_err share_first(struct bd_rays *rays, struct bd_rays_part *part,
                               const struct match *match, const struct cost *cost,
                               const struct bd_rays_build *build, struct bd_err_detail *detail)
{
    enum bd_err err = bd_rays_add_shared(rays, part, match->now, detail);
    return err ? err : add_moved(rays, match->is_moved, cost, build, detail);
}

// Both parts anew, the second of what is new: what moves once often moves again, and then the first
// is shared.
static enum bd_err build_anew(struct bd_rays *rays, const bool *is_new,
                              const struct bd_rays_build *build, struct bd_err_detail *detail)
{
    const uint32_t count = rays->scene->instance_count;
    bool *is_settled = calloc((size_t)count + 1, sizeof *is_settled);
    BD_ASSERT(is_settled);
    for (uint32_t i = 0; i < count; i++) is_settled[i] = !is_new[i];
    const struct cost cost = cost_of(rays, is_new, NULL, NULL);
    const bool is_split = cost.of_ray <= COST_MAX;
    const struct bd_rays_wish first = {.wanted = is_split ? is_settled : NULL,
                                       .quality = RTC_BUILD_QUALITY_MEDIUM};
    enum bd_err err = bd_rays_add_built(rays, &first, build, detail);
    if (!err && is_split) err = add_moved(rays, is_new, &cost, build, detail);
    free(is_settled);
    return err;
}

static enum bd_err follow(struct bd_rays *rays, const struct bd_rays *earlier,
                          const struct bd_rays_build *build, struct bd_err_detail *detail)
{
    struct bd_rays_part *part = earlier->levels[0].part;
    struct match match = match_part(rays, part);
    const struct cost cost = cost_of(rays, match.is_moved, part, match.now);
    bool *is_new = calloc((size_t)rays->scene->instance_count + 1, sizeof *is_new);
    BD_ASSERT(is_new);
    const uint64_t settled = find_settled(rays, earlier, match.is_moved, is_new);
    rays->wasted = earlier->wasted + settled;
    const bool shares = bd_rays_could_follow(earlier, rays->scene) && cost.of_ray <= COST_MAX &&
                        rays->wasted <= WASTED_MAX * cost.all.triangles;
    if (!shares) rays->wasted = 0;
    enum bd_err err = shares ? share_first(rays, part, &match, &cost, build, detail)
                             : build_anew(rays, is_new, build, detail);
    free_match(&match);
    free(is_new);
    return err;
}

bool bd_rays_could_follow(const struct bd_rays *earlier, const struct bd_scene *scene)
{
    const struct bd_render_space space = bd_render_space_of(scene), *was = &earlier->space;
    return memcmp(&was->origin_m, &space.origin_m, sizeof space.origin_m) == 0 &&
           was->render_per_m == space.render_per_m;
}

bool bd_rays_share(const struct bd_rays *a, const struct bd_rays *b)
{
    return a->levels[0].part == b->levels[0].part;
}

enum bd_err bd_rays_follow(const struct bd_rays *earlier, struct bd_scene *scene,
                           const struct bd_rays_build *build, struct bd_rays **out,
                           struct bd_err_detail *detail)
{
    struct bd_rays *rays;
    enum bd_err err = bd_rays_begin(scene, build, &rays, detail);
    if (!err) err = follow(rays, earlier, build, detail);
    if (err) bd_rays_destroy(&rays);
    *out = rays;
    return err;
}
