// Every form of accessor and primitive ends as the same triangles.

#include <math.h>
#include <stdio.h>

#include "tests/unit/scene/read_text.h"

#define HEAD                                                                                       \
    "{'asset':{'version':'2.0'},'scene':0,'scenes':[{'nodes':[0]}],'nodes':[{'mesh':0}],"          \
    "'buffers':[{'uri':'b.bin','byteLength':"
#define F32(offset, count, shape)                                                                  \
    "{'bufferView':0,'byteOffset':" #offset ",'componentType':5126,'count':" #count                \
    ",'type':'" shape "'}"

static const struct bd_primitive *only_primitive(const struct bd_scene *scene)
{
    assert_int_equal(scene->instance_count, 1);
    const struct bd_mesh *mesh = scene->meshes[scene->instances[0].mesh];
    assert_int_equal(mesh->primitive_count, 1);
    return &mesh->primitives[0];
}

static void assert_corner(const struct bd_primitive *primitive, uint32_t corner, float x, float y,
                          float z)
{
    const float *p = primitive->position + 3 * (size_t)primitive->index[corner];
    assert_float_equal(p[0], x, 1e-6);
    assert_float_equal(p[1], y, 1e-6);
    assert_float_equal(p[2], z, 1e-6);
}

static const float square[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};

static void strips_and_fans_wind_as_specified(void **state)
{
    (void)state;
    static const char strip[] =
        HEAD "48}],'bufferViews':[{'buffer':0,'byteLength':48}],'accessors':[" F32(
            0, 4, "VEC3") "],'meshes':[{'primitives':[{'mode':5,'attributes':{'POSITION':0}}]}]}";
    struct bd_scene *scene = read_text(strip, square, sizeof square);
    const struct bd_primitive *primitive = only_primitive(scene);
    assert_int_equal(primitive->index_count, 6);
    // Both triangles face +z: the second one swaps its first two corners.
    for (uint32_t v = 0; v < primitive->vertex_count; v++)
        assert_float_equal(primitive->normal[3 * v + 2], 1, 1e-6);
    bd_scene_release(&scene);

    static const float fan_points[] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
    static const char fan[] =
        HEAD "48}],'bufferViews':[{'buffer':0,'byteLength':48}],'accessors':[" F32(
            0, 4, "VEC3") "],'meshes':[{'primitives':[{'mode':6,'attributes':{'POSITION':0}}]}]}";
    scene = read_text(fan, fan_points, sizeof fan_points);
    primitive = only_primitive(scene);
    assert_int_equal(primitive->index_count, 6);
    for (uint32_t v = 0; v < primitive->vertex_count; v++)
        assert_float_equal(primitive->normal[3 * v + 2], 1, 1e-6);
    bd_scene_release(&scene);
}

// Both triangles of a strip that faces +z, with normals of which `up` at the front look that way.
static void assert_against(unsigned up, const char *flag)
{
    static const char strip[] =
        HEAD "96}],'bufferViews':[{'buffer':0,'byteLength':96}],'accessors':[" F32(
            0, 4, "VEC3") "," F32(48, 4, "VEC3") "],'meshes':[{'primitives':[{'mode':5,"
                                                 "'attributes':{'POSITION':0,'NORMAL':1}}]}]}";
    float bin[24] = {0};
    memcpy(bin, square, sizeof square);
    for (unsigned v = 0; v < 4; v++) bin[12 + 3 * v + 2] = v < up ? 1 : -1;
    struct bd_scene *scene = read_text(strip, bin, sizeof bin);
    bool is_said = false;
    for (uint32_t i = 0; i < scene->flags.count; i++)
        is_said |= strcmp(scene->flags.text[i], flag) == 0;
    if (is_said != (up < 2)) fail_msg("%u: %s", up, scene->flags.count ? scene->flags.text[0] : "");
    assert_int_equal(bd_mesh_count_against_winding(scene->meshes[0]), up < 2 ? 2 - up : 0);
    // They are said, and not turned.
    assert_float_equal(only_primitive(scene)->normal[11], up == 4 ? 1 : -1, 0);
    bd_scene_release(&scene);
}

static void normals_against_their_winding_are_counted(void **state)
{
    (void)state;
    assert_against(0, "normals_against_winding: 2");
    assert_against(1, "normals_against_winding: 1");
    for (unsigned up = 2; up <= 4; up++) assert_against(up, "normals_against_winding: 1");
}

