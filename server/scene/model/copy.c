// Copies of a scene that share its meshes and pictures.

#include <stdlib.h>
#include <string.h>

#include "scene/model/derive.h"

static uint32_t larger(uint32_t a, uint32_t b)
{
    return a > b ? a : b;
}

// `*out` holds the base's `count` items, and room for `total`; the rest is zero.
static bool copy_items(const void *items, uint32_t count, uint32_t total, size_t item_bytes,
                       void **out)
{
    *out = calloc(total + (size_t)1, item_bytes);
    if (*out && count) memcpy(*out, items, count * item_bytes);
    return *out != NULL;
}

const struct bd_texture bd_texture_removed = {.picture = BD_NONE, .is_removed = true};
const struct bd_light bd_light_removed = {.is_removed = true};
const struct bd_camera bd_camera_removed = {.is_removed = true};
const struct bd_node bd_node_removed = {
    .parent = BD_NONE, .mesh = BD_NONE, .camera = BD_NONE, .light = BD_NONE, .is_removed = true};
const struct bd_material bd_material_removed = {
    .base_color_map.texture = BD_NONE,
    .metallic_roughness_map.texture = BD_NONE,
    .normal_map.texture = BD_NONE,
    .emissive_map.texture = BD_NONE,
    .transmission_map.texture = BD_NONE,
    .is_removed = true,
};

struct bd_mesh *bd_mesh_create_removed(void)
{
    struct bd_mesh *mesh = calloc(1, sizeof *mesh);
    if (!mesh) return NULL;
    mesh->reference_count = 1;
    mesh->is_removed = true;
    bd_mesh_seal(mesh);
    return mesh;
}

struct bd_picture *bd_picture_create_removed(void)
{
    struct bd_picture *picture = calloc(1, sizeof *picture);
    if (!picture) return NULL;
    picture->reference_count = 1;
    picture->is_removed = true;
    bd_picture_seal(picture);
    return picture;
}

// Counted one by one, so that a scene without memory for the rest can be released.
static bool share_meshes(struct bd_scene *to, const struct bd_scene *base, uint32_t total)
{
    to->meshes = calloc(total + (size_t)1, sizeof(struct bd_mesh *));
    if (!to->meshes) return false;
    for (; to->mesh_count < total; to->mesh_count++) {
        uint32_t i = to->mesh_count;
        to->meshes[i] =
            i < base->mesh_count ? bd_mesh_retain(base->meshes[i]) : bd_mesh_create_removed();
        if (!to->meshes[i]) return false;
    }
    return true;
}

static bool share_pictures(struct bd_scene *to, const struct bd_scene *base, uint32_t total)
{
    to->pictures = calloc(total + (size_t)1, sizeof(struct bd_picture *));
    if (!to->pictures) return false;
    for (; to->picture_count < total; to->picture_count++) {
        uint32_t i = to->picture_count;
        to->pictures[i] = i < base->picture_count ? bd_picture_retain(base->pictures[i])
                                                  : bd_picture_create_removed();
        if (!to->pictures[i]) return false;
    }
    return true;
}

static void fill_removed(struct bd_scene *to, const struct bd_scene_counts *from)
{
    for (uint32_t i = from->textures; i < to->texture_count; i++)
        to->textures[i] = bd_texture_removed;
    for (uint32_t i = from->materials; i < to->material_count; i++)
        to->materials[i] = bd_material_removed;
    for (uint32_t i = from->lights; i < to->light_count; i++) to->lights[i] = bd_light_removed;
    for (uint32_t i = from->cameras; i < to->camera_count; i++) to->cameras[i] = bd_camera_removed;
    for (uint32_t i = from->nodes; i < to->node_count; i++) to->nodes[i] = bd_node_removed;
}

static void copy_flags(struct bd_scene *to, const struct bd_scene *base)
{
    to->flags.count = base->authored_flag_count;
    memcpy(to->flags.text, base->flags.text,
           base->authored_flag_count * sizeof base->flags.text[0]);
}

struct bd_scene_counts bd_scene_slots(const struct bd_scene *scene)
{
    bool finished = bd_scene_is_finished(scene);
    return (struct bd_scene_counts){
        .nodes = scene->node_count,
        .meshes = scene->mesh_count,
        .materials = scene->material_count,
        .textures = scene->texture_count,
        .pictures = scene->picture_count,
        .lights = finished ? scene->authored_light_count : scene->light_count,
        .cameras = finished ? scene->authored_camera_count : scene->camera_count,
    };
}

struct bd_scene *bd_scene_copy(const struct bd_scene *base, const struct bd_scene_counts *slots)
{
    const struct bd_scene_counts n = bd_scene_slots(base);
    struct bd_scene *to = bd_scene_create();
    to->environment = base->environment;
    if (to->environment.map) bd_sky_map_retain(to->environment.map);
    to->texture_count = larger(n.textures, slots->textures);
    to->material_count = larger(n.materials, slots->materials);
    to->light_count = larger(n.lights, slots->lights);
    to->camera_count = larger(n.cameras, slots->cameras);
    to->node_count = larger(n.nodes, slots->nodes);
    bool ok =
        copy_items(base->textures, n.textures, to->texture_count, sizeof *to->textures,
                   (void **)&to->textures) &&
        copy_items(base->materials, n.materials, to->material_count, sizeof *to->materials,
                   (void **)&to->materials) &&
        copy_items(base->lights, n.lights, to->light_count, sizeof *to->lights,
                   (void **)&to->lights) &&
        copy_items(base->cameras, n.cameras, to->camera_count, sizeof *to->cameras,
                   (void **)&to->cameras) &&
        copy_items(base->nodes, n.nodes, to->node_count, sizeof *to->nodes, (void **)&to->nodes) &&
        share_meshes(to, base, larger(n.meshes, slots->meshes)) &&
        share_pictures(to, base, larger(n.pictures, slots->pictures));
    if (!ok) {
        bd_scene_release(&to);
        return NULL;
    }
    fill_removed(to, &n);
    copy_flags(to, base);
    return to;
}
