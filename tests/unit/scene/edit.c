// Operations: what each does, and what each refuses, by the path of the field.

#include <math.h>

#include "scene/edit/edit.h"
#include "tests/unit/scene/fields.h"
#include "tests/unit/scene/snapshots.h"

static const char *own_scenes;

struct world {
    struct bd_scene *scene;
    int32_t ids[16]; // of the last batch
};

static struct world begin(const char *name)
{
    struct world world = {load(own_scenes, name), {0}};
    assert_non_null(world.scene);
    return world;
}

// Carries out a batch, and holds the result to what finishing from nothing would give, and its
// inverse to the scene before.
static void edit_all(struct world *world, const struct bd_edit_op *ops, uint32_t count)
{
    struct bd_delta delta, inverse;
    struct bd_err_detail detail = {0};
    struct bd_scene *after, *back;
    if (bd_edit_check(world->scene, ops, count, &bd_edit_default_limits, &delta, world->ids,
                      &detail) != BD_ERR_OK)
        fail_msg("%s: %s", detail.field, detail.message);
    assert_int_equal(bd_delta_apply(world->scene, &delta, &after, &detail), BD_ERR_OK);
    assert_true(bd_delta_invert(world->scene, &delta, &inverse));
    assert_int_equal(bd_delta_apply(after, &inverse, &back, &detail), BD_ERR_OK);
    assert_memory_equal(back->content_sha256, world->scene->content_sha256, 32);
    assert_as_from_scratch(after);
    assert_as_from_scratch(back);
    bd_delta_finish(&delta), bd_delta_finish(&inverse);
    bd_scene_release(&back), bd_scene_release(&world->scene);
    world->scene = after;
}

static void edit_one(struct world *world, struct bd_edit_op op)
{
    edit_all(world, &op, 1);
}

static void refused_all(const struct world *world, const struct bd_edit_op *ops, uint32_t count,
                        enum bd_err err, const char *field, const char *says)
{
    struct bd_delta delta;
    struct bd_err_detail detail = {0};
    enum bd_err got =
        bd_edit_check(world->scene, ops, count, &bd_edit_default_limits, &delta, NULL, &detail);
    if (got != err || strcmp(detail.field, field) != 0 || !strstr(detail.message, says))
        fail_msg("want %s %s \"%s\", got %s %s \"%s\"", bd_err_name(err), field, says,
                 bd_err_name(got), detail.field, detail.message);
    assert_int_equal(delta.count, 0);
    assert_null(delta.changes);
}

static void refused(const struct world *world, struct bd_edit_op op, enum bd_err err,
                    const char *field, const char *says)
{
    refused_all(world, &op, 1, err, field, says);
}

#define OP(kind_, ...) ((struct bd_edit_op){.kind = BD_EDIT_##kind_, __VA_ARGS__})
#define TRANSFORM(...) .transform = {__VA_ARGS__}

static const char long_name[] = "0123456789012345678901234567890123456789012345678901234567890123";

// --- lights ---------------------------------------------------------------------------------

static void lights(void **state)
{
    (void)state;
    struct world w = begin("two_lights.glb");
    uint32_t before = w.scene->authored_light_count;
    uint32_t spots = w.scene->features.light_count[BD_LIGHT_SPOT];
    edit_one(&w, OP(SET_LIGHT, .id = 0, FIELDS(NUMBERS(intensity, 12))));
    assert_true(w.scene->lights[0].intensity == 12);
    const struct bd_edit_op add[] = {
        OP(ADD_LIGHT,
           FIELDS(TEXT(kind, "spot"), TEXT(name, "spot"), NUMBERS(cone_outer, 1.5707963267948966))),
        OP(ADD_NODE, FIELDS(WHOLE(light, BD_EDIT_ADDED(0)))),
    };
    edit_all(&w, add, 2);
    assert_int_equal(w.ids[0], before);
    assert_int_equal(w.ids[1], w.scene->node_count - 1);
    const struct bd_light *spot = &w.scene->lights[w.ids[0]];
    assert_string_equal(spot->name, "spot");
    assert_true(spot->cone_inner == 0 && spot->intensity == 1 && isinf(spot->range_m));
    assert_int_equal(w.scene->nodes[w.ids[1]].light, w.ids[0]);
    assert_int_equal(w.scene->features.light_count[BD_LIGHT_SPOT], spots + 1);
    const int32_t light = w.ids[0], node = w.ids[1];
    // A spot with the widest cone can be set again, without its cones being asked for.
    edit_one(&w, OP(SET_LIGHT, .id = light, FIELDS(NUMBERS(range, 7))));
    assert_true(w.scene->lights[light].range_m == 7);
    edit_one(&w, OP(SET_LIGHT, .id = light, FIELDS(NUMBERS(range, 0))));
    assert_true(isinf(w.scene->lights[light].range_m));

    refused(&w, OP(REMOVE_LIGHT, .id = light), BD_ERR_CONFLICT, "ops[0].remove_light.id",
            "is used by node");
    const struct bd_edit_op both[] = {OP(REMOVE_LIGHT, .id = light), OP(REMOVE_NODE, .id = node)};
    edit_all(&w, both, 2);
    assert_true(w.scene->lights[light].is_removed);
    refused(&w, OP(SET_LIGHT, .id = light), BD_ERR_NOT_FOUND, "ops[0].set_light.light",
            "was removed");
    edit_one(&w, OP(ADD_LIGHT, .id = 0));
    assert_int_equal(w.ids[0], light + 1); // an id is not used twice
    bd_scene_release(&w.scene);
}

