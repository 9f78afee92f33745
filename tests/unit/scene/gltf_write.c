// The export: a snapshot through a .glb and back is the same snapshot, for the bundled scenes, for
// what edits make of them, and for numbers and names at their extremes.
//
// usage: gltf_write OWN_SCENES [SHARED_SCENES]

#include <float.h>
#include <math.h>

#include "scene/edit/edit.h"
#include "scene/gltf/gltf_reader.h"
#include "scene/gltf/gltf_write_json.h"
#include "scene/gltf/gltf_write_parts.h"
#include "scene/import/import.h"
#include "tests/unit/scene/fields.h"
#include "tests/unit/scene/round_trip.h"

static const char *own_scenes;

static const char *const bundled[] = {"cornell.glb",     "checker.glb",    "cube_room.glb",
                                      "two_lights.glb",  "wall_floor.glb", "floor_ceiling.glb",
                                      "orthographic.glb"};

static uint32_t random_state = 1;

static double random_real(void)
{
    random_state = random_state * 1664525u + 1013904223u;
    return random_state / 4294967296.0;
}

static void assert_identity(const struct bd_scene *scene)
{
    uint8_t before[32], after[32];
    struct round_trip trip = round_trip_of(scene);
    if (trip.notes.count) fail_msg("note: %s", trip.notes.text[0]);
    hash_without_flags(scene, before);
    hash_without_flags(trip.scene, after);
    assert_memory_equal(before, after, 32);
    end_round_trip(&trip);
}

static void bundled_scenes_come_back(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof bundled / sizeof bundled[0]; i++) {
        struct bd_scene *scene = load(own_scenes, bundled[i]);
        assert_non_null(scene);
        assert_identity(scene);
        assert_settles(scene);
        bd_scene_release(&scene);
    }
}

// --- after edits ----------------------------------------------------------------------------

// `*scene` becomes what the operations make of it.
static void edit(struct bd_scene **scene, const struct bd_edit_op *ops, uint32_t count)
{
    struct bd_delta delta;
    struct bd_scene *after = NULL;
    struct bd_err_detail detail = {0};
    if (bd_edit_check(*scene, ops, count, &bd_edit_default_limits, &delta, NULL, &detail) ||
        bd_delta_apply(*scene, &delta, &after, &detail))
        fail_msg("%s: %s", detail.field, detail.message);
    bd_delta_finish(&delta);
    bd_scene_release(scene);
    *scene = after;
}

static void edited_scenes_come_back(void **state)
{
    (void)state;
    struct bd_scene *scene = load(own_scenes, "cornell.glb");
    const struct bd_edit_op ops[] = {
        {.kind = BD_EDIT_ADD_LIGHT,
         FIELDS(TEXT(name, "a \"lamp\" \\ \t\x01 caf\xc3\xa9"), TEXT(kind, "spot"),
                NUMBERS(intensity, 0.1), NUMBERS(range, 1e15), NUMBERS(cone_outer, 1.2))},
        {.kind = BD_EDIT_ADD_NODE,
         FIELDS(WHOLE(light, BD_EDIT_ADDED(0))),
         .transform = {.is_given = true,
                       .given = BD_GIVEN_TRANSLATION | BD_GIVEN_ROTATION,
                       .translation = {0.1, 1e-300, -0.0},
                       .rotation = {0.1, 0.2, 0.3, 0.4}}},
        {.kind = BD_EDIT_SET_TRANSFORM,
         .id = 0,
         .transform = {.given = BD_GIVEN_MATRIX,
                       .matrix = {1, 0.5, 0, 0, 0.25, -1, 0, 0, 0, 0, 1.0 / 3, 0, 7, 8, 9, 1}}},
        {.kind = BD_EDIT_SET_MATERIAL,
         .id = 0,
         FIELDS(NUMBERS(emissive, 17, 0.1, 3e9), NUMBERS(attenuation_distance, 0.3),
                NUMBERS(alpha_cutoff, 0.7), NUMBERS(ior, 0), WHOLE(unlit, true))},
    };
    edit(&scene, ops, sizeof ops / sizeof ops[0]);
    assert_identity(scene);
    assert_settles(scene);
    bd_scene_release(&scene);
}