// Two vertices apart by 20 bytes, with the colour in between, and 8-bit indices after them.
static void interleaved_normalised_and_small_indices(void **state)
{
    (void)state;
    struct {
        float position[3];
        uint8_t color[4];
        int16_t uv[2];
    } vertex[3] = {{{0, 0, 0}, {255, 0, 0, 255}, {0, 0}},
                   {{1, 0, 0}, {0, 51, 0, 255}, {32767, 0}},
                   {{0, 1, 0}, {0, 0, 255, 0}, {0, -32768}}};
    uint8_t bin[sizeof vertex + 4];
    memcpy(bin, vertex, sizeof vertex);
    memcpy(bin + sizeof vertex, "\x02\x01\x00\x00", 4);
    static const char text[] =
        HEAD "64}],'bufferViews':[{'buffer':0,'byteLength':60,'byteStride':20},"
             "{'buffer':0,'byteOffset':60,'byteLength':3}],'accessors':["
             "{'bufferView':0,'componentType':5126,'count':3,'type':'VEC3'},"
             "{'bufferView':0,'byteOffset':12,'componentType':5121,'normalized':true,'count':3,"
             "'type':'VEC4'},"
             "{'bufferView':0,'byteOffset':16,'componentType':5122,'normalized':true,'count':3,"
             "'type':'VEC2'},"
             "{'bufferView':1,'componentType':5121,'count':3,'type':'SCALAR'}],"
             "'meshes':[{'primitives':[{'indices':3,'attributes':"
             "{'POSITION':0,'COLOR_0':1,'TEXCOORD_0':2}}]}]}";
    struct bd_scene *scene = read_text(text, bin, sizeof bin);
    const struct bd_primitive *primitive = only_primitive(scene);
    assert_corner(primitive, 0, 0, 1, 0);
    assert_corner(primitive, 1, 1, 0, 0);
    assert_corner(primitive, 2, 0, 0, 0);
    uint32_t second = primitive->index[1], first = primitive->index[0];
    assert_float_equal(primitive->color[4 * second + 1], 0.2f, 1e-6);
    assert_float_equal(primitive->uv[0][2 * second], 1, 1e-6);
    assert_float_equal(primitive->uv[0][2 * first + 1], -1, 1e-6);
    assert_true(scene->features.has_vertex_color);
    bd_scene_release(&scene);
}

static void sparse_overrides_elements(void **state)
{
    (void)state;
    struct {
        float base[9];
        uint16_t index[2];
        float values[3];
    } bin = {{0, 0, 0, 1, 0, 0, 0, 1, 0}, {1, 0}, {5, 6, 7}};
    static const char text[] =
        HEAD "52}],'bufferViews':[{'buffer':0,'byteLength':36},"
             "{'buffer':0,'byteOffset':36,'byteLength':2},"
             "{'buffer':0,'byteOffset':40,'byteLength':12}],'accessors':["
             "{'bufferView':0,'componentType':5126,'count':3,'type':'VEC3','sparse':{'count':1,"
             "'indices':{'bufferView':1,'componentType':5123},'values':{'bufferView':2}}}],"
             "'meshes':[{'primitives':[{'attributes':{'POSITION':0}}]}]}";
    struct bd_scene *scene = read_text(text, &bin, sizeof bin);
    const struct bd_primitive *primitive = only_primitive(scene);
    assert_corner(primitive, 0, 0, 0, 0);
    assert_corner(primitive, 1, 5, 6, 7);
    bd_scene_release(&scene);
    bin.index[0] = 3;
    assert_refused(text, &bin, sizeof bin, BD_ERR_BAD_INPUT, "accessors[0].sparse.indices");
}

#define ONE_TRIANGLE(accessors, attributes)                                                        \
    HEAD "36}],'bufferViews':[{'buffer':0,'byteLength':36}],'accessors':[" accessors               \
         "],'meshes':[{'primitives':[{'attributes':{" attributes "}}]}]}"