static void lights_out_of_range(void **state)
{
    (void)state;
    struct world w = begin("two_lights.glb");
#define SET(field, says, ...)                                                                      \
    refused(&w, OP(SET_LIGHT, .id = 0, FIELDS(__VA_ARGS__)), BD_ERR_USAGE,                         \
            "ops[0].set_light." field, says)
    SET("intensity", "[0, 1e+30]", NUMBERS(intensity, -1));
    SET("intensity", "nan", NUMBERS(intensity, NAN));
    SET("color", "2e+30 is not in [0, 1e+30]", NUMBERS(color, 1, 1, 2e30));
    SET("range", "-3", NUMBERS(range, -3));
    SET("range", "2e+15 is not in [0, 1e+15]", NUMBERS(range, 2e15));
    SET("cone_outer", "1.6", TEXT(kind, "spot"), NUMBERS(cone_outer, 1.6));
    SET("cone_outer", "0.0001", TEXT(kind, "spot"), NUMBERS(cone_outer, 0));
    SET("cone_inner", "0.5", TEXT(kind, "spot"), NUMBERS(cone_outer, .5), NUMBERS(cone_inner, .5));
#undef SET
    refused(&w, OP(SET_LIGHT, .id = 0, FIELDS(TEXT(name, long_name))), BD_ERR_LIMIT,
            "ops[0].set_light.name", "64 bytes, limit 63");
    refused(&w, OP(SET_LIGHT, .id = 99), BD_ERR_NOT_FOUND, "ops[0].set_light.light", "no light 99");
    refused(&w, OP(SET_LIGHT, .id = BD_NONE), BD_ERR_USAGE, "ops[0].set_light.light", "no light");
    refused(&w, OP(SET_LIGHT, .id = INT32_MIN), BD_ERR_USAGE, "ops[0].set_light.light", "adds");
    bd_scene_release(&w.scene);
}

// --- cameras --------------------------------------------------------------------------------

static void cameras(void **state)
{
    (void)state;
    struct world w = begin("two_lights.glb");
    edit_one(&w, OP(SET_CAMERA, .id = 0, FIELDS(NUMBERS(yfov, 0.5))));
    assert_true(w.scene->cameras[0].yfov == 0.5f);
    edit_one(&w,
             OP(ADD_CAMERA, FIELDS(WHOLE(orthographic, true), NUMBERS(xmag, 2), NUMBERS(ymag, 3))));
    assert_true(w.scene->cameras[w.ids[0]].orthographic);
    edit_one(&w, OP(REMOVE_CAMERA, .id = w.ids[0]));
    refused(&w, OP(REMOVE_CAMERA, .id = 0), BD_ERR_CONFLICT, "ops[0].remove_camera.id", "used by");
#define SET(field, says, ...)                                                                      \
    refused(&w, OP(SET_CAMERA, .id = 0, FIELDS(__VA_ARGS__)), BD_ERR_USAGE,                        \
            "ops[0].set_camera." field, says)
    SET("yfov", "[0.001, 3.1101768]", NUMBERS(yfov, 3.2));
    SET("near", "0", NUMBERS(near, 0));
    SET("near", "1e+18 is not in [0, 1e+15]", NUMBERS(near, 1e18));
    SET("near", "nan", NUMBERS(near, NAN));
    SET("far", "2e+15 is not in [0, 1e+15]", NUMBERS(far, 2e15));
    SET("far", "inf", NUMBERS(far, INFINITY));
    SET("far", "beyond near 5", NUMBERS(near, 5), NUMBERS(far, 5));
    SET("xmag", "needed", WHOLE(orthographic, true));
    SET("ymag", "0 is not", WHOLE(orthographic, true), NUMBERS(xmag, 1), NUMBERS(ymag, 0));
    SET("xmag", "2e+15 is not in", WHOLE(orthographic, true), NUMBERS(xmag, 2e15),
        NUMBERS(ymag, 1));
    SET("ymag", "inf is not in", WHOLE(orthographic, true), NUMBERS(xmag, 1),
        NUMBERS(ymag, INFINITY));
#undef SET
    bd_scene_release(&w.scene);
}

// --- materials and textures -----------------------------------------------------------------

