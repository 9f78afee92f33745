// What bd_scene_finish derives.

#include <math.h>

#include "tests/unit/scene/read_text.h"

static const float cube_corner[] = {-1, -1, -1, 1, -1, -1, 1, 1, 1};

#define CORNERS                                                                                    \
    "'buffers':[{'uri':'b.bin','byteLength':36}],'bufferViews':[{'buffer':0,'byteLength':36}],"    \
    "'accessors':[{'bufferView':0,'componentType':5126,'count':3,'type':'VEC3'}],"
#define MESH                                                                                       \
    CORNERS                                                                                        \
    "'meshes':[{'primitives':[{'attributes':{'POSITION':0}}]}]}"
#define SCENE(nodes, roots)                                                                        \
    "{'asset':{'version':'2.0'},'scenes':[{'nodes':[" roots "]}],'nodes':[" nodes "],"             \
    "'cameras':[{'type':'perspective','name':'wide','perspective':{'yfov':1,'znear':0.1}},"        \
    "{'type':'orthographic','name':'7','orthographic':{'xmag':2,'ymag':3,'znear':0,'zfar':9}}],"   \
    "'extensions':{'KHR_lights_punctual':{'lights':[{'type':'spot','intensity':5,'spot':"          \
    "{'innerConeAngle':0.2,'outerConeAngle':0.4}}]}}," MESH

static struct bd_scene *finished(const char *text)
{
    return read_text(text, cube_corner, sizeof cube_corner);
}

static void assert_vec(bd_dvec3 v, double x, double y, double z)
{
    assert_true(fabs(v.x - x) < 1e-9 && fabs(v.y - y) < 1e-9 && fabs(v.z - z) < 1e-9);
}

static void assert_orthonormal(const struct bd_placement *placed)
{
    bd_dvec3 z = bd_dvec3_cross(placed->axis_x, placed->axis_y);
    assert_vec(bd_dvec3_sub(z, placed->axis_z), 0, 0, 0);
    assert_true(fabs(bd_dvec3_length(placed->axis_x) - 1) < 1e-9);
    assert_true(fabs(bd_dvec3_length(placed->axis_y) - 1) < 1e-9);
}

// A light in a group that mirrors z shines the other way; the axes stay right-handed. A sheared
// one (a stretched parent over a turned child) stays orthonormal and points where its z axis does.
static void placements_follow_the_matrix(void **state)
{
    (void)state;
    struct bd_scene *scene =
        finished(SCENE("{'scale':[1,1,-2],'translation':[1,2,3],'children':[1]},"
                       "{'translation':[0,0,1],'extensions':{'KHR_lights_punctual':{'light':0}}},"
                       "{'scale':[3,1,1],'children':[3]},"
                       "{'rotation':[0,0.382683432,0,0.923879533],'camera':0}",
                       "0,2"));
    assert_int_equal(scene->placed_light_count, 1);
    const struct bd_placement *light = &scene->placed_lights[0];
    assert_vec(light->position, 1, 2, 1);
    assert_vec(light->axis_z, 0, 0, -1);
    assert_orthonormal(light);
    const struct bd_placement *camera = &scene->placed_cameras[0];
    assert_orthonormal(camera);
    assert_vec(camera->axis_z, 3 / sqrt(10), 0, 1 / sqrt(10));
    assert_int_equal(scene->features.light_count[BD_LIGHT_SPOT], 1);
    double expected = 5 * 2 * 3.14159265358979 * ((1 - cos(0.2)) + (cos(0.2) - cos(0.4)) / 3);
    assert_true(fabs(scene->features.punctual_flux_lm / expected - 1) < 1e-5);
    bd_scene_release(&scene);
}

static void cameras_are_found_by_name(void **state)
{
    (void)state;
    struct bd_scene *scene =
        finished(SCENE("{'name':'Left','camera':0},{'name':'1','camera':1},{'camera':1}", "0,1,2"));
    assert_int_equal(bd_scene_find_camera(scene, ""), 0);
    assert_int_equal(bd_scene_find_camera(scene, "Left"), 0);
    assert_int_equal(bd_scene_find_camera(scene, "wide"), 0);
    assert_int_equal(bd_scene_find_camera(scene, "1"), 1); // a node's name before an index
    assert_int_equal(bd_scene_find_camera(scene, "7"), 1); // a camera's name before an index
    assert_int_equal(bd_scene_find_camera(scene, "2"), 2);
    assert_int_equal(bd_scene_find_camera(scene, "3"), BD_NONE);
    assert_int_equal(bd_scene_find_camera(scene, "4294967296"), BD_NONE);
    assert_int_equal(bd_scene_find_camera(scene, "0x"), BD_NONE);
    int32_t first;
    assert_int_equal(bd_scene_count_cameras(scene, "Left", &first), 1);
    assert_int_equal(bd_scene_count_cameras(scene, "7", &first), 2); // of two nodes without a name
    assert_int_equal(first, 1);
    assert_int_equal(bd_scene_count_cameras(scene, "2", &first), 0); // an index is no name
    bd_scene_release(&scene);
}

