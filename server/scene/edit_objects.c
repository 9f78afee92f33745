// Materials, textures, lights, cameras and the environment. Ranges are the importer's.

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "scene/derive.h"
#include "scene/edit_parts.h"

// --- materials ------------------------------------------------------------------------------

// What glTF says where a file says nothing.
static const struct bd_texture_ref no_map = {BD_NONE, 0, {1, 0, 0, 0, 1, 0}};

static struct bd_material default_material(void)
{
    return (struct bd_material){
        .base_color = {1, 1, 1, 1},
        .metallic = 1,
        .roughness = 1,
        .normal_scale = 1,
        .ior = 1.5f,
        .attenuation_distance_m = INFINITY,
        .attenuation_color = {1, 1, 1},
        .alpha_cutoff = 0.5f,
        .base_color_map = no_map,
        .metallic_roughness_map = no_map,
        .normal_map = no_map,
        .emissive_map = no_map,
        .transmission_map = no_map,
    };
}

static void set_surface(struct bd_edit *edit, const struct bd_material_edit *in,
                        struct bd_material *m)
{
    if (in->given & BD_GIVEN_BASE_COLOR)
        bd_edit_numbers(edit, "base_color", in->base_color, 4, 0, 1, m->base_color);
    if (in->given & BD_GIVEN_METALLIC)
        bd_edit_number(edit, "metallic", in->metallic, 0, 1, &m->metallic);
    if (in->given & BD_GIVEN_ROUGHNESS)
        bd_edit_number(edit, "roughness", in->roughness, 0, 1, &m->roughness);
    if (in->given & BD_GIVEN_EMISSIVE)
        bd_edit_numbers(edit, "emissive", in->emissive, 3, 0, 1e30, m->emissive);
    if (in->given & BD_GIVEN_NORMAL_SCALE)
        bd_edit_number(edit, "normal_scale", in->normal_scale, -1e6, 1e6, &m->normal_scale);
    if (in->given & BD_GIVEN_ALPHA_MODE) m->alpha_mode = in->alpha_mode;
    if (in->given & BD_GIVEN_ALPHA_CUTOFF)
        bd_edit_number(edit, "alpha_cutoff", in->alpha_cutoff, 0, 1e6, &m->alpha_cutoff);
    if (in->given & BD_GIVEN_DOUBLE_SIDED) m->double_sided = in->double_sided;
    if (in->given & BD_GIVEN_UNLIT) m->unlit = in->unlit;
}

// 0 is "behaves like a mirror"; between 0 and 1 means nothing.
static void set_volume(struct bd_edit *edit, const struct bd_material_edit *in,
                       struct bd_material *m)
{
    if (in->given & BD_GIVEN_IOR && in->ior == 0) m->ior = 0;
    if (in->given & BD_GIVEN_IOR && in->ior != 0)
        bd_edit_number(edit, "ior", in->ior, 1, 1e6, &m->ior);
    if (in->given & BD_GIVEN_TRANSMISSION)
        bd_edit_number(edit, "transmission", in->transmission, 0, 1, &m->transmission);
    if (in->given & BD_GIVEN_THICKNESS)
        bd_edit_number(edit, "thickness", in->thickness, 0, BD_COORDINATE_MAX_M, &m->thickness_m);
    if (in->given & BD_GIVEN_ATTENUATION_DISTANCE) {
        bd_edit_number(edit, "attenuation_distance", in->attenuation_distance, 0, FLT_MAX,
                       &m->attenuation_distance_m);
        if (m->attenuation_distance_m == 0) m->attenuation_distance_m = INFINITY;
    }
    if (in->given & BD_GIVEN_ATTENUATION_COLOR)
        bd_edit_numbers(edit, "attenuation_color", in->attenuation_color, 3, 0, 1,
                        m->attenuation_color);
}