static void materials(void **state)
{
    (void)state;
    struct world w = begin("checker.glb");
    edit_one(&w, OP(SET_MATERIAL, .id = 0,
                    FIELDS(NUMBERS(roughness, 0.25), NUMBERS(attenuation_distance, 0))));
    assert_true(w.scene->materials[0].roughness == 0.25f);
    assert_true(isinf(w.scene->materials[0].attenuation_distance_m));
    edit_one(&w, OP(ADD_MATERIAL, FIELDS(TEXT(name, "new"))));
    assert_true(w.scene->materials[w.ids[0]].metallic == 1 &&
                w.scene->materials[w.ids[0]].ior == 1.5f);
    edit_one(&w, OP(REMOVE_MATERIAL, .id = w.ids[0]));
    refused(&w, OP(REMOVE_MATERIAL, .id = w.scene->meshes[0]->primitives[0].material),
            BD_ERR_CONFLICT, "ops[0].remove_material.id", "is used by mesh 0");
#define SET(field, says, ...)                                                                      \
    refused(&w, OP(SET_MATERIAL, .id = 0, FIELDS(__VA_ARGS__)), BD_ERR_USAGE,                      \
            "ops[0].set_material." field, says)
    SET("base_color", "1.5 is not in [0, 1]", NUMBERS(base_color, 0, 1.5, 0, 1));
    SET("metallic", "-0.1", NUMBERS(metallic, -.1));
    SET("roughness", "2", NUMBERS(roughness, 2));
    SET("emissive", "-1", NUMBERS(emissive, -1, 0, 0));
    SET("normal_scale", "10000000", NUMBERS(normal_scale, 1e7));
    SET("ior", "0.5 is not in [1, 1000000]", NUMBERS(ior, .5));
    SET("transmission", "2", NUMBERS(transmission, 2));
    SET("thickness", "-1", NUMBERS(thickness, -1));
    SET("attenuation_distance", "-1", NUMBERS(attenuation_distance, -1));
    SET("attenuation_color", "3", NUMBERS(attenuation_color, 3, 0, 0));
    SET("alpha_cutoff", "-1", NUMBERS(alpha_cutoff, -1));
#undef SET
    struct bd_edit_op map = OP(SET_MATERIAL, .id = 0, FIELDS(WHOLE(emissive_texture, 40)));
    refused(&w, map, BD_ERR_NOT_FOUND, "ops[0].set_material.emissive_texture", "no texture 40");
    bd_scene_release(&w.scene);
}

static struct bd_picture *gray_picture(uint8_t value)
{
    struct bd_picture *picture = calloc(1, sizeof *picture);
    assert_non_null(picture);
    *picture = (struct bd_picture){.reference_count = 1, .width_px = 1, .height_px = 1};
    picture->rgba = malloc(4);
    assert_non_null(picture->rgba);
    memset(picture->rgba, value, 4);
    bd_picture_seal(picture);
    return picture;
}

static void textures(void **state)
{
    (void)state;
    struct world w = begin("checker.glb");
    struct bd_picture *first = gray_picture(10), *second = gray_picture(20);
    struct bd_edit_op ops[] = {
        OP(ADD_TEXTURE, FIELDS(WHOLE(nearest, true)), .picture = first),
        OP(SET_MATERIAL, .id = 0, FIELDS(WHOLE(emissive_texture, BD_EDIT_ADDED(0)))),
    };
    edit_all(&w, ops, 2);
    const int32_t texture = w.ids[0], picture = w.scene->textures[texture].picture;
    assert_int_equal(w.scene->materials[0].emissive_map.texture, texture);
    assert_true(w.scene->materials[0].emissive_map.uv_transform[4] == 1);
    refused(&w, OP(REMOVE_TEXTURE, .id = texture), BD_ERR_CONFLICT, "ops[0].remove_texture.id",
            "is used by material 0");
    // Its own picture is replaced where it lies; one that others show too is left to them.
    edit_one(&w, OP(SET_TEXTURE, .id = texture, .picture = second));
    assert_int_equal(w.scene->textures[texture].picture, picture);
    assert_ptr_equal(w.scene->pictures[picture], second);
    const struct bd_edit_op removal[] = {
        OP(REMOVE_TEXTURE, .id = texture),
        OP(SET_MATERIAL, .id = 0, FIELDS(WHOLE(emissive_texture, BD_NONE))),
    };
    edit_all(&w, removal, 2);
    assert_true(w.scene->pictures[picture]->is_removed && w.scene->textures[texture].is_removed);
    refused(&w, OP(ADD_TEXTURE, .id = 0), BD_ERR_USAGE, "ops[0].add_texture.blob", "picture");
    bd_picture_release(&first), bd_picture_release(&second);
    bd_scene_release(&w.scene);
}

// As a file may have it: one more texture that shows the picture of texture 0.
static int32_t share_picture(struct world *world)
{
    const int32_t id = (int32_t)world->scene->texture_count;
    struct bd_delta delta = {0};
    struct bd_err_detail detail = {0};
    struct bd_scene *after;
    assert_true(bd_delta_take(&delta, world->scene, BD_OBJECT_TEXTURE, 0));
    delta.changes[0].id = (uint32_t)id;
    assert_int_equal(bd_delta_apply(world->scene, &delta, &after, &detail), BD_ERR_OK);
    bd_delta_finish(&delta);
    bd_scene_release(&world->scene);
    world->scene = after;
    return id;
}