// Only what the scene shows counts: node 1 is in no scene.
static void features_count_what_is_shown(void **state)
{
    (void)state;
    struct bd_scene *scene =
        finished(SCENE("{'mesh':0,'translation':[10,0,0],'scale':[2,2,2]},{'mesh':0}", "0"));
    const struct bd_features *features = &scene->features;
    assert_int_equal(features->instance_count, 1);
    assert_int_equal(features->triangle_count, 1);
    assert_vec(features->bounds_min, 8, -2, -2);
    assert_vec(features->bounds_max, 12, 2, 2);
    assert_true(features->has_metal && features->has_single_sided && !features->has_mask);
    bd_scene_release(&scene);
}

static void collapsed_and_huge_instances_go(void **state)
{
    (void)state;
    struct bd_scene *scene = finished(
        SCENE("{'mesh':0,'scale':[0,0,0]},{'mesh':0,'scale':[1,0,1]},{'mesh':0,'scale':[1,0,0]},"
              "{'mesh':0,'scale':[1e200,1,1]},{'mesh':0,'camera':0,'translation':[1e300,0,0]}",
              "0,1,2,3,4"));
    assert_int_equal(scene->instance_count, 1);
    assert_int_equal(scene->instances[0].node, 1);
    assert_true(has_flag(scene, "collapsed_instances: 2"));
    assert_true(has_flag(scene, "instances_out_of_range: 2"));
    assert_true(has_flag(scene, "placements_out_of_range: 1"));
    assert_true(has_flag(scene, "default_camera"));
    bd_scene_release(&scene);
}

// The single-sided triangle looks down and to the front; mirrored in z, down and to the back, where
// a camera in front sees nothing of it.
static void default_camera_stands_where_something_shows(void **state)
{
    (void)state;
    struct bd_scene *scene = finished(SCENE("{'mesh':0}", "0"));
    assert_true(scene->placed_cameras[0].position.z > 0);
    bd_scene_release(&scene);
    scene = finished(SCENE("{'mesh':0,'scale':[1,1,-1]}", "0"));
    assert_true(scene->placed_cameras[0].position.z < 0);
    bd_scene_release(&scene);
}

// Every corner of the bounds is inside a square picture, and the picture is not mostly empty.
static void default_camera_frames_the_scene(void **state)
{
    (void)state;
    struct bd_scene *scene = finished(SCENE("{'mesh':0,'translation':[50,-20,7]}", "0"));
    assert_true(has_flag(scene, "default_camera"));
    assert_true(has_flag(scene, "default_lights"));
    const struct bd_placement *camera = &scene->placed_cameras[0];
    assert_int_equal(camera->node, BD_NONE);
    assert_orthonormal(camera);
    double half = tan(0.5 * (double)scene->cameras[camera->object].yfov), widest = 0;
    for (int corner = 0; corner < 8; corner++) {
        bd_dvec3 p = {50 + (corner & 1 ? 1 : -1), -20 + (corner & 2 ? 1 : -1),
                      7 + (corner & 4 ? 1 : -1)};
        bd_dvec3 d = bd_dvec3_sub(p, camera->position);
        double depth = -bd_dvec3_dot(d, camera->axis_z);
        assert_true(depth > (double)scene->cameras[camera->object].near_m);
        widest = fmax(widest, fabs(bd_dvec3_dot(d, camera->axis_x)) / depth / half);
        widest = fmax(widest, fabs(bd_dvec3_dot(d, camera->axis_y)) / depth / half);
    }
    assert_true(widest <= 1 && widest > 0.9);
    assert_int_equal(scene->placed_light_count, 2);
    assert_int_equal(scene->lights[scene->placed_lights[0].object].kind, BD_LIGHT_DIRECTIONAL);
    // The key light comes from above and from the camera's side.
    assert_true(scene->placed_lights[0].axis_z.y > 0.3);
    assert_true(bd_dvec3_dot(scene->placed_lights[0].axis_z, camera->axis_z) > 0.3);
    bd_scene_release(&scene);
}

#define GLOWING(emissive)                                                                          \
    "{'asset':{'version':'2.0'},'scenes':[{'nodes':[0]}],'nodes':[{'mesh':0}],"                    \
    "'materials':[{'emissiveFactor':" emissive                                                     \
    ",'emissiveTexture':{'index':0}}],'textures':[{}]," CORNERS                                    \
    "'meshes':[{'primitives':[{'attributes':{'POSITION':0},'material':0}]}]}"

// What emits lights instead of the default lights, for who is lit by it; a map that is black, as
// many files have, emits nothing.
static void the_default_lights_yield_to_what_emits(void **state)
{
    (void)state;
    struct bd_scene *scene = finished(GLOWING("[0,0,0]"));
    assert_false(bd_scene_lights_yield(scene, true, true));
    bd_scene_release(&scene);
    scene = finished(GLOWING("[0,2,0]"));
    assert_int_equal(scene->placed_light_count, 2);
    assert_true(bd_scene_lights_yield(scene, true, false));
    assert_false(bd_scene_lights_yield(scene, false, true));
    uint8_t black[2 * 4] = {0, 0, 0, 255, 0, 0, 0, 255};
    struct bd_picture picture = {.width_px = 2, .height_px = 1, .rgba = black};
    struct bd_picture *pictures[] = {&picture}, **const own = scene->pictures;
    scene->pictures = pictures;
    scene->textures[0].picture = 0;
    assert_false(bd_scene_lights_yield(scene, true, false));
    black[5] = 1;
    assert_true(bd_scene_lights_yield(scene, true, false));
    scene->textures[0].picture = BD_NONE;
    scene->pictures = own;
    bd_scene_release(&scene);
}