// What its kind does not read is not told: an edited orthographic camera keeps its angle.
static void cameras_come_back(void **state)
{
    (void)state;
    struct bd_scene *scene = load(own_scenes, "two_lights.glb");
    const struct bd_edit_op ops[] = {
        {.kind = BD_EDIT_ADD_CAMERA,
         FIELDS(WHOLE(orthographic, true), NUMBERS(xmag, 0.2), NUMBERS(ymag, 3))},
        {.kind = BD_EDIT_ADD_NODE, FIELDS(WHOLE(camera, BD_EDIT_ADDED(0)))},
    };
    edit(&scene, ops, 2);
    assert_settles(scene);
    struct round_trip trip = round_trip_of(scene);
    const uint32_t last = trip.scene->authored_camera_count - 1;
    const struct bd_camera *before = &scene->cameras[last], *after = &trip.scene->cameras[last];
    assert_true(after->orthographic && after->xmag == before->xmag && after->ymag == before->ymag);
    assert_true(after->near_m == before->near_m &&
                isinf(after->far_m)); // no float is its far plane
    end_round_trip(&trip);
    bd_scene_release(&scene);
}

static void removed_and_hidden_objects_are_not_told(void **state)
{
    (void)state;
    struct bd_scene *scene = load(own_scenes, "two_lights.glb");
    const uint32_t nodes = bd_scene_count(scene).nodes;
    const struct bd_edit_op ops[] = {
        {.kind = BD_EDIT_ADD_NODE, FIELDS(TEXT(name, "goes"))},
        {.kind = BD_EDIT_ADD_NODE,
         FIELDS(TEXT(name, "hidden"), WHOLE(parent, 0), WHOLE(shown, false))},
        {.kind = BD_EDIT_ADD_NODE, FIELDS(WHOLE(mesh, 0), WHOLE(parent, BD_EDIT_ADDED(1)))},
        {.kind = BD_EDIT_ADD_NODE, FIELDS(WHOLE(shown, false))},
        {.kind = BD_EDIT_REMOVE_NODE, .id = BD_EDIT_ADDED(0)},
    };
    edit(&scene, ops, 5);
    assert_settles(scene);
    struct round_trip trip = round_trip_of(scene);
    assert_int_equal(trip.notes.count, 0);
    assert_int_equal(trip.scene->node_count, nodes + 3); // the gap is closed
    assert_string_equal(trip.scene->nodes[nodes].name, "hidden");
    assert_true(trip.scene->nodes[nodes].is_hidden && trip.scene->nodes[nodes].parent == 0);
    assert_true(!trip.scene->nodes[nodes + 1].is_hidden && !trip.scene->nodes[nodes + 1].in_scene);
    assert_true(trip.scene->nodes[nodes + 2].is_hidden);
    end_round_trip(&trip);
    bd_scene_release(&scene);
}

// --- meshes that the importer would have otherwise ------------------------------------------

static struct bd_mesh *mesh_of(const float *uv0, const float *uv1)
{
    // Four corners of a square, one that nobody uses, and a triangle that is a line only.
    static const float positions[] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 9, 9, 9, 0, 0.5f, 0};
    static const uint32_t indices[] = {0, 1, 2, 0, 2, 3, 0, 5, 3};
    const struct bd_primitive_source source = {.material = 0,
                                               .vertex_count = 6,
                                               .index_count = 9,
                                               .positions = positions,
                                               .uv = {uv0, uv1},
                                               .indices = indices};
    struct bd_mesh *mesh;
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_edit_build_mesh(&source, 1, "mesh", &mesh, &detail), BD_ERR_OK);
    return mesh;
}

// Takes the mesh.
static void add_mesh(struct bd_scene **scene, struct bd_mesh *mesh)
{
    const struct bd_edit_op ops[] = {
        {.kind = BD_EDIT_ADD_MESH, .mesh = {.name = "square", .mesh = mesh}},
        {.kind = BD_EDIT_ADD_NODE, FIELDS(WHOLE(mesh, BD_EDIT_ADDED(0)))},
    };
    edit(scene, ops, 2);
    bd_mesh_release(&mesh);
}

static struct bd_scene *with_mesh(const char *file, struct bd_mesh *mesh)
{
    struct bd_scene *scene = load(own_scenes, file);
    assert_non_null(scene);
    add_mesh(&scene, mesh);
    return scene;
}