// Who shows a picture is known at every point of a batch.
static void a_picture_goes_with_the_last_that_shows_it(void **state)
{
    (void)state;
    struct world w = begin("checker.glb");
    struct bd_scene *other = load(own_scenes, "checker.glb");
    struct bd_picture *first = gray_picture(10), *second = gray_picture(20);
    const int32_t twin = share_picture(&w);
    const int32_t picture = w.scene->textures[twin].picture;
    const int32_t imported = (int32_t)w.scene->texture_count;
    const int32_t pictures = (int32_t)w.scene->picture_count;
    struct bd_edit_op ops[] = {
        OP(SET_TEXTURE, .id = twin, .picture = first),
        OP(IMPORT, .import = {.parent = BD_NONE, .scene = other}),
        OP(SET_TEXTURE, .id = twin, .picture = second),
        OP(SET_TEXTURE, .id = 0, .picture = first),
        OP(SET_MATERIAL, .id = (int32_t)w.scene->material_count,
           FIELDS(WHOLE(base_color_texture, BD_NONE))),
        OP(REMOVE_TEXTURE, .id = imported),
        OP(REMOVE_TEXTURE, .id = twin),
    };
    edit_all(&w, ops, 7);
    assert_int_equal(w.scene->textures[0].picture, picture);
    assert_ptr_equal(w.scene->pictures[picture], first);
    assert_true(w.scene->pictures[pictures]->is_removed); // the twin's
    assert_true(w.scene->pictures[pictures + 1 + other->textures[0].picture]->is_removed);
    bd_picture_release(&first), bd_picture_release(&second);
    bd_scene_release(&other);
    bd_scene_release(&w.scene);
}

// --- nodes ----------------------------------------------------------------------------------

static void nodes(void **state)
{
    (void)state;
    struct world w = begin("two_lights.glb");
    const struct bd_edit_op tree[] = {
        OP(ADD_NODE, FIELDS(TEXT(name, "a")),
           .transform = {.is_given = true,
                         .given = BD_GIVEN_TRANSLATION | BD_GIVEN_SCALE,
                         .translation = {1, 2, 3},
                         .scale = {2, 2, 2}}),
        OP(ADD_NODE, FIELDS(WHOLE(parent, BD_EDIT_ADDED(0)), WHOLE(mesh, 0))),
        OP(ADD_NODE, FIELDS(WHOLE(parent, BD_EDIT_ADDED(1)), WHOLE(mesh, 0))),
    };
    uint32_t instances = w.scene->instance_count;
    edit_all(&w, tree, 3);
    const int32_t a = w.ids[0], b = w.ids[1], c = w.ids[2];
    assert_int_equal(w.scene->instance_count, instances + 2);
    assert_true(w.scene->nodes[c].world_from_node.m[13] == 2 &&
                w.scene->nodes[c].world_from_node.m[5] == 2);
    edit_one(&w, OP(SET_TRANSFORM, .id = b,
                    TRANSFORM(.given = BD_GIVEN_TRANSLATION, .translation = {0, 1, 0})));
    assert_true(w.scene->nodes[c].world_from_node.m[13] == 4);
    edit_one(&w, OP(SET_NODE, .id = a, FIELDS(WHOLE(shown, false))));
    assert_int_equal(w.scene->instance_count, instances);
    edit_one(&w, OP(SET_NODE, .id = a, FIELDS(WHOLE(shown, true))));
    refused(&w, OP(SET_NODE, .id = a, FIELDS(WHOLE(parent, c))), BD_ERR_USAGE,
            "ops[0].set_node.parent", "is below node");
    refused(&w, OP(SET_NODE, .id = a, FIELDS(WHOLE(parent, a))), BD_ERR_USAGE,
            "ops[0].set_node.parent", "is below node");
    refused(&w, OP(REMOVE_MESH, .id = 0), BD_ERR_CONFLICT, "ops[0].remove_mesh.id", "mesh 0");
    // A node of a subtree that the batch removed is gone for the operations behind.
    const struct bd_edit_op late[] = {
        OP(REMOVE_NODE, .id = a),
        OP(SET_NODE, .id = c, FIELDS(WHOLE(parent, BD_NONE))),
    };
    refused_all(&w, late, 2, BD_ERR_NOT_FOUND, "ops[1].set_node.node", "was removed");
    edit_one(&w, OP(REMOVE_NODE, .id = a));
    assert_true(w.scene->nodes[a].is_removed && w.scene->nodes[b].is_removed &&
                w.scene->nodes[c].is_removed && !w.scene->nodes[0].is_removed);
    assert_int_equal(w.scene->instance_count, instances);
    bd_scene_release(&w.scene);
}

