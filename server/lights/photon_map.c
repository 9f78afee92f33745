#include "lights/photon_map.h"

#include <stdlib.h>

#include "base/assert.h"
#include "kernel/all_channels.h"
#include "lights/disk_sums.h"

// Of a disk, what surfaces are at least. What is nearly all of it is all of it, as nearly as so
// many points tell: less than there is would be too bright in the mean. Of a surface that lies
// close over another, which gets no light, both have some.
#define PART_LEAST 0.05f
#define NEARLY     1.5f // standard deviations of points by chance
// That a whole disk has at least, for them to say anything.
#define POINTS_LEAST 12
// Disks that hold so many times as many photons as they should shrink, so often at most, to no less
// than that part of their area at once.
#define TOO_MANY     1.5f
#define SHRINKS      8
#define SHRINK_LEAST 0.25f
// Of a photon's way to the normal: what grazes tells other normals too much.
#define COSINE_LEAST 0.05f

struct bd_photon_map {
    struct bd_facing_trees photons, surfaces;
    struct bd_disk_sums flux_sums, vector_sums, count_sums, surface_sums;
    // Of photons.
    f3 *flux, *vector;
    bool *is_met, *is_by_brushed;
    struct bd_photon_map_how how;
};

// The irradiance vector of one, of all channels together.
static f3 vector_of(const struct bd_photon *photon)
{
    const float cosine = f_max(f3_dot(photon->normal, photon->way), COSINE_LEAST);
    return f3_scale(photon->way, all_channels(photon->flux) / cosine);
}

static void keep_light(struct bd_photon_map *map, const struct bd_photon *photons, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        map->flux[i] = photons[i].flux;
        map->vector[i] = vector_of(&photons[i]);
        map->is_met[i] = photons[i].is_met;
        map->is_by_brushed[i] = photons[i].is_by_brushed;
    }
}

static enum bd_err plant(struct bd_photon_map *map, const struct bd_photon *photons, uint32_t count,
                         enum bd_err (*pause)(void *user), void *user, struct bd_err_detail *detail)
{
    struct bd_surface_points points = {.count = count,
                                       .points = malloc((count + 1) * sizeof *points.points)};
    map->flux = malloc((count + 1) * sizeof *map->flux);
    map->vector = malloc((count + 1) * sizeof *map->vector);
    map->is_met = malloc((count + 1) * sizeof *map->is_met);
    map->is_by_brushed = malloc((count + 1) * sizeof *map->is_by_brushed);
    enum bd_err err = BD_ERR_OK;
    if (!map->flux || !map->vector || !map->is_met || !map->is_by_brushed || !points.points)
        err = bd_err_set(detail, BD_ERR_NO_MEMORY, "photons", "no memory for %u photons", count);
    else
        keep_light(map, photons, count);
    for (uint32_t i = 0; !err && i < count; i++)
        points.points[i] =
            (struct bd_surface_point){.position = photons[i].position, .normal = photons[i].normal};
    if (!err) err = bd_facing_trees_init(&map->photons, &points, pause, user, detail);
    if (!err) err = bd_disk_sums_init(&map->flux_sums, &map->photons, map->flux, detail);
    if (!err) err = bd_disk_sums_init(&map->vector_sums, &map->photons, map->vector, detail);
    if (!err) err = bd_disk_sums_init(&map->count_sums, &map->photons, NULL, detail);
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
    enum bd_err err = plant(map, photons, count, pause, user, detail);
    if (!err && how->surfaces)
        err = bd_facing_trees_init(&map->surfaces, how->surfaces, pause, user, detail);
    if (!err && how->surfaces)
        err = bd_disk_sums_init(&map->surface_sums, &map->surfaces, NULL, detail);
    if (err) bd_photon_map_destroy(out);
    return err;
}

void bd_photon_map_destroy(struct bd_photon_map **map)
{
    struct bd_photon_map *m = *map;
    if (!m) return;
    bd_disk_sums_finish(&m->flux_sums);
    bd_disk_sums_finish(&m->vector_sums);
    bd_disk_sums_finish(&m->count_sums);
    bd_disk_sums_finish(&m->surface_sums);
    bd_facing_trees_finish(&m->photons);
    bd_facing_trees_finish(&m->surfaces);
    free(m->flux);
    free(m->vector);
    free(m->is_met);
    free(m->is_by_brushed);
    free(m);
    *map = NULL;
}