static void set_maps(struct bd_edit *edit, const struct bd_material_edit *in, struct bd_material *m)
{
    const struct {
        const char *field;
        struct bd_texture_ref *ref;
    } maps[BD_MAP_COUNT] = {
        [BD_MAP_BASE_COLOR] = {"base_color_texture", &m->base_color_map},
        [BD_MAP_METALLIC_ROUGHNESS] = {"metallic_roughness_texture", &m->metallic_roughness_map},
        [BD_MAP_NORMAL] = {"normal_texture", &m->normal_map},
        [BD_MAP_EMISSIVE] = {"emissive_texture", &m->emissive_map},
        [BD_MAP_TRANSMISSION] = {"transmission_texture", &m->transmission_map},
    };
    for (int i = 0; i < BD_MAP_COUNT; i++) {
        if (!(in->given & (uint32_t)BD_GIVEN_MAP << i)) continue;
        int32_t id = bd_edit_reference(edit, maps[i].field, BD_OBJECT_TEXTURE, in->textures[i]);
        if (maps[i].ref->texture == BD_NONE || id == BD_NONE) *maps[i].ref = no_map;
        maps[i].ref->texture = id;
    }
}

void bd_edit_material(struct bd_edit *edit, const struct bd_edit_op *op)
{
    bool adds = op->kind == BD_EDIT_ADD_MATERIAL;
    int32_t id = adds ? (int32_t)bd_edit_next(edit, BD_OBJECT_MATERIAL)
                      : bd_edit_target(edit, BD_OBJECT_MATERIAL);
    if (id == BD_NONE) return;
    struct bd_material *material = &edit->draft->materials[id];
    if (adds) *material = default_material();
    if (op->material.given & BD_GIVEN_MATERIAL_NAME)
        bd_edit_name(edit, op->material.name, material->name);
    set_surface(edit, &op->material, material);
    set_volume(edit, &op->material, material);
    set_maps(edit, &op->material, material);
    if (adds) edit->ids[edit->op] = id;
}

static const char white_name[] = "default";

static bool is_white(const struct bd_material *m)
{
    return strcmp(m->name, white_name) == 0 && m->metallic == 0 && m->roughness == 1 &&
           m->base_color[0] == 1 && m->base_color[1] == 1 && m->base_color[2] == 1 &&
           m->base_color[3] == 1 && m->base_color_map.texture == BD_NONE && m->transmission == 0 &&
           !m->unlit && m->emissive[0] + m->emissive[1] + m->emissive[2] == 0;
}

static int32_t find_white(const struct bd_edit *edit)
{
    for (uint32_t i = 0; i < edit->next.materials; i++)
        if (is_white(&edit->draft->materials[i])) return (int32_t)i;
    return BD_NONE;
}

// Found again by its name and its being white; looked for once a batch, whatever becomes of it in
// there.
int32_t bd_edit_white_material(struct bd_edit *edit)
{
    if (edit->white == BD_NONE) edit->white = find_white(edit);
    if (edit->white != BD_NONE && is_white(&edit->draft->materials[edit->white]))
        return edit->white;
    struct bd_material white = default_material();
    memcpy(white.name, white_name, sizeof white_name);
    white.metallic = 0;
    edit->white = (int32_t)bd_edit_next(edit, BD_OBJECT_MATERIAL);
    edit->draft->materials[edit->white] = white;
    return edit->white;
}

// --- textures -------------------------------------------------------------------------------

uint32_t *bd_edit_picture_users(struct bd_edit *edit)
{
    const struct bd_scene *draft = edit->draft;
    if (edit->picture_users) return edit->picture_users;
    edit->picture_users = calloc(draft->picture_count + (size_t)1, sizeof *edit->picture_users);
    if (!edit->picture_users) bd_edit_fail_memory(edit);
    for (uint32_t i = 0; edit->picture_users && i < edit->next.textures; i++)
        if (draft->textures[i].picture != BD_NONE)
            edit->picture_users[draft->textures[i].picture]++;
    return edit->picture_users;
}

// In the slot of the texture's own picture, or in a new one where others show that picture too.
static void set_picture(struct bd_edit *edit, int32_t texture, struct bd_picture *picture)
{
    uint32_t *users = bd_edit_picture_users(edit);
    int32_t *slot = &edit->draft->textures[texture].picture;
    if (!users) return;
    if (*slot == BD_NONE || users[*slot] > 1) {
        if (*slot != BD_NONE) users[*slot]--;
        *slot = (int32_t)bd_edit_next(edit, BD_OBJECT_PICTURE);
        users[*slot] = 1;
    } else {
        bd_edit_touch(edit, BD_OBJECT_PICTURE, (uint32_t)*slot);
    }
    bd_picture_release(&edit->draft->pictures[*slot]);
    edit->draft->pictures[*slot] = bd_picture_retain(picture);
}