static void unused_vertices_go(void **state)
{
    (void)state;
    struct bd_scene *scene = with_mesh("two_lights.glb", mesh_of(NULL, NULL));
    struct round_trip trip = round_trip_of(scene);
    const struct bd_mesh *mesh = trip.scene->meshes[trip.scene->mesh_count - 1];
    assert_string_equal(trip.notes.text[0], "left_out_unused_vertices: 2");
    assert_int_equal(trip.notes.count, 1); // add_mesh has left out the line itself
    assert_int_equal(mesh->primitives[0].vertex_count, 4);
    assert_int_equal(mesh->primitives[0].index_count, 6);
    end_round_trip(&trip);
    assert_settles(scene);
    bd_scene_release(&scene);
}

// A base colour map does not show where there are no coordinates: in the file that is said by a
// material without the map, since an importer would show the map's corner.
static void maps_that_do_not_show_are_split_off(void **state)
{
    (void)state;
    static const float uv[12] = {0, 0, 1, 0, 1, 1, 0, 1};
    struct bd_scene *scene = with_mesh("checker.glb", mesh_of(NULL, uv));
    const uint32_t materials = scene->material_count;
    struct round_trip trip = round_trip_of(scene);
    const struct bd_mesh *mesh = trip.scene->meshes[trip.scene->mesh_count - 1];
    assert_true(has_note(&trip.notes, "materials_split: 1"));
    assert_int_equal(trip.scene->material_count, materials + 1);
    assert_int_equal(mesh->primitives[0].material, materials);
    assert_int_equal(trip.scene->materials[materials].base_color_map.texture, BD_NONE);
    assert_non_null(mesh->primitives[0].uv[0]); // zeros: sets of coordinates begin with the first
    assert_non_null(mesh->primitives[0].uv[1]);
    end_round_trip(&trip);
    assert_settles(scene);
    bd_scene_release(&scene);
}

static void tangents_without_a_map_go(void **state)
{
    (void)state;
    static const float uv[12] = {0, 0, 1, 0, 1, 1, 0, 1};
    struct bd_scene *scene = with_mesh("two_lights.glb", mesh_of(uv, NULL));
    struct round_trip trip = round_trip_of(scene);
    assert_true(has_note(&trip.notes, "left_out_unread_tangents: 1"));
    end_round_trip(&trip);
    assert_settles(scene);
    bd_scene_release(&scene);
}

// A unit vector of floats is hardly ever one to the last bit, and must not be made one again.
static void normals_and_tangents_come_back(void **state)
{
    (void)state;
    enum { COUNT = 6000 };
    static float positions[3 * COUNT], normals[3 * COUNT], tangents[4 * COUNT], uv[2 * COUNT];
    for (size_t i = 0; i < 3 * COUNT; i++) {
        positions[i] = (float)random_real();
        normals[i] = (float)(random_real() - 0.5);
    }
    for (size_t i = 0; i < 4 * COUNT; i++) tangents[i] = (float)(random_real() - 0.5);
    for (size_t i = 0; i < 2 * COUNT; i++) uv[i] = (float)random_real();
    struct bd_scene *scene = load(own_scenes, "checker.glb");
    const struct bd_edit_op op = {.kind = BD_EDIT_SET_MATERIAL, FIELDS(WHOLE(normal_texture, 0))};
    edit(&scene, &op, 1); // its first texture as a normal map too
    const struct bd_primitive_source source = {.vertex_count = COUNT,
                                               .positions = positions,
                                               .normals = normals,
                                               .tangents = tangents,
                                               .uv = {uv}};
    struct bd_err_detail detail = {0};
    struct bd_mesh *mesh;
    assert_int_equal(bd_edit_build_mesh(&source, 1, "mesh", &mesh, &detail), BD_ERR_OK);
    add_mesh(&scene, mesh);
    struct round_trip trip = round_trip_of(scene);
    const struct bd_mesh *after = trip.scene->meshes[trip.scene->mesh_count - 1];
    assert_non_null(after->primitives[0].tangent);
    assert_memory_equal(scene->meshes[scene->mesh_count - 1]->sha256, after->sha256, 32);
    end_round_trip(&trip);
    bd_scene_release(&scene);
}

