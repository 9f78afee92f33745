#include "lights/photon_map.h"

#include <stdlib.h>

#include "base/assert.h"
#include "lights/directions.h"
#include "lights/facing_trees.h"

#define OFF_PLANE   4.0f // as far as that along it
#define FACES_ALIKE 0.7f
// Of a disk, what surfaces are at least. What is nearly all of it is all of it, as nearly as so
// many points tell: less than there is would be too bright in the mean. Of a surface that lies
// close over another, which gets no light, both have some.
#define PART_LEAST 0.05f
#define NEARLY     1.5f // standard deviations of points by chance
// That a whole disk has at least, for them to say anything.
#define POINTS_LEAST 12
// More tell no more: fewer of them are asked.
#define POINTS_MOST      512
#define POINTS_OF_GLANCE 64
#define PART_NEARLY      0.94f

struct bd_photon_map {
    struct bd_facing_trees tree;
    struct bd_facing_trees
        surfaces[BD_EDGE_LEVELS]; // all points, and fewer and fewer for large disks
    f3 *flux;
    struct bd_photon_map_how how;
};

static enum bd_err plant(struct bd_photon_map *map, const struct bd_photon *photons,
                         enum bd_err (*pause)(void *user), void *user, struct bd_err_detail *detail)
{
    const uint32_t count = map->tree.count;
    struct bd_surface_points points = {.count = count,
                                       .points = malloc((count + 1) * sizeof *points.points)};
    map->flux = malloc((count + 1) * sizeof *map->flux);
    enum bd_err err = BD_ERR_OK;
    if (!map->flux || !points.points)
        err = bd_err_set(detail, BD_ERR_NO_MEMORY, "photons", "no memory for %u photons", count);
    for (uint32_t i = 0; !err && i < count; i++) {
        points.points[i] =
            (struct bd_surface_point){.position = photons[i].position, .normal = photons[i].normal};
        map->flux[i] = photons[i].flux;
    }
    if (!err) err = bd_facing_trees_init(&map->tree, &points, pause, user, detail);
    free(points.points);
    return err;
}

enum bd_err bd_photon_map_create(const struct bd_photon *photons, uint32_t count,
                                 const struct bd_photon_map_how *how,
                                 enum bd_err (*pause)(void *user), void *user,
                                 struct bd_photon_map **out, struct bd_err_detail *detail)
{
    BD_ASSERT_CMP(count, <=, BD_PHOTONS_LANDED_MAX);
    struct bd_photon_map *map = *out = calloc(1, sizeof *map);
    if (!map)
        return bd_err_set(detail, BD_ERR_NO_MEMORY, "photons", "no memory for %u photons", count);
    map->how = *how;
    map->how.surfaces = NULL; // the caller's
    map->tree.count = count;
    enum bd_err err = plant(map, photons, pause, user, detail);
    for (uint32_t l = 0; !err && how->surfaces && l < BD_EDGE_LEVELS; l++)
        err = bd_facing_trees_init(&map->surfaces[l], &how->surfaces[l], pause, user, detail);
    if (err) bd_photon_map_destroy(out);
    return err;
}

void bd_photon_map_destroy(struct bd_photon_map **map)
{
    if (!*map) return;
    bd_facing_trees_finish(&(*map)->tree);
    for (uint32_t l = 0; l < BD_EDGE_LEVELS; l++) bd_facing_trees_finish(&(*map)->surfaces[l]);
    free((*map)->flux);
    free(*map);
    *map = NULL;
}

uint64_t bd_photon_map_bytes(const struct bd_photon_map *map)
{
    uint64_t bytes = sizeof *map + map->tree.count * sizeof *map->flux;
    for (uint32_t l = 0; l < BD_EDGE_LEVELS; l++) bytes += bd_facing_trees_bytes(&map->surfaces[l]);
    return bytes + bd_facing_trees_bytes(&map->tree);
}

