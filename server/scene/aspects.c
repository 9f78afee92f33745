// Which aspects of a snapshot are what they were in another: decided by what is derived, not by
// what an edit named. A lamp's node that moves leaves the transforms alone, a material that nothing
// shows changes nothing.

#include <stdlib.h>
#include <string.h>

#include "scene/derive.h"
#include "scene/flat_io.h"

static bool same_streams(const struct bd_mesh *a, const struct bd_mesh *b)
{
    return a == b || (a->content_hash == b->content_hash &&
                      memcmp(a->sha256, b->sha256, sizeof a->sha256) == 0);
}

static bool same_pictures(const struct bd_scene *a, const struct bd_scene *b, int32_t picture_a,
                          int32_t picture_b)
{
    if (picture_a == BD_NONE || picture_b == BD_NONE) return picture_a == picture_b;
    const struct bd_picture *left = a->pictures[picture_a], *right = b->pictures[picture_b];
    return left == right || (left->content_hash == right->content_hash &&
                             memcmp(left->sha256, right->sha256, sizeof left->sha256) == 0);
}

static bool same_map(const struct bd_scene *a, const struct bd_scene *b,
                     const struct bd_texture_ref *of_a, const struct bd_texture_ref *of_b)
{
    if (of_a->texture == BD_NONE || of_b->texture == BD_NONE) return of_a->texture == of_b->texture;
    const struct bd_texture *left = &a->textures[of_a->texture];
    const struct bd_texture *right = &b->textures[of_b->texture];
    return of_a->uv_set == of_b->uv_set &&
           memcmp(of_a->uv_transform, of_b->uv_transform, sizeof of_a->uv_transform) == 0 &&
           left->wrap_s == right->wrap_s && left->wrap_t == right->wrap_t &&
           left->nearest == right->nearest && same_pictures(a, b, left->picture, right->picture);
}

struct flat_material {
    size_t size;
    uint8_t bytes[512];
};

static bool keep_bytes(void *user, const void *bytes, size_t size)
{
    struct flat_material *to = user;
    if (size > sizeof to->bytes - to->size) return false;
    memcpy(to->bytes + to->size, bytes, size);
    to->size += size;
    return true;
}

// The flat form knows every number of a material, and no padding. Names and maps do not count.
static bool flatten(const struct bd_material *material, struct flat_material *out)
{
    struct bd_material copy = *material;
    const struct bd_scene_counts none = {0};
    struct bd_flat_io io;
    memset(copy.name, 0, sizeof copy.name);
    copy.base_color_map = copy.metallic_roughness_map = copy.normal_map = copy.emissive_map =
        copy.transmission_map = (struct bd_texture_ref){.texture = BD_NONE};
    out->size = 0;
    bd_flat_io_write_to(&io, keep_bytes, out);
    bd_flat_material(&io, &copy, &none);
    return bd_flat_io_flush(&io);
}

static bool same_material(const struct bd_scene *a, const struct bd_scene *b, int32_t of_a,
                          int32_t of_b)
{
    const struct bd_material *left = &a->materials[of_a], *right = &b->materials[of_b];
    struct flat_material flat[2];
    if (!flatten(left, &flat[0]) || !flatten(right, &flat[1])) return false;
    return flat[0].size == flat[1].size &&
           memcmp(flat[0].bytes, flat[1].bytes, flat[0].size) == 0 &&
           same_map(a, b, &left->base_color_map, &right->base_color_map) &&
           same_map(a, b, &left->metallic_roughness_map, &right->metallic_roughness_map) &&
           same_map(a, b, &left->normal_map, &right->normal_map) &&
           same_map(a, b, &left->emissive_map, &right->emissive_map) &&
           same_map(a, b, &left->transmission_map, &right->transmission_map);
}

static bool same_geometry(const struct bd_scene *a, const struct bd_scene *b)
{
    if (a->instance_count != b->instance_count) return false;
    for (uint32_t i = 0; i < a->instance_count; i++)
        if (!same_streams(a->meshes[a->instances[i].mesh], b->meshes[b->instances[i].mesh]))
            return false;
    return true;
}

static bool same_transforms(const struct bd_scene *a, const struct bd_scene *b)
{
    if (a->instance_count != b->instance_count) return false;
    for (uint32_t i = 0; i < a->instance_count; i++)
        if (memcmp(&a->instances[i].world_from_mesh, &b->instances[i].world_from_mesh,
                   sizeof(bd_dmat4)) != 0)
            return false;
    return true;
}