static void collapsed_triangles_go(void **state)
{
    (void)state;
    struct bd_scene *scene = load(own_scenes, "two_lights.glb");
    const struct bd_mesh *mesh = scene->meshes[0];
    const uint32_t count = mesh->primitives[0].vertex_count;
    float *positions = calloc(3 * count, sizeof *positions);
    memcpy(positions, mesh->primitives[0].position, 3 * count * sizeof *positions);
    for (int c = 0; c < 3; c++) // the first triangle becomes a point
        memcpy(positions + 3 * mesh->primitives[0].index[c],
               positions + 3 * mesh->primitives[0].index[0], 3 * sizeof *positions);
    struct bd_mesh *moved;
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_edit_deform_mesh(mesh, 0, positions, NULL, count, "mesh", &moved, &detail),
                     BD_ERR_OK);
    const struct bd_edit_op op = {
        .kind = BD_EDIT_SET_MESH_VERTICES, .id = 0, .mesh = {.mesh = moved}};
    edit(&scene, &op, 1);
    struct round_trip trip = round_trip_of(scene);
    assert_true(has_note(&trip.notes, "left_out_degenerate_triangles"));
    end_round_trip(&trip);
    assert_settles(scene);
    bd_mesh_release(&moved);
    free(positions);
    bd_scene_release(&scene);
}

// What skins were baked to ignores its node: in the file it hangs on a root of its own.
static void world_space_meshes_get_a_root(void **state)
{
    (void)state;
    const struct bd_scene_counts none = {0};
    struct bd_err_detail detail = {0};
    struct bd_scene *base = load(own_scenes, "cornell.glb");
    uint32_t at = 0;
    while (base->nodes[at].mesh == BD_NONE) at++;
    struct bd_scene *scene = bd_scene_copy(base, &none);
    scene->nodes[at].parent_from_node.m[12] = 5;
    scene->nodes[at].mesh_is_world_space = true;
    assert_int_equal(bd_scene_finish(scene, &detail), BD_ERR_OK);
    bd_scene_set_hash(scene);
    struct round_trip trip = round_trip_of(scene);
    assert_string_equal(trip.notes.text[0], "world_space_meshes_moved: 1");
    assert_int_equal(trip.scene->node_count, base->node_count + 1);
    assert_int_equal(trip.scene->nodes[at].mesh, BD_NONE);
    assert_int_equal(trip.scene->nodes[base->node_count].mesh, base->nodes[at].mesh);
    end_round_trip(&trip);
    assert_settles(scene);
    bd_scene_release(&scene), bd_scene_release(&base);
}

// glTF has none: an extension of ours, read by our importer alone.
static void environments_come_back(void **state)
{
    (void)state;
    struct bd_scene *scene = load(own_scenes, "two_lights.glb");
    struct bd_edit_op op = {.kind = BD_EDIT_SET_ENVIRONMENT,
                            .environment = {.radiance = {0.1, 0, 3e29}}};
    edit(&scene, &op, 1);
    assert_identity(scene);
    struct bd_sky_map *map = calloc(1, sizeof *map);
    *map = (struct bd_sky_map){.reference_count = 1, .width_px = 7, .height_px = 3};
    map->rgb = malloc(3 * 7 * 3 * sizeof *map->rgb);
    for (int i = 0; i < 3 * 7 * 3; i++) map->rgb[i] = (float)exp(60 * random_real() - 30);
    bd_sky_map_seal(map);
    op.environment.map = map;
    edit(&scene, &op, 1);
    bd_sky_map_release(&map);
    assert_identity(scene);
    assert_settles(scene);
    struct round_trip trip = round_trip_of(scene);
    assert_memory_equal(trip.scene->environment.map->sha256, scene->environment.map->sha256, 32);
    end_round_trip(&trip);
    bd_scene_release(&scene);
}

static void assert_refused(const char *extension, const char *field)
{
    char text[512];
    snprintf(
        text, sizeof text,
        "{\"asset\":{\"version\":\"2.0\"},\"scenes\":[{}],\"extensions\":{\"BOUNCED_environment\":%"
        "s},"
        "\"buffers\":[{\"byteLength\":24,\"uri\":\"data:application/octet-stream;base64,"
        "AACAvwAAAAAAAAAAAAAAAAAAAAAAAAAA\"}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":24}],"
        "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":2,\"type\":\"VEC3\"}]}",
        extension);
    const struct bd_import_file input = {"sky.gltf", text, strlen(text)};
    struct bd_scene *scene = NULL;
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_gltf_read(&input, 1, &bd_import_default_limits, &scene, &detail),
                     BD_ERR_BAD_INPUT);
    if (!strstr(detail.field, field))
        fail_msg("%s: %s: %s", extension, detail.field, detail.message);
}