uint64_t bd_photon_map_bytes(const struct bd_photon_map *map)
{
    const uint64_t each =
        sizeof *map->flux + sizeof *map->vector + sizeof *map->is_met + sizeof *map->is_by_brushed;
    return sizeof *map + map->photons.count * each + bd_facing_trees_bytes(&map->photons) +
           bd_facing_trees_bytes(&map->surfaces) + bd_disk_sums_bytes(&map->flux_sums) +
           bd_disk_sums_bytes(&map->vector_sums) + bd_disk_sums_bytes(&map->count_sums) +
           bd_disk_sums_bytes(&map->surface_sums);
}

// --- a place ------------------------------------------------------------------------------------

// A heap, the farthest of those found on top.
struct search {
    struct bd_disk disk; // what is nearer than the farthest found
    float enough2;       // nobody asks how much nearer than that all of them are
    uint32_t count;
    float distance2[BD_PHOTONS_NEAR];
    uint32_t photon[BD_PHOTONS_NEAR];
};

static void put(struct search *s, uint32_t at, uint32_t photon, float distance2)
{
    s->distance2[at] = distance2;
    s->photon[at] = photon;
}

static void sift_up(struct search *s, uint32_t photon, float distance2)
{
    uint32_t at = s->count++;
    for (; at > 0 && s->distance2[(at - 1) / 2] < distance2; at = (at - 1) / 2)
        put(s, at, s->photon[(at - 1) / 2], s->distance2[(at - 1) / 2]);
    put(s, at, photon, distance2);
}

// In place of the farthest.
static void sift_down(struct search *s, uint32_t photon, float distance2)
{
    uint32_t at = 0;
    for (uint32_t child = 1; child < BD_PHOTONS_NEAR; child = 2 * at + 1) {
        child += child + 1 < BD_PHOTONS_NEAR && s->distance2[child + 1] > s->distance2[child];
        if (s->distance2[child] <= distance2) break;
        put(s, at, s->photon[child], s->distance2[child]);
        at = child;
    }
    put(s, at, photon, distance2);
}

static void consider(void *user, uint32_t number, float distance2)
{
    struct search *s = user;
    if (s->count < BD_PHOTONS_NEAR)
        sift_up(s, number, distance2);
    else
        sift_down(s, number, distance2);
    if (s->count < BD_PHOTONS_NEAR) return;
    s->disk.within2 = s->distance2[0] > s->enough2 ? s->distance2[0] : 0;
}

// Of a parabola over the disk, as far as surfaces are there.
static float area_of(const struct bd_photon_map *map, const struct bd_disk *disk,
                     const struct bd_disk_cut *cuts)
{
    const float whole = 0.5f * F_PI * disk->within2, point = map->surfaces.area;
    if (map->surfaces.count == 0 || !(POINTS_LEAST * point < whole)) return whole;
    const float there = bd_disk_sums_of(&map->surface_sums, disk, cuts).x;
    const float part = f_max(there * point / whole, PART_LEAST);
    const float nearly = 1 - NEARLY / f_sqrt(whole / point);
    return whole * f_min(part + f_max(part - nearly, 0), 1);
}

static float most2_of(const struct bd_photon_map *map)
{
    return map->how.reach * map->how.reach;
}

// More than the pilot's that its disk holds take a wider one.
static float wider_of(const struct bd_photon_map *map)
{
    return f_max((float)map->how.near / BD_PHOTONS_NEAR, 1);
}

static struct search pilot_of(const struct bd_photon_map *map, f3 position, f3 normal, float least)
{
    const float most2 = most2_of(map), enough2 = f_min(least * least, most2) / wider_of(map);
    struct search s = {.disk = {position, normal, most2},
                       .enough2 = map->how.radius > 0 ? most2 : enough2}; // one is enough
    bd_disk_sums_each(&map->flux_sums, &s.disk, NULL, consider, &s);
    return s;
}

// Squared.
static float radius2_of(const struct bd_photon_map *map, const struct search *pilot, float least)
{
    const float most2 = most2_of(map);
    if (pilot->count == 0) return 0;
    if (map->how.radius > 0) return f_min(map->how.radius * map->how.radius, most2);
    return f_min(f_max(pilot->disk.within2 * wider_of(map), least * least), most2);
}

// Photons that a disk holds, by a parabola: a half of them where they are even.
static float held_by(const struct bd_photon_map *map, const struct bd_disk *at, float radius2)
{
    const struct bd_disk disk = {at->position, at->normal, radius2};
    return 2 * bd_disk_sums_of(&map->count_sums, &disk, NULL).x;
}