static void aspects_are_unique_in_the_process(void **state)
{
    (void)state;
    uint64_t last = 0;
    for (int i = 0; i < 3; i++) {
        struct bd_scene *scene = finished(SCENE("{}", "0"));
        for (size_t k = 0; k < BD_ASPECT_COUNT; k++) {
            assert_true(scene->aspects.counter[k] > last);
            last = scene->aspects.counter[k];
        }
        assert_float_equal(scene->features.diagonal_m, 1, 0); // nothing is shown
        bd_scene_release(&scene);
    }
}

static void flags_stop_when_full(void **state)
{
    (void)state;
    struct bd_scene *scene = bd_scene_create();
    for (int i = 0; i < BD_SCENE_FLAG_MAX + 5; i++) bd_scene_flag(scene, "flag: %d", i);
    assert_int_equal(scene->flags.count, BD_SCENE_FLAG_MAX);
    assert_string_equal(scene->flags.text[BD_SCENE_FLAG_MAX - 1], "flag: 23");
    struct bd_scene *second = bd_scene_retain(scene);
    bd_scene_release(&scene);
    assert_null(scene);
    assert_int_equal(second->reference_count, 1);
    bd_scene_release(&second);
}

// Which of two surfaces in one place is seen must not hang on the order of nodes in the file.
static void instances_are_ordered_by_content(void **state)
{
    (void)state;
    struct bd_scene *one = finished(
        SCENE("{'mesh':0,'translation':[1,0,0]},{'mesh':0},{'mesh':0,'scale':[2,2,2]}", "0,1,2"));
    struct bd_scene *other = finished(
        SCENE("{'mesh':0,'scale':[2,2,2]},{'mesh':0,'translation':[1,0,0]},{'mesh':0}", "0,1,2"));
    assert_int_equal(one->instance_count, 3);
    assert_int_equal(other->instance_count, 3);
    for (uint32_t i = 0; i < 3; i++)
        assert_memory_equal(&one->instances[i].world_from_mesh,
                            &other->instances[i].world_from_mesh,
                            sizeof one->instances[i].world_from_mesh);
    bd_scene_release(&one);
    bd_scene_release(&other);
}

// Light is added up in numbers that round: in which order must not hang on the file's.
static void lights_are_ordered_by_content(void **state)
{
    (void)state;
#define LIT(at) "{'translation':[" at "],'extensions':{'KHR_lights_punctual':{'light':0}}}"
    struct bd_scene *one = finished(SCENE(LIT("1,0,0") "," LIT("0,2,0") "," LIT("0,0,3"), "0,1,2"));
    struct bd_scene *other =
        finished(SCENE(LIT("0,0,3") "," LIT("1,0,0") "," LIT("0,2,0"), "0,1,2"));
#undef LIT
    assert_int_equal(one->placed_light_count, 3);
    assert_int_equal(other->placed_light_count, 3);
    for (uint32_t i = 0; i < 3; i++)
        assert_memory_equal(&one->placed_lights[i].position, &other->placed_lights[i].position,
                            sizeof one->placed_lights[i].position);
    bd_scene_release(&one);
    bd_scene_release(&other);
}

// Near the middle, and not at it: coordinates relative to it do not lie between two floats.
static void the_origin_is_no_round_place(void **state)
{
    (void)state;
    struct bd_scene *scene = finished(SCENE("{'mesh':0}", "0"));
    const struct bd_features *f = &scene->features;
    bd_dvec3 origin = bd_scene_origin_m(f);
    const double middle = 0.5 * (f->bounds_min.x + f->bounds_max.x);
    const double extent = f->bounds_max.x - f->bounds_min.x;
    assert_true(fabs(origin.x - middle) < 2e-3 * extent);
    double relative = (f->bounds_max.x - origin.x) / extent * 0x1p25;
    assert_true(fabs(relative - round(relative)) > 1e-3);
    bd_scene_release(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(placements_follow_the_matrix),
        cmocka_unit_test(cameras_are_found_by_name),
        cmocka_unit_test(features_count_what_is_shown),
        cmocka_unit_test(collapsed_and_huge_instances_go),
        cmocka_unit_test(default_camera_stands_where_something_shows),
        cmocka_unit_test(default_camera_frames_the_scene),
        cmocka_unit_test(the_default_lights_yield_to_what_emits),
        cmocka_unit_test(aspects_are_unique_in_the_process),
        cmocka_unit_test(flags_stop_when_full),
        cmocka_unit_test(instances_are_ordered_by_content),
        cmocka_unit_test(lights_are_ordered_by_content),
        cmocka_unit_test(the_origin_is_no_round_place),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