static void strange_environments_are_refused(void **state)
{
    (void)state;
    assert_refused("7", "BOUNCED_environment");
    assert_refused("{}", "BOUNCED_environment");
    assert_refused("{\"radiance\":[1,2]}", "BOUNCED_environment.radiance");
    assert_refused("{\"radiance\":[1,-2,3]}", "BOUNCED_environment.radiance");
    assert_refused("{\"radiance\":[1,1e39,3]}", "BOUNCED_environment.radiance");
#define MAP(text) "{\"radiance\":[1,1,1],\"map\":" text "}"
    assert_refused(MAP("{}"), "BOUNCED_environment.map");
    assert_refused(MAP("{\"accessor\":1,\"width\":2,\"height\":1}"), "BOUNCED_environment.map");
    assert_refused(MAP("{\"accessor\":0,\"width\":0,\"height\":1}"), "BOUNCED_environment.map");
    assert_refused(MAP("{\"accessor\":0,\"width\":2,\"height\":2}"), "BOUNCED_environment.map");
    assert_refused(MAP("{\"accessor\":0,\"width\":9000,\"height\":1}"), "BOUNCED_environment.map");
    // The first texel's red is -1.
    assert_refused(MAP("{\"accessor\":0,\"width\":2,\"height\":1}"), "BOUNCED_environment.map");
#undef MAP
}

static void empty_scenes_come_back(void **state)
{
    (void)state;
    struct bd_err_detail detail = {0};
    struct bd_scene *scene = bd_scene_create();
    assert_int_equal(bd_scene_finish(scene, &detail), BD_ERR_OK);
    bd_scene_set_hash(scene);
    assert_identity(scene);
    bd_scene_release(&scene);
}

// --- numbers --------------------------------------------------------------------------------

static void assert_transform_comes_back(const struct bd_gltf_uv_transform *in)
{
    float before[6], after[6];
    bd_gltf_uv_matrix(in->offset, in->rotation, in->scale, before);
    const struct bd_gltf_uv_transform out = bd_gltf_uv_transform_of(before);
    bd_gltf_uv_matrix(out.offset, out.rotation, out.scale, after);
    for (int i = 0; i < 6; i++)
        if (before[i] != after[i])
            fail_msg("rotation %.17g scale %.17g %.17g: entry %d was %.9g, is %.9g", in->rotation,
                     in->scale[0], in->scale[1], i, (double)before[i], (double)after[i]);
}

static void texture_transforms_come_back(void **state)
{
    (void)state;
    const double half_pi = 1.57079632679489661923;
    const double rotations[] = {0, half_pi, -half_pi, 2 * half_pi, 0.5, -3, 1e-7, 100};
    const double scales[] = {1, -1, 0.7, -3, 1e-6, 4096, 0};
    for (size_t r = 0; r < 8; r++)
        for (size_t x = 0; x < 7; x++)
            for (size_t y = 0; y < 7; y++)
                assert_transform_comes_back(&(struct bd_gltf_uv_transform){
                    {0.25, -7}, rotations[r], {scales[x], scales[y]}});
    for (int i = 0; i < 20000; i++)
        assert_transform_comes_back(
            &(struct bd_gltf_uv_transform){{random_real(), random_real()},
                                           8 * random_real() - 4,
                                           {4 * random_real() - 2, exp(8 * random_real() - 4)}});
}

static void numbers_are_short_and_exact(void **state)
{
    (void)state;
    static const struct {
        float value;
        const char *text;
    } floats[] = {{0, "0"},
                  {-0.0f, "-0.0"},
                  {0.1f, "0.1"},
                  {1, "1"},
                  {1e30f, "1e+30"},
                  {FLT_MAX, "3.4028235e+38"},
                  {1e-45f, "1.4013e-45"}};
    for (size_t i = 0; i < sizeof floats / sizeof floats[0]; i++) {
        struct bd_gltf_json json = {0};
        bd_gltf_json_f32(&json, NULL, floats[i].value);
        assert_int_equal(json.text.size_bytes, strlen(floats[i].text));
        assert_memory_equal(json.text.data, floats[i].text, json.text.size_bytes);
        bd_bytes_finish(&json.text);
    }
    for (int i = 0; i < 20000; i++) {
        struct bd_gltf_json json = {0};
        const double value = (random_real() - 0.5) * exp(300 * random_real() - 150);
        bd_gltf_json_open(&json, NULL, '[');
        bd_gltf_json_f64(&json, NULL, value);
        bd_gltf_json_f32(&json, NULL, (float)random_real());
        assert_int_equal(bd_bytes_put(&json.text, json.text.size_bytes, "", 1), BD_ERR_OK);
        assert_true(strtod((const char *)json.text.data + 1, NULL) == value);
        bd_bytes_finish(&json.text);
    }
}