// --- a place ------------------------------------------------------------------------------------

// A heap, the farthest of those found on top.
struct search {
    f3 position, normal;
    float within2;
    uint32_t count;
    float distance2[BD_PHOTONS_NEAR];
    uint32_t photon[BD_PHOTONS_NEAR];
};

static void sift_up(struct search *s, uint32_t at, uint32_t photon, float distance2)
{
    for (; at > 0 && s->distance2[(at - 1) / 2] < distance2; at = (at - 1) / 2) {
        s->distance2[at] = s->distance2[(at - 1) / 2];
        s->photon[at] = s->photon[(at - 1) / 2];
    }
    s->distance2[at] = distance2;
    s->photon[at] = photon;
}

// In place of the farthest.
static void sift_down(struct search *s, uint32_t photon, float distance2)
{
    uint32_t at = 0;
    for (uint32_t child = 1; child < BD_PHOTONS_NEAR; child = 2 * at + 1) {
        child += child + 1 < BD_PHOTONS_NEAR && s->distance2[child + 1] > s->distance2[child];
        if (s->distance2[child] <= distance2) break;
        s->distance2[at] = s->distance2[child];
        s->photon[at] = s->photon[child];
        at = child;
    }
    s->distance2[at] = distance2;
    s->photon[at] = photon;
}

static bool is_near(const struct bd_point_node *node, f3 position, f3 normal, float within2,
                    float *distance2)
{
    const f3 away = f3_sub(node->position, position);
    const float off = f3_dot(away, normal);
    *distance2 = f3_dot(away, away) + (OFF_PLANE * OFF_PLANE - 1) * off * off;
    return *distance2 < within2 && f3_dot(node->normal, normal) >= FACES_ALIKE;
}

static void consider(void *user, const struct bd_point_node *node, uint32_t number)
{
    struct search *s = user;
    float distance2;
    if (!is_near(node, s->position, s->normal, s->within2, &distance2)) return;
    if (s->count < BD_PHOTONS_NEAR)
        sift_up(s, s->count++, number, distance2);
    else
        sift_down(s, number, distance2);
    if (s->count == BD_PHOTONS_NEAR) s->within2 = s->distance2[0];
}

// Of all within a disk.
struct sum {
    const struct bd_photon_disk *disk;
    const struct bd_disk_cut *cuts; // NULL: none
    struct bd_basis basis;
    float within2;
    const f3 *flux; // NULL: of points, how much of the disk is there
    f3 irradiance;
    float weight;
};

static bool is_behind(const struct bd_disk_cut *cut, f3 position)
{
    return f3_dot(cut->normal, f3_sub(position, cut->point)) < 0;
}

// By what is met on either side of it.
static bool is_cut_off(const struct sum *s, f3 position)
{
    const f3 away = f3_sub(position, s->disk->position);
    const float turn = atan2f(f3_dot(away, s->basis.y), f3_dot(away, s->basis.x)) / (2 * F_PI);
    const float place = (turn < 0 ? turn + 1 : turn) * BD_DISK_CUTS;
    const uint32_t before = (uint32_t)place % BD_DISK_CUTS, after = (before + 1) % BD_DISK_CUTS;
    return is_behind(&s->cuts[before], position) || is_behind(&s->cuts[after], position);
}

static void add(void *user, const struct bd_point_node *node, uint32_t number)
{
    struct sum *s = user;
    float distance2;
    if (!is_near(node, s->disk->position, s->disk->normal, s->within2, &distance2)) return;
    if (s->cuts && is_cut_off(s, node->position)) return;
    const float weight = 1 - distance2 / s->within2;
    if (s->flux) s->irradiance = f3_add(s->irradiance, f3_scale(s->flux[number], weight));
    s->weight += weight;
}