void bd_edit_texture(struct bd_edit *edit, const struct bd_edit_op *op)
{
    const struct bd_texture_edit *in = &op->texture;
    bool adds = op->kind == BD_EDIT_ADD_TEXTURE;
    if (adds && !(in->given & BD_GIVEN_PICTURE)) {
        bd_edit_fail(edit, BD_ERR_USAGE, "blob", "a texture needs a picture");
        return;
    }
    int32_t id = adds ? (int32_t)bd_edit_next(edit, BD_OBJECT_TEXTURE)
                      : bd_edit_target(edit, BD_OBJECT_TEXTURE);
    if (id == BD_NONE) return;
    struct bd_texture *texture = &edit->draft->textures[id];
    if (adds) *texture = (struct bd_texture){.picture = BD_NONE};
    if (in->given & BD_GIVEN_PICTURE) set_picture(edit, id, in->picture);
    if (in->given & BD_GIVEN_WRAP_S) texture->wrap_s = in->wrap_s;
    if (in->given & BD_GIVEN_WRAP_T) texture->wrap_t = in->wrap_t;
    if (in->given & BD_GIVEN_NEAREST) texture->nearest = in->nearest;
    if (adds) edit->ids[edit->op] = id;
}

// --- lights ---------------------------------------------------------------------------------

static const double cone_outer_min = 1e-4, cone_outer_max = (double)1.57079637f,
                    cone_gap_min = 1e-5;

static void set_cones(struct bd_edit *edit, const struct bd_light_edit *in, bool was_spot,
                      struct bd_light *light)
{
    if (was_spot && !(in->given & (BD_GIVEN_CONE_INNER | BD_GIVEN_CONE_OUTER))) return;
    double outer = in->given & BD_GIVEN_CONE_OUTER ? in->cone_outer
                   : was_spot                      ? light->cone_outer
                                                   : 0.78539816;
    double inner = in->given & BD_GIVEN_CONE_INNER ? in->cone_inner
                   : was_spot                      ? light->cone_inner
                                                   : 0;
    bd_edit_number(edit, "cone_outer", outer, cone_outer_min, cone_outer_max, &light->cone_outer);
    if (inner > outer - cone_gap_min || !(inner >= 0))
        bd_edit_fail(
            edit, BD_ERR_USAGE, in->given & BD_GIVEN_CONE_INNER ? "cone_inner" : "cone_outer",
            "cone_inner %.9g is not in [0, cone_outer[, cone_outer being %.9g", inner, outer);
    light->cone_inner = (float)inner;
}

void bd_edit_light(struct bd_edit *edit, const struct bd_edit_op *op)
{
    const struct bd_light_edit *in = &op->light;
    bool adds = op->kind == BD_EDIT_ADD_LIGHT;
    int32_t id =
        adds ? (int32_t)bd_edit_next(edit, BD_OBJECT_LIGHT) : bd_edit_target(edit, BD_OBJECT_LIGHT);
    if (id == BD_NONE) return;
    struct bd_light *light = &edit->draft->lights[id];
    if (adds)
        *light = (struct bd_light){
            .kind = BD_LIGHT_POINT, .color = {1, 1, 1}, .intensity = 1, .range_m = INFINITY};
    bool was_spot = light->kind == BD_LIGHT_SPOT;
    if (in->given & BD_GIVEN_LIGHT_NAME) bd_edit_name(edit, in->name, light->name);
    if (in->given & BD_GIVEN_LIGHT_KIND) light->kind = in->kind;
    if (in->given & BD_GIVEN_COLOR)
        bd_edit_numbers(edit, "color", in->color, 3, 0, 1e30, light->color);
    if (in->given & BD_GIVEN_INTENSITY)
        bd_edit_number(edit, "intensity", in->intensity, 0, 1e30, &light->intensity);
    if (in->given & BD_GIVEN_RANGE)
        bd_edit_number(edit, "range", in->range, 0, BD_COORDINATE_MAX_M, &light->range_m);
    if (light->range_m == 0) light->range_m = INFINITY;
    if (light->kind == BD_LIGHT_SPOT)
        set_cones(edit, in, was_spot, light);
    else
        light->cone_inner = light->cone_outer = 0;
    if (adds) edit->ids[edit->op] = id;
}