// Emission is a factor times a strength in the file, and one number here.
static void emission_comes_back(void **state)
{
    (void)state;
    struct bd_err_detail detail = {0};
    struct bd_scene *scene = bd_scene_create();
    scene->material_count = 5000;
    scene->materials = calloc(scene->material_count, sizeof *scene->materials);
    for (uint32_t i = 0; i < scene->material_count; i++) {
        struct bd_material *material = &scene->materials[i];
        *material = bd_material_removed;
        material->is_removed = false;
        struct bd_texture_ref *refs[] = {&material->base_color_map,
                                         &material->metallic_roughness_map, &material->normal_map,
                                         &material->emissive_map, &material->transmission_map};
        for (int r = 0; r < 5; r++) refs[r]->uv_transform[0] = refs[r]->uv_transform[4] = 1;
        material->normal_scale = 1;
        material->ior = 1.5f;
        material->attenuation_distance_m = INFINITY;
        for (int c = 0; c < 3; c++) {
            material->attenuation_color[c] = 1;
            material->emissive[c] = (float)exp(60 * random_real() - 10);
        }
    }
    assert_int_equal(bd_scene_finish(scene, &detail), BD_ERR_OK);
    bd_scene_set_hash(scene);
    assert_identity(scene);
    bd_scene_release(&scene);
}

static void text_that_is_no_utf8_is_replaced(void **state)
{
    (void)state;
    static const char *const broken[] = {"a\xff", "\xc0\x80", "\xed\xa0\x80", "\xf4\x90\x80\x80",
                                         "cut \xe2\x82"};
    struct bd_scene *scene = load(own_scenes, "two_lights.glb");
    for (size_t i = 0; i < sizeof broken / sizeof broken[0]; i++) {
        snprintf(scene->nodes[0].name, sizeof scene->nodes[0].name, "%s", broken[i]);
        struct round_trip trip = round_trip_of(scene);
        assert_non_null(strstr(trip.scene->nodes[0].name, "\xef\xbf\xbd"));
        end_round_trip(&trip);
    }
    bd_scene_release(&scene);
}

static void what_is_too_large_is_refused(void **state)
{
    (void)state;
    struct bd_scene *scene = load(own_scenes, "cornell.glb");
    struct bd_bytes file = {0};
    struct bd_scene_flags notes = {0};
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_gltf_write(scene, BD_GLB_BYTES_MAX, &file, &notes, &detail), BD_ERR_OK);
    const uint64_t size = file.size_bytes;
    bd_bytes_finish(&file);
    assert_int_equal(bd_gltf_write(scene, size, &file, &notes, &detail), BD_ERR_OK);
    bd_bytes_finish(&file);
    assert_int_equal(bd_gltf_write(scene, size - 1, &file, &notes, &detail), BD_ERR_LIMIT);
    assert_null(file.data);
    assert_string_equal(detail.field, "scene");
    assert_null(strchr(detail.message, '\n'));
    bd_scene_release(&scene);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bundled_scenes_come_back),
        cmocka_unit_test(edited_scenes_come_back),
        cmocka_unit_test(cameras_come_back),
        cmocka_unit_test(removed_and_hidden_objects_are_not_told),
        cmocka_unit_test(unused_vertices_go),
        cmocka_unit_test(maps_that_do_not_show_are_split_off),
        cmocka_unit_test(tangents_without_a_map_go),
        cmocka_unit_test(normals_and_tangents_come_back),
        cmocka_unit_test(collapsed_triangles_go),
        cmocka_unit_test(world_space_meshes_get_a_root),
        cmocka_unit_test(environments_come_back),
        cmocka_unit_test(strange_environments_are_refused),
        cmocka_unit_test(empty_scenes_come_back),
        cmocka_unit_test(texture_transforms_come_back),
        cmocka_unit_test(numbers_are_short_and_exact),
        cmocka_unit_test(emission_comes_back),
        cmocka_unit_test(text_that_is_no_utf8_is_replaced),
        cmocka_unit_test(what_is_too_large_is_refused),
    };
    if (argc < 2) return 2;
    own_scenes = argv[1];
    return cmocka_run_group_tests(tests, NULL, NULL);
}
