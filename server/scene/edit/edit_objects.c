// Materials, textures, lights, cameras and the environment: what their rows do not say.

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "scene/edit/edit_parts.h"
#include "scene/model/derive.h"

// The object that an operation adds or changes; NULL after an error.
static void *begin(struct bd_edit *edit, const struct bd_edit_op *op, enum bd_edit_kind adding,
                   enum bd_object_kind kind, void *objects, size_t bytes)
{
    const bool adds = op->kind == adding;
    const int32_t id = adds ? (int32_t)bd_edit_next(edit, kind) : bd_edit_target(edit, kind);
    if (id == BD_NONE) return NULL;
    void *object = (char *)objects + (size_t)id * bytes;
    if (adds) memset(object, 0, bytes);
    if (adds) bd_object_set_standards(kind, object);
    if (adds) edit->ids[edit->op] = id;
    return object;
}

// --- materials ------------------------------------------------------------------------------

void bd_edit_material(struct bd_edit *edit, const struct bd_edit_op *op)
{
    struct bd_material *materials = edit->draft->materials;
    struct bd_material *material =
        begin(edit, op, BD_EDIT_ADD_MATERIAL, BD_OBJECT_MATERIAL, materials, sizeof *materials);
    if (material) bd_edit_fields(edit, op, BD_OBJECT_MATERIAL, NULL, material);
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
    struct bd_material white = {0};
    bd_object_set_standards(BD_OBJECT_MATERIAL, &white);
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
static void set_picture(struct bd_edit *edit, struct bd_texture *texture,
                        struct bd_picture *picture)
{
    uint32_t *users = bd_edit_picture_users(edit);
    int32_t *slot = &texture->picture;
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
    struct bd_texture *textures = edit->draft->textures;
    const bool adds = op->kind == BD_EDIT_ADD_TEXTURE;
    if (adds && !op->picture) {
        bd_edit_fail(edit, BD_ERR_USAGE, "blob", "a texture needs a picture");
        return;
    }
    struct bd_texture *texture =
        begin(edit, op, BD_EDIT_ADD_TEXTURE, BD_OBJECT_TEXTURE, textures, sizeof *textures);
    if (!texture) return;
    if (adds) texture->picture = BD_NONE;
    if (op->picture) set_picture(edit, texture, op->picture);
    bd_edit_fields(edit, op, BD_OBJECT_TEXTURE, NULL, texture);
}

// --- lights ---------------------------------------------------------------------------------

// A spot's inner angle lies this far below its outer one, or the light's edge would be divided by
// 0.
static const double cone_gap = 1e-5;

static void check_cone(struct bd_edit *edit, bool inner_is_given, const struct bd_light *light)
{
    const double inner = (double)light->cone_inner, outer = (double)light->cone_outer;
    if (light->cone_inner > (float)(outer - cone_gap))
        bd_edit_fail(edit, BD_ERR_USAGE, inner_is_given ? "cone_inner" : "cone_outer",
                     "cone_inner %.7g is not in [0, cone_outer[, cone_outer being %.7g", inner,
                     outer);
}

void bd_edit_light(struct bd_edit *edit, const struct bd_edit_op *op)
{
    struct bd_light *lights = edit->draft->lights;
    struct bd_light *light =
        begin(edit, op, BD_EDIT_ADD_LIGHT, BD_OBJECT_LIGHT, lights, sizeof *lights);
    if (!light) return;
    const bool was_spot = light->kind == BD_LIGHT_SPOT;
    const bool inner = bd_edit_given(op, "cone_inner"), outer = bd_edit_given(op, "cone_outer");
    const struct bd_object_field *cone_outer = bd_object_field(BD_OBJECT_LIGHT, "cone_outer");
    if (!was_spot) light->cone_inner = 0, light->cone_outer = (float)cone_outer->standard;
    bd_edit_fields(edit, op, BD_OBJECT_LIGHT, NULL, light);
    if (light->kind != BD_LIGHT_SPOT) light->cone_inner = light->cone_outer = 0;
    if (light->kind == BD_LIGHT_SPOT && (inner || outer)) check_cone(edit, inner, light);
}

// --- cameras --------------------------------------------------------------------------------

static void need(struct bd_edit *edit, const char *field, float value)
{
    if (!(value > 0)) bd_edit_fail(edit, BD_ERR_USAGE, field, "is needed, > 0");
}

void bd_edit_camera(struct bd_edit *edit, const struct bd_edit_op *op)
{
    struct bd_camera *cameras = edit->draft->cameras;
    struct bd_camera *camera =
        begin(edit, op, BD_EDIT_ADD_CAMERA, BD_OBJECT_CAMERA, cameras, sizeof *cameras);
    if (!camera) return;
    bd_edit_fields(edit, op, BD_OBJECT_CAMERA, NULL, camera);
    if (camera->orthographic) need(edit, "xmag", camera->xmag);
    if (camera->orthographic) need(edit, "ymag", camera->ymag);
    if (!camera->orthographic) need(edit, "yfov", camera->yfov);
    if (!camera->orthographic) need(edit, "near", camera->near_m);
    if (!(camera->far_m > camera->near_m))
        bd_edit_fail(edit, BD_ERR_USAGE, bd_edit_given(op, "far") ? "far" : "near",
                     "far %.9g is not beyond near %.9g", (double)camera->far_m,
                     (double)camera->near_m);
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
    bd_edit_numbers(edit, bd_object_field(BD_OBJECT_ENVIRONMENT, "radiance"), in->radiance, 3,
                    environment->radiance);
    if (in->map) bd_sky_map_retain(in->map);
    bd_sky_map_release(&environment->map);
    environment->map = in->map;
}
