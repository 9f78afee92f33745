// Which aspects of a snapshot are what they were in another: decided by what is derived, not by
// what an edit named. A punctual light's node that moves leaves the transforms alone, a material
// that nothing shows changes nothing.

#include <stdlib.h>
#include <string.h>

#include "scene/model/derive.h"
#include "scene/model/object_fields.h"

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

// --- materials ------------------------------------------------------------------------------

static bool same_alpha(const struct bd_scene *a, const struct bd_scene *b,
                       const struct bd_material *left, const struct bd_material *right)
{
    if (left->alpha_mode != right->alpha_mode) return false;
    return left->alpha_mode == BD_ALPHA_OPAQUE ||
           (left->alpha_cutoff == right->alpha_cutoff &&
            left->base_color[3] == right->base_color[3] &&
            same_map(a, b, &left->base_color_map, &right->base_color_map));
}

// The last of four numbers is alpha, which has the rule above.
static bool same_field(const struct bd_scene *a, const struct bd_scene *b,
                       const struct bd_object_field *row, const struct bd_material *left,
                       const struct bd_material *right)
{
    const void *of_left = bd_field_of(row, left), *of_right = bd_field_of(row, right);
    if (row->type == BD_FIELD_MAP) return same_map(a, b, of_left, of_right);
    const size_t bytes = row->count == 4 ? 3 * sizeof(float) : bd_field_bytes(row);
    return memcmp(of_left, of_right, bytes) == 0;
}

static uint32_t material_changes(const struct bd_scene *a, const struct bd_scene *b, int32_t of_a,
                                 int32_t of_b)
{
    const struct bd_material *left = &a->materials[of_a], *right = &b->materials[of_b];
    uint32_t changes = same_alpha(a, b, left, right) ? 0 : BD_ASPECT_BIT(ALPHA);
    const struct bd_object_field_list list = bd_object_fields(BD_OBJECT_MATERIAL);
    for (uint32_t i = 0; i < list.count; i++)
        if (list.rows[i].aspects && !same_field(a, b, &list.rows[i], left, right))
            changes |= list.rows[i].aspects;
    return changes;
}

// Of two meshes of the same streams. `known[m]` remembers that material m was compared with itself.
static uint32_t mesh_material_changes(const struct bd_scene *a, const struct bd_scene *b,
                                      const struct bd_mesh *of_a, const struct bd_mesh *of_b,
                                      bool *known)
{
    uint32_t changes = 0;
    for (uint32_t p = 0; p < of_a->primitive_count; p++) {
        int32_t left = of_a->primitives[p].material, right = of_b->primitives[p].material;
        if (of_a->primitives[p].index_count == 0 || (left == right && known[left])) continue;
        changes |= material_changes(a, b, left, right);
        if (left == right) known[left] = true;
    }
    return changes;
}

// By what is drawn where the geometry is the same; where it is not, all is drawn anew anyway, and
// materials are compared as lists.
static uint32_t materials_changes(const struct bd_scene *a, const struct bd_scene *b, bool geometry)
{
    uint32_t changes = 0;
    if (!geometry && a->material_count != b->material_count) return BD_ASPECTS_MATERIALS;
    if (!geometry) {
        for (uint32_t m = 0; m < a->material_count; m++)
            changes |= material_changes(a, b, (int32_t)m, (int32_t)m);
        return changes;
    }
    bool *known = calloc(a->material_count + (size_t)1, sizeof *known);
    if (!known) return BD_ASPECTS_MATERIALS;
    for (uint32_t i = 0; i < a->instance_count; i++)
        changes |= mesh_material_changes(a, b, a->meshes[a->instances[i].mesh],
                                         b->meshes[b->instances[i].mesh], known);
    free(known);
    return changes;
}

// --- the rest -------------------------------------------------------------------------------

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

static bool same_placement(const struct bd_placement *a, const struct bd_placement *b)
{
    const bd_dvec3 left[] = {a->position, a->axis_x, a->axis_y, a->axis_z};
    const bd_dvec3 right[] = {b->position, b->axis_x, b->axis_y, b->axis_z};
    return memcmp(left, right, sizeof left) == 0;
}

// In all that has an aspect: a name has none.
static bool same_shown(enum bd_object_kind kind, const void *a, const void *b)
{
    const struct bd_object_field_list list = bd_object_fields(kind);
    for (uint32_t i = 0; i < list.count; i++) {
        const struct bd_object_field *row = &list.rows[i];
        if (row->aspects &&
            memcmp(bd_field_of(row, a), bd_field_of(row, b), bd_field_bytes(row)) != 0)
            return false;
    }
    return true;
}

static bool same_lights(const struct bd_scene *a, const struct bd_scene *b)
{
    if (a->placed_light_count != b->placed_light_count) return false;
    for (uint32_t i = 0; i < a->placed_light_count; i++) {
        const struct bd_placement *left = &a->placed_lights[i], *right = &b->placed_lights[i];
        if (!same_placement(left, right) ||
            !same_shown(BD_OBJECT_LIGHT, &a->lights[left->object], &b->lights[right->object]))
            return false;
    }
    return true;
}

static bool same_cameras(const struct bd_scene *a, const struct bd_scene *b)
{
    if (a->placed_camera_count != b->placed_camera_count) return false;
    for (uint32_t i = 0; i < a->placed_camera_count; i++) {
        const struct bd_placement *left = &a->placed_cameras[i], *right = &b->placed_cameras[i];
        if (!same_placement(left, right) ||
            !same_shown(BD_OBJECT_CAMERA, &a->cameras[left->object], &b->cameras[right->object]))
            return false;
    }
    return true;
}

static bool same_environment(const struct bd_environment *a, const struct bd_environment *b)
{
    if (memcmp(a->radiance, b->radiance, sizeof a->radiance) != 0) return false;
    if (memcmp(a->rotation, b->rotation, sizeof a->rotation) != 0) return false;
    if (a->map == b->map) return true;
    return a->map && b->map && memcmp(a->map->sha256, b->map->sha256, sizeof a->map->sha256) == 0;
}

uint32_t bd_same_surfaces(const struct bd_scene *base, const struct bd_scene *scene)
{
    const bool geometry = same_geometry(base, scene);
    uint32_t same = BD_ASPECTS_MATERIALS & ~materials_changes(base, scene, geometry);
    if (geometry) same |= BD_ASPECT_BIT(GEOMETRY);
    if (same_transforms(base, scene)) same |= BD_ASPECT_BIT(TRANSFORMS);
    if (same_environment(&base->environment, &scene->environment))
        same |= BD_ASPECT_BIT(ENVIRONMENT);
    return same;
}

void bd_derive_aspects(struct bd_scene *scene, const struct bd_scene *base, uint32_t same)
{
    if (base && same_lights(base, scene)) same |= BD_ASPECT_BIT(LIGHTS);
    if (base && same_cameras(base, scene)) same |= BD_ASPECT_BIT(CAMERAS);
    for (uint32_t i = 0; i < BD_ASPECT_COUNT; i++)
        scene->aspects.counter[i] =
            same >> i & 1 ? base->aspects.counter[i] : bd_derive_next_aspect();
}