// --- cameras --------------------------------------------------------------------------------

static void set_orthographic(struct bd_edit *edit, const struct bd_camera_edit *in,
                             struct bd_camera *camera)
{
    if (in->given & BD_GIVEN_XMAG)
        bd_edit_number(edit, "xmag", in->xmag, 1e-9, BD_COORDINATE_MAX_M, &camera->xmag);
    if (in->given & BD_GIVEN_YMAG)
        bd_edit_number(edit, "ymag", in->ymag, 1e-9, BD_COORDINATE_MAX_M, &camera->ymag);
    if (!(camera->xmag > 0)) bd_edit_fail(edit, BD_ERR_USAGE, "xmag", "is needed, > 0");
    if (!(camera->ymag > 0)) bd_edit_fail(edit, BD_ERR_USAGE, "ymag", "is needed, > 0");
}

static void set_perspective(struct bd_edit *edit, const struct bd_camera_edit *in,
                            struct bd_camera *camera)
{
    if (in->given & BD_GIVEN_YFOV)
        bd_edit_number(edit, "yfov", in->yfov, 1e-3, 3.11, &camera->yfov);
    if (!(camera->yfov > 0)) bd_edit_fail(edit, BD_ERR_USAGE, "yfov", "is needed, > 0");
}

static void set_planes(struct bd_edit *edit, const struct bd_camera_edit *in,
                       struct bd_camera *camera)
{
    if (in->given & BD_GIVEN_NEAR)
        bd_edit_number(edit, "near", in->near, 0, BD_COORDINATE_MAX_M, &camera->near_m);
    if (in->given & BD_GIVEN_FAR)
        bd_edit_number(edit, "far", in->far, 0, BD_COORDINATE_MAX_M, &camera->far_m);
    if (camera->far_m == 0) camera->far_m = INFINITY;
    if (!camera->orthographic && !(camera->near_m > 0))
        bd_edit_fail(edit, BD_ERR_USAGE, "near", "is needed, > 0");
    if (!(camera->far_m > camera->near_m))
        bd_edit_fail(edit, BD_ERR_USAGE, in->given & BD_GIVEN_FAR ? "far" : "near",
                     "far %.9g is not beyond near %.9g", (double)camera->far_m,
                     (double)camera->near_m);
}

void bd_edit_camera(struct bd_edit *edit, const struct bd_edit_op *op)
{
    const struct bd_camera_edit *in = &op->camera;
    bool adds = op->kind == BD_EDIT_ADD_CAMERA;
    int32_t id = adds ? (int32_t)bd_edit_next(edit, BD_OBJECT_CAMERA)
                      : bd_edit_target(edit, BD_OBJECT_CAMERA);
    if (id == BD_NONE) return;
    struct bd_camera *camera = &edit->draft->cameras[id];
    if (adds) *camera = (struct bd_camera){.yfov = 0.78539816f, .near_m = 0.01f, .far_m = INFINITY};
    if (in->given & BD_GIVEN_CAMERA_NAME) bd_edit_name(edit, in->name, camera->name);
    if (in->given & BD_GIVEN_ORTHOGRAPHIC) camera->orthographic = in->orthographic;
    if (camera->orthographic)
        set_orthographic(edit, in, camera);
    else
        set_perspective(edit, in, camera);
    set_planes(edit, in, camera);
    if (adds) edit->ids[edit->op] = id;
}

// --- environment ----------------------------------------------------------------------------

void bd_edit_environment(struct bd_edit *edit, const struct bd_edit_op *op)
{
    const struct bd_environment_edit *in = &op->environment;
    struct bd_environment *environment = &edit->draft->environment;
    const double *r = in->rotation;
    memset(environment->rotation, 0, sizeof environment->rotation);
    if (r[0] != 0 || r[1] != 0 || r[2] != 0 || r[3] != 0) bd_environment_turn(environment, r);
    bd_edit_touch(edit, BD_OBJECT_ENVIRONMENT, 0);
    if (in->keeps_light) return;
    bd_edit_numbers(edit, "radiance", in->radiance, 3, 0, 1e30, environment->radiance);
    if (in->map) bd_sky_map_retain(in->map);
    bd_sky_map_release(&environment->map);
    environment->map = in->map;
}