// Removing in the middle of a chain leaves what is above.
static void a_removal_stops_at_what_is_above(void **state)
{
    (void)state;
    struct world w = begin("two_lights.glb");
    const struct bd_edit_op tree[] = {
        OP(ADD_NODE, .id = 0),
        OP(ADD_NODE, FIELDS(WHOLE(parent, BD_EDIT_ADDED(0)))),
        OP(ADD_NODE, FIELDS(WHOLE(parent, BD_EDIT_ADDED(1)))),
        OP(ADD_NODE, FIELDS(WHOLE(parent, BD_EDIT_ADDED(0)))),
    };
    edit_all(&w, tree, 4);
    const int32_t top = w.ids[0], middle = w.ids[1], low = w.ids[2], beside = w.ids[3];
    // So that a child comes before its parent in the array.
    const struct bd_edit_op under = OP(SET_NODE, .id = 0, FIELDS(WHOLE(parent, low)));
    edit_one(&w, under);
    edit_one(&w, OP(REMOVE_NODE, .id = middle));
    assert_true(!w.scene->nodes[top].is_removed && w.scene->nodes[middle].is_removed);
    assert_true(w.scene->nodes[low].is_removed && !w.scene->nodes[beside].is_removed);
    assert_true(w.scene->nodes[0].is_removed);
    bd_scene_release(&w.scene);
}

// A chain that is as long as it likes costs its length where a batch has to look upwards, and no
// more than a batch may.
static void ways_up_are_counted(void **state)
{
    (void)state;
    struct world w = begin("two_lights.glb");
    struct bd_edit_op ops[12] = {OP(ADD_NODE, .id = 0)};
    struct bd_field_value parents[12];
    for (int i = 1; i < 12; i++) {
        parents[i] = (struct bd_field_value)WHOLE(parent, BD_EDIT_ADDED(i - 1));
        ops[i] = OP(ADD_NODE, .fields = &parents[i], .field_count = 1);
    }
    struct bd_edit_limits few = bd_edit_default_limits;
    struct bd_delta delta;
    struct bd_err_detail detail = {0};
    few.steps = 0; // nothing was removed or moved
    assert_int_equal(bd_edit_check(w.scene, ops, 12, &few, &delta, NULL, &detail), BD_ERR_OK);
    bd_delta_finish(&delta);
    edit_all(&w, ops, 12);
    const int32_t low = w.ids[11];
    const struct bd_edit_op moved[] = {
        OP(SET_TRANSFORM, .id = low, TRANSFORM(.given = 0)),
        OP(SET_NODE, .id = 0, FIELDS(WHOLE(parent, low))),
        OP(REMOVE_NODE, .id = 1),
        OP(SET_TRANSFORM, .id = low, TRANSFORM(.given = 0)),
    };
    few.steps = 24;
    assert_int_equal(bd_edit_check(w.scene, moved, 4, &few, &delta, NULL, &detail), BD_ERR_OK);
    bd_delta_finish(&delta);
    few.steps = 23;
    assert_int_equal(bd_edit_check(w.scene, moved, 4, &few, &delta, NULL, &detail), BD_ERR_LIMIT);
    assert_string_equal(detail.field, "ops[3].set_transform");
    few.steps = 11;
    assert_int_equal(bd_edit_check(w.scene, moved, 4, &few, &delta, NULL, &detail), BD_ERR_LIMIT);
    assert_string_equal(detail.field, "ops[1].set_node");
    bd_scene_release(&w.scene);
}

static void transforms_out_of_range(void **state)
{
    (void)state;
    struct world w = begin("two_lights.glb");
#define SET(field, bits, says, ...)                                                                \
    refused(&w, OP(SET_TRANSFORM, .id = 0, TRANSFORM(.given = (bits), __VA_ARGS__)), BD_ERR_USAGE, \
            "ops[0].set_transform." field, says)
    SET("translation", BD_GIVEN_TRANSLATION, "2e+15 is not in", .translation = {0, 2e15, 0});
    SET("translation", BD_GIVEN_TRANSLATION, "nan", .translation = {0, 0, NAN});
    SET("scale", BD_GIVEN_SCALE, "inf", .scale = {1, INFINITY, 1});
    SET("rotation", BD_GIVEN_ROTATION, "is zero", .rotation = {0, 0, 0, 0});
    SET("matrix", BD_GIVEN_MATRIX, "last row", .matrix = {1});
    SET("matrix", BD_GIVEN_MATRIX | BD_GIVEN_SCALE, "excludes",
        .matrix = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1});
#undef SET
    refused(&w,
            OP(ADD_NODE,
               .transform = {.is_given = true, .given = BD_GIVEN_SCALE, .scale = {NAN, 1, 1}}),
            BD_ERR_USAGE, "ops[0].add_node.transform.scale", "nan");
    refused(&w, OP(ADD_NODE, FIELDS(WHOLE(light, BD_EDIT_ADDED(0)))), BD_ERR_USAGE,
            "ops[0].add_node.light", "no operation before this one adds light 0");
    edit_one(&w, OP(SET_TRANSFORM, .id = 0,
                    TRANSFORM(.given = BD_GIVEN_MATRIX,
                              .matrix = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 0, 0, 1})));
    assert_true(w.scene->nodes[0].parent_from_node.m[12] == 5);
    bd_scene_release(&w.scene);
}

// --- meshes ---------------------------------------------------------------------------------

