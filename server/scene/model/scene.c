#include "scene/model/scene.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "scene/model/primitive.h"

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

void bd_mesh_release(struct bd_mesh **mesh)
{
    struct bd_mesh *dropped = *mesh;
    *mesh = NULL;
    if (!dropped || !drop(&dropped->reference_count)) return;
    for (uint32_t i = 0; !dropped->streams_of && i < dropped->primitive_count; i++)
        bd_primitive_free_streams(&dropped->primitives[i]);
    bd_mesh_release(&dropped->streams_of);
    free(dropped->primitives);
    free(dropped);
}

struct bd_mesh *bd_mesh_alias(struct bd_mesh *mesh)
{
    struct bd_mesh *alias = malloc(sizeof *alias);
    struct bd_primitive *primitives =
        malloc((mesh->primitive_count + (size_t)1) * sizeof *primitives);
    if (!alias || !primitives) {
        free(alias);
        free(primitives);
        return NULL;
    }
    memcpy(alias, mesh, sizeof *alias);
    if (mesh->primitive_count)
        memcpy(primitives, mesh->primitives, mesh->primitive_count * sizeof *primitives);
    alias->reference_count = 1;
    alias->primitives = primitives;
    alias->streams_of = bd_mesh_retain(mesh->streams_of ? mesh->streams_of : mesh);
    return alias;
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

bool bd_scene_is_finished(const struct bd_scene *scene)
{
    return scene->instances != NULL; // allocated even where there are none
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

#define COUNT(total, count, items, is_removed_at)                                                  \
    for (uint32_t i = 0; i < (count); i++) (total) += !(items)[i] is_removed_at

struct bd_scene_counts bd_scene_count(const struct bd_scene *s)
{
    struct bd_scene_counts n = {0};
    bool finished = bd_scene_is_finished(s);
    COUNT(n.nodes, s->node_count, s->nodes, .is_removed);
    COUNT(n.meshes, s->mesh_count, s->meshes, ->is_removed);
    COUNT(n.materials, s->material_count, s->materials, .is_removed);
    COUNT(n.textures, s->texture_count, s->textures, .is_removed);
    COUNT(n.pictures, s->picture_count, s->pictures, ->is_removed);
    COUNT(n.lights, finished ? s->authored_light_count : s->light_count, s->lights, .is_removed);
    COUNT(n.cameras, finished ? s->authored_camera_count : s->camera_count, s->cameras,
          .is_removed);
    return n;
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

static bool node_is_called(const struct bd_scene *scene, uint32_t camera, const char *name)
{
    int32_t node = scene->placed_cameras[camera].node;
    return node != BD_NONE && strcmp(scene->nodes[node].name, name) == 0;
}

static bool camera_is_called(const struct bd_scene *scene, uint32_t camera, const char *name)
{
    return strcmp(scene->cameras[scene->placed_cameras[camera].object].name, name) == 0;
}

typedef bool is_called_fn(const struct bd_scene *scene, uint32_t camera, const char *name);

static uint32_t count_called(const struct bd_scene *scene, is_called_fn *is_called,
                             const char *name, int32_t *first)
{
    uint32_t count = 0;
    for (uint32_t i = scene->placed_camera_count; i-- > 0;) {
        if (!is_called(scene, i, name)) continue;
        *first = (int32_t)i;
        count++;
    }
    return count;
}

int32_t bd_scene_find_camera(const struct bd_scene *scene, const char *name)
{
    int32_t first;
    if (!name[0]) return scene->placed_camera_count ? 0 : BD_NONE;
    if (bd_scene_count_cameras(scene, name, &first) > 0) return first;
    return index_of(name, scene->placed_camera_count);
}

uint32_t bd_scene_count_cameras(const struct bd_scene *scene, const char *name, int32_t *first)
{
    uint32_t count = count_called(scene, node_is_called, name, first);
    return count > 0 ? count : count_called(scene, camera_is_called, name, first);
}