// Of two meshes of the same streams. `known[m]` remembers that material m is the same in both.
static bool same_mesh_materials(const struct bd_scene *a, const struct bd_scene *b,
                                const struct bd_mesh *of_a, const struct bd_mesh *of_b, bool *known)
{
    for (uint32_t p = 0; p < of_a->primitive_count; p++) {
        int32_t left = of_a->primitives[p].material, right = of_b->primitives[p].material;
        if (of_a->primitives[p].index_count == 0 || (left == right && known[left])) continue;
        if (!same_material(a, b, left, right)) return false;
        if (left == right) known[left] = true;
    }
    return true;
}

// Only where the geometry is the same; where it is not, all is drawn anew anyway, and materials are
// compared as lists.
static bool same_materials(const struct bd_scene *a, const struct bd_scene *b, bool geometry)
{
    bool *known = calloc(a->material_count + (size_t)1, sizeof *known);
    bool same = known != NULL;
    if (geometry)
        for (uint32_t i = 0; same && i < a->instance_count; i++)
            same = same_mesh_materials(a, b, a->meshes[a->instances[i].mesh],
                                       b->meshes[b->instances[i].mesh], known);
    else
        same = same && a->material_count == b->material_count;
    for (uint32_t m = 0; same && !geometry && m < a->material_count; m++)
        same = same_material(a, b, (int32_t)m, (int32_t)m);
    free(known);
    return same;
}

static bool same_placement(const struct bd_placement *a, const struct bd_placement *b)
{
    const bd_dvec3 left[] = {a->position, a->axis_x, a->axis_y, a->axis_z};
    const bd_dvec3 right[] = {b->position, b->axis_x, b->axis_y, b->axis_z};
    return memcmp(left, right, sizeof left) == 0;
}

static bool same_light(const struct bd_light *a, const struct bd_light *b)
{
    return a->kind == b->kind && memcmp(a->color, b->color, sizeof a->color) == 0 &&
           a->intensity == b->intensity && a->range_m == b->range_m &&
           a->cone_inner == b->cone_inner && a->cone_outer == b->cone_outer;
}

static bool same_lights(const struct bd_scene *a, const struct bd_scene *b)
{
    if (a->placed_light_count != b->placed_light_count) return false;
    for (uint32_t i = 0; i < a->placed_light_count; i++) {
        const struct bd_placement *left = &a->placed_lights[i], *right = &b->placed_lights[i];
        if (!same_placement(left, right) ||
            !same_light(&a->lights[left->object], &b->lights[right->object]))
            return false;
    }
    return true;
}

static bool same_camera(const struct bd_camera *a, const struct bd_camera *b)
{
    return a->orthographic == b->orthographic && a->yfov == b->yfov && a->xmag == b->xmag &&
           a->ymag == b->ymag && a->near_m == b->near_m && a->far_m == b->far_m;
}

static bool same_cameras(const struct bd_scene *a, const struct bd_scene *b)
{
    if (a->placed_camera_count != b->placed_camera_count) return false;
    for (uint32_t i = 0; i < a->placed_camera_count; i++) {
        const struct bd_placement *left = &a->placed_cameras[i], *right = &b->placed_cameras[i];
        if (!same_placement(left, right) ||
            !same_camera(&a->cameras[left->object], &b->cameras[right->object]))
            return false;
    }
    return true;
}

static bool same_environment(const struct bd_environment *a, const struct bd_environment *b)
{
    if (memcmp(a->radiance, b->radiance, sizeof a->radiance) != 0) return false;
    if (a->map == b->map) return true;
    return a->map && b->map && memcmp(a->map->sha256, b->map->sha256, sizeof a->map->sha256) == 0;
}

struct bd_same bd_same_surfaces(const struct bd_scene *base, const struct bd_scene *scene)
{
    struct bd_same same = {0};
    same.geometry = same_geometry(base, scene);
    same.transforms = same_transforms(base, scene);
    same.materials = same_materials(base, scene, same.geometry);
    same.environment = same_environment(&base->environment, &scene->environment);
    return same;
}

static uint64_t carried(bool same, uint64_t counter)
{
    return same ? counter : bd_derive_next_aspect();
}

void bd_derive_aspects(struct bd_scene *scene, const struct bd_scene *base,
                       const struct bd_same *same)
{
    const struct bd_aspects none = {0}, *from = base ? &base->aspects : &none;
    scene->aspects = (struct bd_aspects){
        .geometry = carried(same->geometry, from->geometry),
        .transforms = carried(same->transforms, from->transforms),
        .materials = carried(same->materials, from->materials),
        .lights = carried(base && same_lights(base, scene), from->lights),
        .environment = carried(same->environment, from->environment),
        .cameras = carried(base && same_cameras(base, scene), from->cameras),
    };
}