static void meshes(void **state)
{
    (void)state;
    struct world w = begin("two_lights.glb");
    struct bd_mesh *prepared = bd_mesh_alias(w.scene->meshes[0]);
    assert_non_null(prepared);
    prepared->primitives[0].material = BD_NONE;
    const struct bd_edit_op add[] = {
        OP(ADD_MESH, .mesh = {.name = "mine", .mesh = prepared}),
        OP(ADD_NODE, FIELDS(WHOLE(mesh, BD_EDIT_ADDED(0)))),
    };
    uint32_t materials_before = w.scene->material_count;
    edit_all(&w, add, 2);
    const int32_t mesh = w.ids[0], node = w.ids[1];
    assert_string_equal(w.scene->meshes[mesh]->name, "mine");
    assert_int_equal(w.scene->material_count, materials_before + 1); // the white one
    assert_int_equal(w.scene->meshes[mesh]->primitives[0].material, materials_before);
    edit_one(&w, OP(SET_MESH, .id = mesh, .mesh = {.mesh = prepared}));
    assert_string_equal(w.scene->meshes[mesh]->name, "mine");
    assert_int_equal(bd_scene_count(w.scene).materials, materials_before + 1); // and no second one
    edit_one(&w, OP(SET_MESH, .id = mesh, .mesh = {.name = "other"}));
    assert_string_equal(w.scene->meshes[mesh]->name, "other");
    prepared->primitives[0].material = 1000;
    refused(&w, OP(ADD_MESH, .mesh = {.mesh = prepared, .name = ""}), BD_ERR_NOT_FOUND,
            "ops[0].add_mesh.primitives[0].material", "no material 1000");
    refused(&w, OP(ADD_MESH, .mesh = {.name = "x"}), BD_ERR_USAGE, "ops[0].add_mesh.primitives",
            "needed");
    refused(&w, OP(REMOVE_MESH, .id = mesh), BD_ERR_CONFLICT, "ops[0].remove_mesh.id", "used by");
    const struct bd_edit_op both[] = {OP(REMOVE_NODE, .id = node), OP(REMOVE_MESH, .id = mesh)};
    edit_all(&w, both, 2);
    assert_true(w.scene->meshes[mesh]->is_removed);
    assert_int_equal(w.scene->meshes[mesh]->primitive_count, 0);
    bd_mesh_release(&prepared);
    bd_scene_release(&w.scene);
}

static void vertices(void **state)
{
    (void)state;
    struct world w = begin("two_lights.glb");
    struct bd_err_detail detail = {0};
    const struct bd_mesh *mesh = w.scene->meshes[0];
    const struct bd_primitive *primitive = &mesh->primitives[0];
    const uint32_t count = primitive->vertex_count;
    float *positions = malloc(3 * (size_t)count * sizeof *positions);
    assert_non_null(positions);
    // Turned by a quarter about z: (x, y) becomes (-y, x), and normals with it.
    for (uint32_t v = 0; v < count; v++) {
        const float *p = primitive->position + 3 * (size_t)v;
        positions[3 * v] = -p[1], positions[3 * v + 1] = p[0], positions[3 * v + 2] = p[2];
    }
    struct bd_mesh *deformed;
    const char *field = "ops[0].set_mesh_vertices";
    assert_int_equal(
        bd_edit_deform_mesh(mesh, 0, positions, NULL, count, field, &deformed, &detail), BD_ERR_OK);
    for (uint32_t v = 0; v < count; v++) {
        const float *was = primitive->normal + 3 * (size_t)v;
        const float *is = deformed->primitives[0].normal + 3 * (size_t)v;
        assert_true(fabsf(is[0] + was[1]) < 1e-5f && fabsf(is[1] - was[0]) < 1e-5f &&
                    fabsf(is[2] - was[2]) < 1e-5f);
    }
    assert_true(deformed->primitives[0].bounds_max[1] == primitive->bounds_max[0]);
    assert_memory_not_equal(deformed->sha256, mesh->sha256, 32);
    edit_one(&w, OP(SET_MESH_VERTICES, .id = 0, .mesh = {.mesh = deformed}));
    assert_memory_equal(w.scene->meshes[0]->sha256, deformed->sha256, 32);
    mesh = w.scene->meshes[0];
    struct bd_mesh *bad;
    assert_int_equal(bd_edit_deform_mesh(mesh, 0, positions, NULL, count - 1, field, &bad, &detail),
                     BD_ERR_USAGE);
    assert_string_equal(detail.field, "ops[0].set_mesh_vertices.positions");
    assert_int_equal(bd_edit_deform_mesh(mesh, 9, positions, NULL, count, field, &bad, &detail),
                     BD_ERR_NOT_FOUND);
    assert_string_equal(detail.field, "ops[0].set_mesh_vertices.primitive");
    positions[1] = INFINITY;
    assert_int_equal(bd_edit_deform_mesh(mesh, 0, positions, NULL, count, field, &bad, &detail),
                     BD_ERR_USAGE);
    assert_string_equal(detail.field, "ops[0].set_mesh_vertices.positions");
    deformed->primitives[0].index_count = 0;
    refused(&w, OP(SET_MESH_VERTICES, .id = 0, .mesh = {.mesh = deformed}), BD_ERR_CONFLICT,
            "ops[0].set_mesh_vertices.mesh", "other triangles");
    free(positions);
    bd_mesh_release(&deformed);
    bd_scene_release(&w.scene);
}