static void bounds_are_exact(void **state)
{
    (void)state;
    static const float triangle[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    struct bd_scene *scene =
        read_text(ONE_TRIANGLE(F32(0, 3, "VEC3"), "'POSITION':0"), triangle, sizeof triangle);
    assert_int_equal(scene->features.triangle_count, 1);
    bd_scene_release(&scene);
    const char *too_long[] = {
        ONE_TRIANGLE(F32(4, 3, "VEC3"), "'POSITION':0"),
        ONE_TRIANGLE(F32(0, 4, "VEC3"), "'POSITION':0"),
        ONE_TRIANGLE(F32(36, 1, "VEC3"), "'POSITION':0"),
        ONE_TRIANGLE(F32(4294967292, 3, "VEC3"), "'POSITION':0"),
        ONE_TRIANGLE(F32(9007199254740992, 2, "VEC3"), "'POSITION':0"),
        ONE_TRIANGLE(F32(0, 1431655766, "VEC3"), "'POSITION':0"),
    };
    for (size_t i = 0; i < sizeof too_long / sizeof too_long[0]; i++)
        assert_refused(too_long[i], triangle, sizeof triangle, BD_ERR_BAD_INPUT, "accessors[0]");
    assert_refused(ONE_TRIANGLE(F32(0, 3, "VEC3"), "'POSITION':1"), triangle, sizeof triangle,
                   BD_ERR_BAD_INPUT, "meshes[0].primitives[0].attributes.POSITION");
    assert_refused(ONE_TRIANGLE(F32(0, 4, "VEC2"), "'POSITION':0"), triangle, sizeof triangle,
                   BD_ERR_BAD_INPUT, "meshes[0].primitives[0].attributes.POSITION");
    // Zeros without a view cost nothing in the file, so their number is limited.
    assert_refused(
        ONE_TRIANGLE("{'componentType':5126,'count':2000000000,'type':'VEC3'}", "'POSITION':0"),
        triangle, sizeof triangle, BD_ERR_LIMIT, "accessors[0].count");
}

// Hazards 19 and 20: the good triangle is what is left, and nothing of the scene is a NaN.
static void broken_triangles_go(void **state)
{
    (void)state;
    float p[] = {0, 0, 0, 1, 0, 0, 0, 1, 0,        0, 0, 0, 1, 0, 0, 2, 0,   0,
                 0, 0, 0, 1, 0, 0, 0, 1, INFINITY, 0, 0, 0, 1, 0, 0, 0, NAN, 0};
    static const char text[] =
        HEAD "144}],'bufferViews':[{'buffer':0,'byteLength':144}],'accessors':[" F32(
            0, 12, "VEC3") "],'meshes':[{'primitives':[{'attributes':{'POSITION':0}}]}]}";
    struct bd_scene *scene = read_text(text, p, sizeof p);
    const struct bd_primitive *primitive = only_primitive(scene);
    assert_int_equal(primitive->index_count, 3);
    assert_corner(primitive, 1, 1, 0, 0);
    for (uint32_t i = 0; i < 3 * primitive->vertex_count; i++)
        assert_true(isfinite(primitive->position[i]));
    assert_true(has_flag(scene, "nonfinite_vertices: 2"));
    assert_true(has_flag(scene, "degenerate_triangles: 1"));
    assert_float_equal(scene->features.bounds_max.x, 1, 0);
    bd_scene_release(&scene);
}

// Hazard 21: ten times too long, zero, and not a number at all.
static void normals_are_repaired(void **state)
{
    (void)state;
    static const float bin[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 10, 0, 0, 0, NAN, 0, 0};
    static const char text[] =
        HEAD "72}],'bufferViews':[{'buffer':0,'byteLength':72}],'accessors':[" F32(
            0, 3, "VEC3") "," F32(36, 3, "VEC3") "],'meshes':[{'primitives':[{'attributes':"
                                                 "{'POSITION':0,'NORMAL':1}}]}]}";
    struct bd_scene *scene = read_text(text, bin, sizeof bin);
    const struct bd_primitive *primitive = only_primitive(scene);
    for (uint32_t v = 0; v < 3; v++) {
        assert_float_equal(primitive->normal[3 * v], 0, 1e-6);
        assert_float_equal(primitive->normal[3 * v + 2], 1, 1e-6);
    }
    assert_true(has_flag(scene, "repaired_normals: 3"));
    bd_scene_release(&scene);
}

// A square whose picture lies upright: u to the right, v down. The tangent is +x and the
// bitangent, cross(normal, tangent) * w, points up the picture.
static void tangents_follow_the_map(void **state)
{
    (void)state;
    static const float bin[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 1, 1, 1, 0, 0, 1, 0};
    static const char text[] = HEAD
        "80}],'bufferViews':[{'buffer':0,'byteLength':80}],'accessors':[" F32(0, 4, "VEC3") "," F32(
            48, 4,
            "VEC2") "],'images':[{'uri':'data:image/"
                    "png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1Pe"
                    "AAAADElEQVQYV2P4z/AfAAQAAf+I0P3MAAAAAElFTkSuQmCC'}],'textures':[{'source':0}],"
                    "'materials':[{'normalTexture':{'index':0}}],'meshes':[{'primitives':[{'mode':"
                    "5,"
                    "'material':0,'attributes':{'POSITION':0,'TEXCOORD_0':1}}]}]}";
    struct bd_scene *scene = read_text(text, bin, sizeof bin);
    const struct bd_primitive *primitive = only_primitive(scene);
    assert_int_equal(scene->picture_count, 1);
    assert_non_null(primitive->tangent);
    for (uint32_t v = 0; v < primitive->vertex_count; v++) {
        assert_float_equal(primitive->tangent[4 * v], 1, 1e-6);
        assert_float_equal(primitive->tangent[4 * v + 1], 0, 1e-6);
        assert_float_equal(primitive->tangent[4 * v + 3], 1, 0);
    }
    bd_scene_release(&scene);
}

static void weights_move_the_default_pose(void **state)
{
    (void)state;
    static const float bin[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 4, 0, 0, 4, 0, 0, 4};
    static const char text[] =
        HEAD "72}],'bufferViews':[{'buffer':0,'byteLength':72}],'accessors':[" F32(
            0, 3, "VEC3") "," F32(36, 3, "VEC3") "],'meshes':[{'weights':[0.25],'primitives':["
                                                 "{'attributes':{'POSITION':0},'targets':"
                                                 "[{'POSITION':1}]}]}]}";
    struct bd_scene *scene = read_text(text, bin, sizeof bin);
    assert_corner(only_primitive(scene), 1, 1, 0, 1);
    bd_scene_release(&scene);
}

// One joint, turned a quarter about z and moved; the node's own transform does not count.
static void skins_are_posed_in_the_world(void **state)
{
    (void)state;
    struct {
        float position[9];
        uint8_t joints[12];
        float weights[12];
    } bin = {{0, 0, 0, 1, 0, 0, 0, 1, 0}, {0}, {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}};
    static const char text[] =
        "{'asset':{'version':'2.0'},'scenes':[{'nodes':[0,1]}],'nodes':[{'mesh':0,'skin':0,"
        "'translation':[100,0,0]},{'translation':[0,0,3],'rotation':[0,0,0.70710678,0.70710678]}],"
        "'skins':[{'joints':[1]}],'buffers':[{'uri':'b.bin','byteLength':96}],"
        "'bufferViews':[{'buffer':0,'byteLength':96}],'accessors':[" F32(
            0, 3, "VEC3") ",{'bufferView':0,'byteOffset':36,'componentType':5121,'count':3,'type':'"
                          "VEC4'}," F32(48, 3, "VEC4") "],'meshes':[{'primitives':[{'attributes':{'"
                                                       "POSITION':0,'JOINTS_0':1,"
                                                       "'WEIGHTS_0':2}}]}]}";
    struct bd_scene *scene = read_text(text, &bin, sizeof bin);
    const struct bd_primitive *primitive = only_primitive(scene);
    assert_corner(primitive, 1, 0, 1, 3);
    assert_corner(primitive, 2, -1, 0, 3);
    assert_true(scene->nodes[0].mesh_is_world_space);
    assert_float_equal(scene->instances[0].world_from_mesh.m[12], 0, 0);
    bd_scene_release(&scene);
}

// 45 degrees and half the size: u' = (u + v) / 2 sqrt(2) + 0.5 (see gltf_materials.c).
static void texture_transforms_and_sets(void **state)
{
    (void)state;
    static const float triangle[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    static const char text[] =
        HEAD "36}],'bufferViews':[{'buffer':0,'byteLength':36}],'accessors':[" F32(
            0, 3, "VEC3") "],'images':[{'uri':'data:image/"
                          "png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1Pe"
                          "AAAADElEQVQYV2P4z/"
                          "AfAAQAAf+I0P3MAAAAAElFTkSuQmCC'}],'samplers':[{'wrapS':33071,"
                          "'wrapT':33648,'magFilter':9728}],'textures':[{'source':0,'sampler':0}],'"
                          "materials':[{"
                          "'pbrMetallicRoughness':{'metallicFactor':2,'baseColorTexture':{'index':"
                          "0,'texCoord':3,"
                          "'extensions':{'KHR_texture_transform':{'offset':[0.5,0],'rotation':0."
                          "785398163,"
                          "'scale':[0.5,0.5]}}}},'emissiveTexture':{'index':0,'texCoord':1}}],"
                          "'meshes':[{'primitives':[{'material':0,'attributes':{'POSITION':0}}]}]}";
    struct bd_scene *scene = read_text(text, triangle, sizeof triangle);
    const struct bd_material *material = &scene->materials[0];
    const float *m = material->base_color_map.uv_transform;
    assert_float_equal(m[0], 0.35355339f, 1e-6);
    assert_float_equal(m[1], 0.35355339f, 1e-6);
    assert_float_equal(m[2], 0.5f, 1e-6);
    assert_float_equal(m[3], -0.35355339f, 1e-6);
    // TEXCOORD_3 takes the place of set 0, which nobody uses.
    assert_int_equal(material->base_color_map.uv_set, 0);
    assert_int_equal(material->emissive_map.uv_set, 1);
    assert_float_equal(material->metallic, 1, 0);
    assert_int_equal(scene->textures[0].wrap_s, BD_WRAP_CLAMP);
    assert_int_equal(scene->textures[0].wrap_t, BD_WRAP_MIRROR);
    assert_true(scene->textures[0].nearest);
    assert_true(has_flag(scene, "clamped_factors: 1"));
    assert_true(has_flag(scene, "missing_texcoords: 2"));
    bd_scene_release(&scene);
}

// What a camera's plane, magnification and a light's range may be, as edits have it.
static void cameras_and_lights_out_of_range(void **state)
{
    (void)state;
    static const char text[] =
        "{'asset':{'version':'2.0'},'extensionsUsed':['KHR_lights_punctual'],'extensions':{"
        "'KHR_lights_punctual':{'lights':[{'type':'point','range':1e18}]}},'cameras':["
        "{'type':'perspective','perspective':{'yfov':1,'znear':1e18,'zfar':1e30}},"
        "{'type':'perspective','perspective':{'yfov':1,'znear':1e-3,'zfar':1e30}},"
        "{'type':'orthographic','orthographic':{'xmag':1e18,'ymag':2,'znear':1e300,'zfar':2}},"
        "{'type':'orthographic','orthographic':{'xmag':1,'ymag':1,'znear':0,'zfar':1e300}}],"
        "'nodes':[{'camera':0},{'extensions':{'KHR_lights_punctual':{'light':0}}}]}";
    struct bd_scene *scene = read_text(text, NULL, 0);
    const struct bd_camera *cameras = scene->cameras;
    const float most_m = (float)BD_COORDINATE_MAX_M;
    assert_true(cameras[0].near_m == most_m && isinf(cameras[0].far_m));
    assert_true(cameras[1].near_m == 1e-3f && isinf(cameras[1].far_m));
    assert_true(cameras[2].xmag == 1 && cameras[2].ymag == 2);
    assert_true(cameras[2].near_m == most_m && isinf(cameras[2].far_m));
    assert_true(cameras[3].near_m == 0 && isinf(cameras[3].far_m));
    assert_true(isinf(scene->lights[0].range_m));
    assert_true(has_flag(scene, "repaired_cameras: 2"));
    bd_scene_release(&scene);
}

// Two primitives share one list of six vertices; each keeps the three that it uses.
static void shared_vertex_lists_are_split(void **state)
{
    (void)state;
    struct {
        float position[18];
        uint8_t index[8];
    } bin = {{0, 0, 0, 1, 0, 0, 0, 1, 0, 5, 0, 0, 6, 0, 0, 5, 1, 0}, {5, 3, 4, 0, 1, 2, 0, 0}};
    static const char text[] =
        HEAD "80}],'bufferViews':[{'buffer':0,'byteLength':80}],'accessors':[" F32(
            0, 6, "VEC3") ",{'bufferView':0,'byteOffset':72,'componentType':5121,'count':3,"
                          "'type':'SCALAR'},{'bufferView':0,'byteOffset':75,'componentType':5121,"
                          "'count':3,'type':'SCALAR'}],'meshes':[{'primitives':["
                          "{'indices':1,'attributes':{'POSITION':0,'NORMAL':0}},"
                          "{'indices':2,'attributes':{'POSITION':0,'NORMAL':0}}]}]}";
    struct bd_scene *scene = read_text(text, &bin, sizeof bin);
    const struct bd_primitive *primitives = scene->meshes[0]->primitives;
    assert_int_equal(primitives[0].vertex_count, 3);
    assert_int_equal(primitives[1].vertex_count, 3);
    assert_corner(&primitives[0], 0, 5, 1, 0);
    assert_corner(&primitives[0], 1, 5, 0, 0);
    assert_corner(&primitives[1], 2, 0, 1, 0);
    bd_scene_release(&scene);
}

// Buffers come from the table and from nowhere else: percent-encoded or not, but never a path.
static void files_come_from_the_table(void **state)
{
    (void)state;
    static const float triangle[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    static const char *const uris[] = {"my%20file.bin",  "my file.bin", "/etc/passwd",
                                       "../my file.bin", "my%2",        "http://x/my file.bin"};
    for (size_t i = 0; i < sizeof uris / sizeof uris[0]; i++) {
        char text[1024];
        snprintf(text, sizeof text,
                 "{'asset':{'version':'2.0'},'nodes':[{'mesh':0}],'buffers':[{'uri':'%s',"
                 "'byteLength':36}],'bufferViews':[{'buffer':0,'byteLength':36}],'accessors':[" F32(
                     0, 3, "VEC3") "],'meshes':[{'primitives':[{'attributes':{'POSITION':0}}]}]}",
                 uris[i]);
        char *json = quoted(text);
        struct bd_import_file files[] = {{"t.gltf", json, strlen(json)},
                                         {"my file.bin", triangle, sizeof triangle}};
        struct bd_scene *scene;
        struct bd_err_detail detail = {0};
        enum bd_err err = bd_gltf_read(files, 2, &bd_import_default_limits, &scene, &detail);
        assert_int_equal(err, i < 2 ? BD_ERR_OK : BD_ERR_BAD_INPUT);
        if (err != BD_ERR_OK) assert_string_equal(detail.field, "buffers[0].uri");
        bd_scene_release(&scene);
        free(json);
    }
}

// Fifty buffers that name one file are fifty copies of it in the parser.
static void one_file_is_not_read_endlessly(void **state)
{
    (void)state;
    const size_t size = 1 << 20;
    char *text = malloc(8192), *at = text;
    void *large = calloc(1, size);
    assert_true(text && large);
    at += sprintf(at, "{'asset':{'version':'2.0'},'nodes':[{}],'buffers':[");
    for (int i = 0; i < 50; i++)
        at += sprintf(at, "%s{'uri':'b.bin','byteLength':%zu}", i ? "," : "", size);
    strcpy(at, "]}");
    struct bd_scene *scene;
    struct bd_err_detail detail;
    assert_int_equal(try_text(text, large, size, &scene, &detail), BD_ERR_BAD_INPUT);
    assert_memory_equal(detail.field, "buffers[", 8);
    assert_non_null(strstr(detail.message, "too many times"));
    free(large);
    free(text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(strips_and_fans_wind_as_specified),
        cmocka_unit_test(normals_against_their_winding_are_counted),
        cmocka_unit_test(interleaved_normalised_and_small_indices),
        cmocka_unit_test(sparse_overrides_elements),
        cmocka_unit_test(bounds_are_exact),
        cmocka_unit_test(broken_triangles_go),
        cmocka_unit_test(normals_are_repaired),
        cmocka_unit_test(tangents_follow_the_map),
        cmocka_unit_test(weights_move_the_default_pose),
        cmocka_unit_test(skins_are_posed_in_the_world),
        cmocka_unit_test(texture_transforms_and_sets),
        cmocka_unit_test(shared_vertex_lists_are_split),
        cmocka_unit_test(files_come_from_the_table),
        cmocka_unit_test(cameras_and_lights_out_of_range),
        cmocka_unit_test(one_file_is_not_read_endlessly),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
