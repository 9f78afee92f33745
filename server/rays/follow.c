// What a structure of one snapshot takes over from that of another: the triangles of instances that
// both have, in the same place. What is new or moved is a part of its own beside it.

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "rays/structure.h"

// What a ray may cost in two parts, by the one that all of the snapshot would be.
#define COST_MAX 1.5
// Of beginning a part, in steps down a tree.
#define BEGIN_STEPS 3.0

// --- what both have ---------------------------------------------------------------------------

// Of both scenes' instances, which are ordered so (scene/order.c).
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

// Some instances: how many triangles, and how often a ray comes to them.
struct share {
    uint64_t triangles;
    double chance;
};

static double area(bd_dvec3 low, bd_dvec3 high)
{
    const bd_dvec3 d = bd_dvec3_sub(high, low);
    return d.x * d.y + d.y * d.z + d.z * d.x;
}

// By the surface of its box and of the scene's.
static double chance_of(const struct bd_scene *scene, const bd_dmat4 *matrix,
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
    const double chance = area(low, high) / whole;
    return chance >= 0 && chance <= 1 ? chance : 1;
}

static void add_to(struct share *share, const struct bd_scene *scene, uint32_t instance)
{
    const struct bd_instance *at = &scene->instances[instance];
    const struct bd_mesh *mesh = scene->meshes[at->mesh];
    for (uint32_t p = 0; p < mesh->primitive_count; p++) {
        if (mesh->primitives[p].index_count == 0) continue;
        share->triangles += mesh->primitives[p].index_count / 3;
        share->chance += chance_of(scene, &at->world_from_mesh, &mesh->primitives[p]);
    }
    share->chance = fmin(share->chance, 1);
}

// Down a tree of them, once it is begun.
static double steps(uint64_t triangles)
{
    return triangles ? BEGIN_STEPS + log2(1 + (double)triangles) : 0;
}

// What a ray costs in the part and beside it, by what it would in one part. What is no more is
// walked through for nothing, and everybody asks whether the second part is on their way.
static double cost_of(const struct bd_rays *rays, const struct bd_rays_part *part,
                      const struct match *match)
{
    struct share stale = {0}, moved = {0};
    for (uint32_t s = 0; s < part->shown_count; s++)
        if (match->now[s] == BD_NOWHERE) add_to(&stale, part->scene, part->shown[s].instance);
    for (uint32_t i = 0; i < rays->scene->instance_count; i++)
        if (match->is_moved[i]) add_to(&moved, rays->scene, i);
    const double whole = steps(rays->order.triangle_count);
    const double apart =
        steps(part->triangle_count - stale.triangles) + stale.chance * steps(stale.triangles) +
        (moved.triangles ? BEGIN_STEPS : 0) + moved.chance * steps(moved.triangles);
    return whole > 0 ? apart / whole : INFINITY;
}

// --- following --------------------------------------------------------------------------------

static bool has_moved(const struct bd_rays *rays, const struct match *match)
{
    for (uint32_t i = 0; i < rays->scene->instance_count; i++)
        if (match->is_moved[i] && rays->places[i].first_run != BD_NOWHERE) return true;
    return false;
}

static enum bd_err take_over(struct bd_rays *rays, struct bd_rays_part *part,
                             const struct match *match, const struct bd_rays_build *build,
                             struct bd_fault *fault)
{
    const struct bd_rays_wish moved = {
        .wanted = match->is_moved, .lender = part, .quality = RTC_BUILD_QUALITY_LOW};
    enum bd_err err = bd_rays_add_shared(rays, part, match->now, fault);
    if (!err && has_moved(rays, match)) err = bd_rays_add_built(rays, &moved, build, fault);
    return err;
}

static enum bd_err follow(struct bd_rays *rays, const struct bd_rays *earlier,
                          const struct bd_rays_build *build, struct bd_fault *fault)
{
    const struct bd_rays_wish all = {.quality = RTC_BUILD_QUALITY_MEDIUM};
    struct bd_rays_part *part = earlier->levels[0].part;
    if (!bd_rays_could_follow(earlier, rays->scene))
        return bd_rays_add_built(rays, &all, build, fault);
    struct match match = match_part(rays, part);
    const bool is_worth_it = cost_of(rays, part, &match) <= COST_MAX;
    enum bd_err err = is_worth_it ? take_over(rays, part, &match, build, fault)
                                  : bd_rays_add_built(rays, &all, build, fault);
    free_match(&match);
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
                           struct bd_fault *fault)
{
    struct bd_rays *rays;
    enum bd_err err = bd_rays_begin(scene, build, &rays, fault);
    if (!err) err = follow(rays, earlier, build, fault);
    if (err) bd_rays_destroy(&rays);
    *out = rays;
    return err;
}