// Two triangles of a square with vertices of their own, which lie at the same places in numbers but
// not in bits: the square bends smoothly.
static void a_zero_is_one_place(void **state)
{
    (void)state;
    static const float square[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 0, -0.0f, 1, 1, 0, -0.0f, 1, 0};
    static const float up[] = {0, 0, 1, 0, 0, 1, 0, 0, 1, -0.0f, 0, 1, 0, 0, 1, 0, -0.0f, 1};
    const struct bd_primitive_source source = {
        .material = BD_NONE, .vertex_count = 6, .positions = square, .normals = up};
    struct bd_mesh *mesh, *bent;
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_edit_build_mesh(&source, 1, "", &mesh, &detail), BD_ERR_OK);
    float positions[18];
    memcpy(positions, square, sizeof positions);
    positions[14] = 1; // the corner of one triangle alone
    assert_int_equal(bd_edit_deform_mesh(mesh, 0, positions, NULL, 6, "", &bent, &detail),
                     BD_ERR_OK);
    const float *normal = bent->primitives[0].normal;
    assert_true(normal[3] < -0.1f && normal[4] < -0.1f);
    assert_memory_equal(normal + 3, normal + 9, 3 * sizeof *normal);
    assert_memory_equal(normal + 6, normal + 15, 3 * sizeof *normal);
    bd_mesh_release(&bent);
    bd_mesh_release(&mesh);
}

static void assert_not_built(struct bd_primitive_source source, const char *field)
{
    struct bd_mesh *mesh;
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_edit_build_mesh(&source, 1, "ops[0].add_mesh", &mesh, &detail),
                     BD_ERR_USAGE);
    assert_null(mesh);
    assert_string_equal(detail.field, field);
}

static void built_meshes(void **state)
{
    (void)state;
    static const float square[] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
    static const float uv[] = {0, 0, 1, 0, 1, 1, 0, 1};
    static const float far_away[] = {0, 0, 0, 2e15f, 0, 0, 1, 1, 0, 0, 1, 0};
    static const uint32_t two[] = {0, 1, 2, 0, 2, 3}, beyond[] = {0, 1, 4};
    const struct bd_primitive_source plain = {.material = BD_NONE,
                                              .vertex_count = 4,
                                              .index_count = 6,
                                              .positions = square,
                                              .uv = {uv, NULL},
                                              .indices = two};
    struct world w = begin("two_lights.glb");
    struct bd_mesh *mesh;
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_edit_build_mesh(&plain, 1, "ops[0].add_mesh", &mesh, &detail), BD_ERR_OK);
    const struct bd_primitive *made = &mesh->primitives[0];
    assert_int_equal(made->index_count, 6);
    assert_true(made->normal[2] == 1 && made->tangent[0] == 1 && made->bounds_max[1] == 1);
    edit_one(&w, OP(ADD_MESH, .mesh = {.name = "square", .mesh = mesh}));
    bd_mesh_release(&mesh);
    struct bd_primitive_source bad = plain;
    bad.positions = NULL;
    assert_not_built(bad, "ops[0].add_mesh.primitives[0].positions");
    bad.positions = far_away;
    assert_not_built(bad, "ops[0].add_mesh.primitives[0].positions");
    bad = plain;
    bad.indices = NULL;
    assert_not_built(bad, "ops[0].add_mesh.primitives[0].positions");
    bad.indices = beyond;
    bad.index_count = 3;
    assert_not_built(bad, "ops[0].add_mesh.primitives[0].indices");
    bad.index_count = 2;
    assert_not_built(bad, "ops[0].add_mesh.primitives[0].indices");
    bad = plain;
    bad.colors = (const float[16]){0, 0, 0, 1, 1.5f};
    assert_not_built(bad, "ops[0].add_mesh.primitives[0].colors");
    bd_scene_release(&w.scene);
}

// One white material for a batch, and another one once the batch has made something else of it.
static void white_is_what_is_still_white(void **state)
{
    (void)state;
    struct world w = begin("two_lights.glb");
    struct bd_mesh *prepared = bd_mesh_alias(w.scene->meshes[0]);
    assert_non_null(prepared);
    for (uint32_t p = 0; p < prepared->primitive_count; p++)
        prepared->primitives[p].material = BD_NONE;
    const int32_t white = (int32_t)w.scene->material_count;
    const struct bd_edit_op ops[] = {
        OP(ADD_MESH, .mesh = {.name = "a", .mesh = prepared}),
        OP(ADD_MESH, .mesh = {.name = "b", .mesh = prepared}),
        OP(SET_MATERIAL, .id = white, FIELDS(NUMBERS(metallic, 1))),
        OP(ADD_MESH, .mesh = {.name = "c", .mesh = prepared}),
        OP(ADD_MESH, .mesh = {.name = "d", .mesh = prepared}),
    };
    edit_all(&w, ops, 5);
    assert_int_equal(w.scene->material_count, white + 2);
    for (int i = 0; i < 5; i++) {
        if (w.ids[i] == BD_NONE) continue;
        const struct bd_mesh *mesh = w.scene->meshes[w.ids[i]];
        for (uint32_t p = 0; p < mesh->primitive_count; p++)
            assert_int_equal(mesh->primitives[p].material, i < 2 ? white : white + 1);
    }
    bd_mesh_release(&prepared);
    bd_scene_release(&w.scene);
}