// Of a parabola over the disk, as far as surfaces are there.
static float area_of(const struct bd_photon_map *map, const struct sum *disk, float points_most)
{
    const float whole = 0.5f * F_PI * disk->within2;
    const struct bd_facing_trees *surfaces = map->surfaces;
    struct sum there = *disk;
    if (surfaces->count == 0 || !(POINTS_LEAST * surfaces->area < whole)) return whole;
    while (surfaces + 1 < map->surfaces + BD_EDGE_LEVELS && points_most * surfaces->area < whole)
        surfaces++;
    there.flux = NULL;
    there.weight = 0;
    bd_facing_trees_each(surfaces, disk->disk->position, disk->disk->normal, FACES_ALIKE,
                         &there.within2, add, &there);
    const float part = f_max(there.weight * surfaces->area / whole, PART_LEAST);
    const float nearly = 1 - NEARLY / f_sqrt(whole / surfaces->area);
    return whole * f_min(part + f_max(part - nearly, 0), 1);
}

// The disk's radius, squared.
static float radius2_of(const struct bd_photon_map *map, const struct search *found, uint32_t near,
                        float least)
{
    const struct bd_photon_map_how *how = &map->how;
    const float most2 = how->reach * how->reach;
    if (how->radius > 0) return f_min(how->radius * how->radius, most2);
    const float wider = f_max((float)near / BD_PHOTONS_NEAR, 1);
    return f_min(f_max(found->within2 * wider, least * least), most2);
}

static struct bd_photon_disk disk_of(const struct bd_photon_map *map, f3 position, f3 normal,
                                     uint32_t near, float least)
{
    const float reach = map->how.reach;
    struct search s = {.position = position, .normal = normal, .within2 = reach * reach};
    bd_facing_trees_each(&map->tree, position, normal, FACES_ALIKE, &s.within2, consider, &s);
    const float radius = s.count > 0 ? f_sqrt(radius2_of(map, &s, near, least)) : 0;
    return (struct bd_photon_disk){position, normal, radius};
}

struct bd_photon_disk bd_photon_disk_of(const struct bd_photon_map *map, f3 position, f3 normal,
                                        float least)
{
    return disk_of(map, position, normal, map->how.near, least);
}

static bool are_any(const struct bd_disk_cut *cuts)
{
    float sum = 0;
    for (uint32_t i = 0; cuts && i < BD_DISK_CUTS; i++)
        sum += f3_dot(cuts[i].normal, cuts[i].normal);
    return sum > 0;
}

static f3 tell(const struct bd_photon_map *map, const struct bd_photon_disk *disk,
               const struct bd_disk_cut *cuts, float points_most)
{
    struct sum sum = {.disk = disk,
                      .cuts = are_any(cuts) ? cuts : NULL,
                      .basis = bd_basis_of(disk->normal),
                      .within2 = disk->radius * disk->radius,
                      .flux = map->flux};
    if (!(disk->radius > 0)) return f3_of(0, 0, 0);
    bd_facing_trees_each(&map->tree, disk->position, disk->normal, FACES_ALIKE, &sum.within2, add,
                         &sum);
    return f3_scale(sum.irradiance, 1 / area_of(map, &sum, points_most));
}

f3 bd_photon_map_tell(const struct bd_photon_map *map, const struct bd_photon_disk *disk,
                      const struct bd_disk_cut *cuts)
{
    return tell(map, disk, cuts, POINTS_MOST);
}

f3 bd_photon_map_look(const struct bd_photon_map *map, f3 position, f3 normal, float least)
{
    const struct bd_photon_disk disk = bd_photon_disk_of(map, position, normal, least);
    return bd_photon_map_tell(map, &disk, NULL);
}

f3 bd_photon_map_glance(const struct bd_photon_map *map, f3 position, f3 normal, uint32_t near)
{
    const struct bd_photon_disk disk =
        disk_of(map, position, normal, near < map->how.near ? near : map->how.near, 0);
    return tell(map, &disk, NULL, POINTS_OF_GLANCE);
}
