#include "scene/scene.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"

static void retain(uint32_t *reference_count)
{
    uint32_t before = __atomic_fetch_add(reference_count, 1, __ATOMIC_RELAXED);
    BD_ASSERT_CMP(before, >, 0);
}

// True for the one caller who dropped the last reference.
static bool drop(uint32_t *reference_count)
{
    uint32_t before = __atomic_fetch_sub(reference_count, 1, __ATOMIC_ACQ_REL);
    BD_ASSERT_CMP(before, >, 0);
    return before == 1;
}

struct bd_mesh *bd_mesh_retain(struct bd_mesh *mesh)
{
    retain(&mesh->reference_count);
    return mesh;
}

static void free_primitive(struct bd_primitive *primitive)
{
    free(primitive->position);
    free(primitive->normal);
    free(primitive->tangent);
    free(primitive->uv[0]);
    free(primitive->uv[1]);
    free(primitive->color);
    free(primitive->index);
}

void bd_mesh_release(struct bd_mesh **mesh)
{
    struct bd_mesh *dropped = *mesh;
    *mesh = NULL;
    if (!dropped || !drop(&dropped->reference_count)) return;
    for (uint32_t i = 0; i < dropped->primitive_count; i++) free_primitive(&dropped->primitives[i]);
    free(dropped->primitives);
    free(dropped);
}

struct bd_picture *bd_picture_retain(struct bd_picture *picture)
{
    retain(&picture->reference_count);
    return picture;
}

void bd_picture_release(struct bd_picture **picture)
{
    struct bd_picture *dropped = *picture;
    *picture = NULL;
    if (!dropped || !drop(&dropped->reference_count)) return;
    free(dropped->rgba);
    free(dropped);
}

struct bd_sky_map *bd_sky_map_retain(struct bd_sky_map *map)
{
    retain(&map->reference_count);
    return map;
}

void bd_sky_map_release(struct bd_sky_map **map)
{
    struct bd_sky_map *dropped = *map;
    *map = NULL;
    if (!dropped || !drop(&dropped->reference_count)) return;
    free(dropped->rgb);
    free(dropped);
}

struct bd_scene *bd_scene_create(void)
{
    struct bd_scene *scene = calloc(1, sizeof *scene);
    BD_ASSERT(scene);
    scene->reference_count = 1;
    return scene;
}

struct bd_scene *bd_scene_retain(struct bd_scene *scene)
{
    retain(&scene->reference_count);
    return scene;
}

// An importer that failed half-way leaves counted slots that are still NULL.
void bd_scene_release(struct bd_scene **scene)
{
    struct bd_scene *dropped = *scene;
    *scene = NULL;
    if (!dropped || !drop(&dropped->reference_count)) return;
    for (uint32_t i = 0; dropped->meshes && i < dropped->mesh_count; i++)
        bd_mesh_release(&dropped->meshes[i]);
    for (uint32_t i = 0; dropped->pictures && i < dropped->picture_count; i++)
        bd_picture_release(&dropped->pictures[i]);
    bd_sky_map_release(&dropped->environment.map);
    free(dropped->nodes);
    free(dropped->meshes);
    free(dropped->materials);
    free(dropped->textures);
    free(dropped->pictures);
    free(dropped->lights);
    free(dropped->cameras);
    free(dropped->instances);
    free(dropped->placed_lights);
    free(dropped->placed_cameras);
    free(dropped);
}

void bd_scene_flag(struct bd_scene *scene, const char *format, ...)
{
    struct bd_scene_flags *flags = &scene->flags;
    if (flags->count == BD_SCENE_FLAG_MAX) return;
    va_list args;
    va_start(args, format);
    vsnprintf(flags->text[flags->count++], sizeof flags->text[0], format, args);
    va_end(args);
}

// Decimal digits only and in range: "1x" and "4294967296" are names, not indices.
static int32_t index_of(const char *digits, uint32_t count)
{
    uint64_t value = 0;
    for (const char *digit = digits; *digit; digit++) {
        if (*digit < '0' || *digit > '9') return BD_NONE;
        value = value * 10 + (uint64_t)(*digit - '0');
        if (value >= count) return BD_NONE;
    }
    return (int32_t)value;
}

int32_t bd_scene_find_camera(const struct bd_scene *scene, const char *name)
{
    if (!name[0]) return scene->placed_camera_count ? 0 : BD_NONE;
    for (uint32_t i = 0; i < scene->placed_camera_count; i++) {
        const struct bd_placement *placed = &scene->placed_cameras[i];
        if (placed->node != BD_NONE && strcmp(scene->nodes[placed->node].name, name) == 0)
            return (int32_t)i;
    }
    for (uint32_t i = 0; i < scene->placed_camera_count; i++)
        if (strcmp(scene->cameras[scene->placed_cameras[i].object].name, name) == 0)
            return (int32_t)i;
    return index_of(name, scene->placed_camera_count);
}