// --- environment, imports, batches ----------------------------------------------------------

static void environments(void **state)
{
    (void)state;
    struct world w = begin("two_lights.glb");
    edit_one(&w, OP(SET_ENVIRONMENT, .environment = {.radiance = {1, 2, 3}}));
    assert_true(w.scene->features.has_environment && w.scene->environment.radiance[2] == 3);
    refused(&w, OP(SET_ENVIRONMENT, .environment = {.radiance = {1, -2, 3}}), BD_ERR_USAGE,
            "ops[0].set_environment.radiance", "-2 is not in [0, 1e+30]");
    bd_scene_release(&w.scene);
}

static void imports(void **state)
{
    (void)state;
    struct world w = begin("two_lights.glb");
    struct bd_scene *other = load(own_scenes, "checker.glb");
    const struct bd_edit_op ops[] = {
        OP(IMPORT, .import = {.parent = 0, .name = "in", .scene = other}),
        OP(SET_TRANSFORM, .id = BD_EDIT_ADDED(0),
           TRANSFORM(.given = BD_GIVEN_TRANSLATION, .translation = {0, 0, 9})),
    };
    uint64_t triangles = w.scene->features.triangle_count;
    uint32_t textures_before = w.scene->texture_count, pictures_before = w.scene->picture_count;
    edit_all(&w, ops, 2);
    assert_int_equal(w.scene->features.triangle_count, triangles + other->features.triangle_count);
    assert_string_equal(w.scene->nodes[w.ids[0]].name, "in");
    assert_int_equal(w.scene->nodes[w.ids[0]].parent, 0);
    assert_int_equal(w.scene->texture_count, textures_before + other->texture_count);
    assert_ptr_equal(w.scene->pictures[pictures_before], other->pictures[0]);
    assert_true(w.scene->features.has_base_color_map);
    refused(&w, OP(IMPORT, .import = {.parent = 77, .scene = other}), BD_ERR_NOT_FOUND,
            "ops[0].import.parent", "no node 77");
    bd_scene_release(&other);
    bd_scene_release(&w.scene);
}

static void limits(void **state)
{
    (void)state;
    struct world w = begin("two_lights.glb");
    struct bd_edit_op ops[3] = {OP(ADD_NODE, FIELDS(WHOLE(mesh, 0))), OP(ADD_NODE, .id = 0),
                                OP(ADD_NODE, .id = 0)};
    struct bd_edit_limits few = bd_edit_default_limits;
    struct bd_delta delta;
    struct bd_err_detail detail = {0};
    few.ops = 2;
    assert_int_equal(bd_edit_check(w.scene, ops, 3, &few, &delta, NULL, &detail), BD_ERR_LIMIT);
    assert_string_equal(detail.field, "ops");
    few = bd_edit_default_limits;
    few.objects = w.scene->node_count + 2;
    assert_int_equal(bd_edit_check(w.scene, ops, 3, &few, &delta, NULL, &detail), BD_ERR_LIMIT);
    assert_string_equal(detail.field, "ops[2].add_node");
    few = bd_edit_default_limits;
    few.triangles = w.scene->features.triangle_count;
    assert_int_equal(bd_edit_check(w.scene, ops, 1, &few, &delta, NULL, &detail), BD_ERR_LIMIT);
    assert_int_equal(bd_edit_check(w.scene, ops + 1, 2, &few, &delta, NULL, &detail), BD_ERR_OK);
    bd_delta_finish(&delta);
    refused_all(&w, ops, 0, BD_ERR_USAGE, "ops", "none");
    // Nothing of a batch is done that ends in an error.
    ops[2] = OP(SET_LIGHT, .id = 50);
    refused_all(&w, ops, 3, BD_ERR_NOT_FOUND, "ops[2].set_light.light", "no light 50");
    bd_scene_release(&w.scene);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lights),
        cmocka_unit_test(lights_out_of_range),
        cmocka_unit_test(cameras),
        cmocka_unit_test(materials),
        cmocka_unit_test(textures),
        cmocka_unit_test(nodes),
        cmocka_unit_test(meshes),
        cmocka_unit_test(a_removal_stops_at_what_is_above),
        cmocka_unit_test(vertices),
        cmocka_unit_test(transforms_out_of_range),
        cmocka_unit_test(imports),
        cmocka_unit_test(environments),
        cmocka_unit_test(limits),
        cmocka_unit_test(built_meshes),
        cmocka_unit_test(a_zero_is_one_place),
        cmocka_unit_test(a_picture_goes_with_the_last_that_shows_it),

        cmocka_unit_test(ways_up_are_counted),
        cmocka_unit_test(white_is_what_is_still_white),
    };
    if (argc < 2) return 2;
    own_scenes = argv[1];
    return cmocka_run_group_tests(tests, NULL, NULL);
}
