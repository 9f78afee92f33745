#include "lights/photon_map.h"

#include <stdlib.h>

#include "base/assert.h"
#include "lights/point_tree.h"

#define OFF_PLANE   4.0f // as far as that along it
#define FACES_ALIKE 0.7f

struct bd_photon_map {
    struct bd_point_tree tree;
    f3 *flux;
    float reach;
};

enum bd_err bd_photon_map_create(const struct bd_photon *photons, uint32_t count, float reach,
                                 enum bd_err (*pause)(void *user), void *user,
                                 struct bd_photon_map **out, struct bd_err_detail *detail)
{
    BD_ASSERT_CMP(count, <=, BD_PHOTONS_MAX);
    struct bd_photon_map *map = *out = calloc(1, sizeof *map);
    struct bd_surface_points points = {.count = count,
                                       .points = malloc((count + 1) * sizeof *points.points)};
    enum bd_err err = BD_ERR_OK;
    if (map) map->flux = malloc((count + 1) * sizeof *map->flux);
    if (!map || !map->flux || !points.points)
        err = bd_err_set(detail, BD_ERR_NO_MEMORY, "photons", "no memory for %u photons", count);
    for (uint32_t i = 0; !err && i < count; i++) {
        points.points[i] =
            (struct bd_surface_point){.position = photons[i].position, .normal = photons[i].normal};
        map->flux[i] = photons[i].flux;
    }
    if (!err) map->reach = reach;
    if (!err) err = bd_point_tree_init(&map->tree, &points, pause, user, detail);
    free(points.points);
    if (err) bd_photon_map_destroy(out);
    return err;
}

void bd_photon_map_destroy(struct bd_photon_map **map)
{
    if (!*map) return;
    bd_point_tree_finish(&(*map)->tree);
    free((*map)->flux);
    free(*map);
    *map = NULL;
}

uint64_t bd_photon_map_bytes(const struct bd_photon_map *map)
{
    return sizeof *map + map->tree.count * (sizeof *map->tree.nodes + sizeof *map->flux);
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

static void consider(void *user, const struct bd_point_node *node)
{
    struct search *s = user;
    float distance2;
    if (!is_near(node, s->position, s->normal, s->within2, &distance2)) return;
    if (s->count < BD_PHOTONS_NEAR)
        sift_up(s, s->count++, node->point, distance2);
    else
        sift_down(s, node->point, distance2);
    if (s->count == BD_PHOTONS_NEAR) s->within2 = s->distance2[0];
}

// Of all within a disk.
struct sum {
    f3 position, normal;
    float within2;
    const struct bd_photon_map *map;
    f3 irradiance;
};

static void add(void *user, const struct bd_point_node *node)
{
    struct sum *s = user;
    float distance2;
    if (!is_near(node, s->position, s->normal, s->within2, &distance2)) return;
    s->irradiance =
        f3_add(s->irradiance, f3_scale(s->map->flux[node->point], 1 - distance2 / s->within2));
}

f3 bd_photon_map_look(const struct bd_photon_map *map, f3 position, f3 normal, float least)
{
    struct search s = {.position = position, .normal = normal, .within2 = map->reach * map->reach};
    bd_point_tree_each(&map->tree, position, &s.within2, consider, &s);
    if (s.count == 0) return f3_of(0, 0, 0);
    struct sum sum = {.position = position,
                      .normal = normal,
                      .within2 =
                          f_max(s.within2, f_min(least, map->reach) * f_min(least, map->reach)),
                      .map = map};
    if (sum.within2 > s.within2)
        bd_point_tree_each(&map->tree, position, &sum.within2, add, &sum);
    else
        for (uint32_t i = 0; i < s.count; i++)
            sum.irradiance = f3_add(
                sum.irradiance, f3_scale(map->flux[s.photon[i]], 1 - s.distance2[i] / s.within2));
    return f3_scale(sum.irradiance, 2 / (F_PI * sum.within2));
}