// Where photons are much denser a little farther off, the pilot's disk holds too many of those, and
// tells of there: it shrinks until it holds as many as it should, to the pilot's own at most.
static float shrunk(const struct bd_photon_map *map, const struct search *pilot, float radius2,
                    float least)
{
    const float enough = f_max((float)map->how.near, BD_PHOTONS_NEAR);
    const float least2 = f_min(f_max(least * least, pilot->disk.within2), radius2);
    if (pilot->count < BD_PHOTONS_NEAR || map->how.radius > 0) return radius2;
    for (int turn = 0; turn < SHRINKS && radius2 > least2; turn++) {
        const float held = held_by(map, &pilot->disk, radius2);
        if (held <= TOO_MANY * enough) break;
        radius2 = f_max(radius2 * f_max(enough / held, SHRINK_LEAST), least2);
    }
    return radius2;
}

struct bd_photon_disk bd_photon_disk_of(const struct bd_photon_map *map, f3 position, f3 normal,
                                        float least)
{
    const struct search pilot = pilot_of(map, position, normal, least);
    const float radius2 = shrunk(map, &pilot, radius2_of(map, &pilot, least), least);
    return (struct bd_photon_disk){position, normal, f_sqrt(radius2)};
}

static struct bd_disk on_of(const struct bd_photon_disk *disk)
{
    return (struct bd_disk){disk->position, disk->normal, disk->radius * disk->radius};
}

f3 bd_photon_map_tell(const struct bd_photon_map *map, const struct bd_photon_disk *disk,
                      const struct bd_disk_cut *cuts, f3 *vector)
{
    const f3 nothing = f3_of(0, 0, 0);
    const struct bd_disk on = on_of(disk);
    if (vector) *vector = nothing;
    if (!(disk->radius > 0)) return nothing;
    const float per_area = 1 / area_of(map, &on, cuts);
    if (vector) *vector = f3_scale(bd_disk_sums_of(&map->vector_sums, &on, cuts), per_area);
    const f3 irradiance = f3_scale(bd_disk_sums_of(&map->flux_sums, &on, cuts), per_area);
    return f3_of(f_max(irradiance.x, 0), f_max(irradiance.y, 0), f_max(irradiance.z, 0));
}

struct telling {
    const struct bd_photon_map *map;
    float per_area, within2;
    void (*look)(void *user, const struct bd_photon_told *told);
    void *user;
};

static void tell_one(void *user, uint32_t number, float distance2)
{
    const struct telling *t = user;
    const f3 vector = t->map->vector[number];
    const float weight = 1 - distance2 / t->within2;
    if (!(f3_dot(vector, vector) > 0)) return; // it brings nothing
    const struct bd_photon_told told = {
        .irradiance = f3_scale(t->map->flux[number], weight * t->per_area),
        .way = f3_unit(vector),
        .is_met = t->map->is_met[number],
        .is_by_brushed = t->map->is_by_brushed[number],
    };
    t->look(t->user, &told);
}

void bd_photon_map_each(const struct bd_photon_map *map, const struct bd_photon_disk *disk,
                        const struct bd_disk_cut *cuts,
                        void (*look)(void *user, const struct bd_photon_told *told), void *user)
{
    const struct bd_disk on = on_of(disk);
    if (!(disk->radius > 0)) return;
    struct telling telling = {map, 1 / area_of(map, &on, cuts), on.within2, look, user};
    bd_disk_sums_each(&map->flux_sums, &on, cuts, tell_one, &telling);
}

// Of a disk that ends at the farthest of those that the pilot found.
static f3 sum_of_pilot(const struct bd_photon_map *map, const struct search *pilot)
{
    f3 sum = f3_of(0, 0, 0);
    for (uint32_t i = 0; i < pilot->count; i++)
        sum = f3_add(sum, f3_scale(map->flux[pilot->photon[i]],
                                   1 - pilot->distance2[i] / pilot->disk.within2));
    return sum;
}

f3 bd_photon_map_look(const struct bd_photon_map *map, f3 position, f3 normal, float least)
{
    const struct search pilot = pilot_of(map, position, normal, least);
    const float radius2 = shrunk(map, &pilot, radius2_of(map, &pilot, least), least);
    const struct bd_disk on = {position, normal, radius2};
    if (!(on.within2 > 0)) return f3_of(0, 0, 0);
    const f3 flux = on.within2 == pilot.disk.within2 ? sum_of_pilot(map, &pilot)
                                                     : bd_disk_sums_of(&map->flux_sums, &on, NULL);
    return f3_scale(flux, 1 / area_of(map, &on, NULL));
}
