// Light from infinitely far away: from an EXR into a scene, through the flat form, into features.

#include <math.h>
#include <stdio.h>

#include "image/exr.h"
#include "scene/import/sky_map.h"
#include "scene/model/flat.h"
#include "tests/unit/scene/read_text.h"

#define SIDE 4

// A grey map of SIDE x SIDE with one value of its own in `plane`, as EXR bytes.
static struct bd_bytes map_file(const char *names, int plane, size_t at, float value)
{
    float samples[3][SIDE * SIDE];
    struct bd_exr_plane planes[3];
    memset(planes, 0, sizeof planes);
    for (int p = 0; p < 3; p++) {
        for (int i = 0; i < SIDE * SIDE; i++) samples[p][i] = 0.5f;
        planes[p].name[0] = names[p];
        planes[p].samples = samples[p];
        planes[p].stride = 1;
    }
    samples[plane][at] = value;
    const struct bd_exr_picture picture = {
        .width_px = SIDE, .height_px = SIDE, .planes = planes, .plane_count = 3};
    struct bd_bytes bytes = {0};
    struct bd_err_detail detail = {0};
    if (bd_exr_write(&picture, &bytes, &detail)) fail_msg("%s", detail.message);
    return bytes;
}

static struct bd_sky_map *read_map(float value, uint64_t *negative_count)
{
    struct bd_bytes file = map_file("RGB", 1, 6, value);
    struct bd_sky_map *map = NULL;
    struct bd_err_detail detail = {0};
    if (bd_sky_map_read(file.data, file.size_bytes, "map", &map, negative_count, &detail))
        fail_msg("%s", detail.message);
    bd_sky_map_seal(map);
    bd_bytes_finish(&file);
    return map;
}

static void a_map_is_read_texel_by_texel(void **state)
{
    (void)state;
    uint64_t negative_count = 99;
    struct bd_sky_map *map = read_map(7, &negative_count);
    assert_int_equal(negative_count, 0);
    assert_int_equal(map->width_px, SIDE);
    assert_int_equal(map->height_px, SIDE);
    for (int i = 0; i < 3 * SIDE * SIDE; i++)
        assert_true(map->rgb[i] == (i == 3 * 6 + 1 ? 7.0f : 0.5f));
    bd_sky_map_release(&map);
    assert_null(map);
}

static void what_is_negative_becomes_dark_and_is_counted(void **state)
{
    (void)state;
    uint64_t negative_count = 0;
    struct bd_sky_map *map = read_map(-2, &negative_count);
    assert_int_equal(negative_count, 1);
    assert_true(map->rgb[3 * 6 + 1] == 0);
    bd_sky_map_release(&map);
}

// Y alone is grey; beside R, G and B it is another layer.
static void a_luminance_alone_is_grey(void **state)
{
    (void)state;
    struct bd_bytes file = map_file("YAZ", 0, 6, 7);
    struct bd_sky_map *map = NULL;
    uint64_t negative_count = 99;
    struct bd_err_detail detail = {0};
    if (bd_sky_map_read(file.data, file.size_bytes, "map", &map, &negative_count, &detail))
        fail_msg("%s", detail.message);
    for (int i = 0; i < 3 * SIDE * SIDE; i++)
        assert_true(map->rgb[i] == (i / 3 == 6 ? 7.0f : 0.5f));
    bd_sky_map_release(&map);
    bd_bytes_finish(&file);
}

static void a_radiance_picture_is_a_map(void **state)
{
    (void)state;
    static const char file[] = "#?RADIANCE\n\n-Y 1 +X 2\n\x7f\x3f\x1f\x81\x00\x00\x00\x00";
    struct bd_sky_map *map = NULL;
    uint64_t negative_count = 99;
    struct bd_err_detail detail = {0};
    if (bd_sky_map_read(file, sizeof file - 1, "map", &map, &negative_count, &detail))
        fail_msg("%s", detail.message);
    assert_int_equal(negative_count, 0);
    assert_int_equal(map->width_px, 2);
    assert_int_equal(map->height_px, 1);
    const float want[6] = {127.5f / 128, 63.5f / 128, 31.5f / 128};
    assert_memory_equal(map->rgb, want, sizeof want);
    bd_sky_map_release(&map);
    assert_int_equal(bd_sky_map_read(file, sizeof file - 2, "map", &map, &negative_count, &detail),
                     BD_ERR_BAD_INPUT);
    assert_string_equal(detail.field, "map");
    assert_non_null(strstr(detail.message, "map: "));
}

static void assert_map_refused(struct bd_bytes file, size_t size, enum bd_err err, const char *word)
{
    struct bd_sky_map *map = NULL;
    uint64_t negative_count;
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_sky_map_read(file.data, size, "map", &map, &negative_count, &detail), err);
    assert_null(map);
    assert_string_equal(detail.field, "map");
    if (!strstr(detail.message, word)) fail_msg("\"%s\" in \"%s\"?", word, detail.message);
    bd_bytes_finish(&file);
}

static void maps_that_are_none_are_refused(void **state)
{
    (void)state;
    struct bd_bytes whole = map_file("RGB", 0, 0, 1);
    size_t size = whole.size_bytes;
    assert_map_refused(whole, size - 8, BD_ERR_BAD_INPUT, "");
    struct bd_bytes file = map_file("RGB", 2, 9, NAN);
    assert_map_refused(file, file.size_bytes, BD_ERR_BAD_INPUT, "column 1 of row 2");
    file = map_file("RGB", 0, 3, INFINITY);
    assert_map_refused(file, file.size_bytes, BD_ERR_BAD_INPUT, "not finite");
    file = map_file("XYZ", 0, 0, 1);
    assert_map_refused(file, file.size_bytes, BD_ERR_BAD_INPUT, "R, G, B");
}

static void a_map_of_9000_texels_a_side_is_too_large(void **state)
{
    (void)state;
    enum { WIDE = 9000 };
    float *row = calloc(WIDE, sizeof *row);
    struct bd_exr_plane planes[3];
    memset(planes, 0, sizeof planes);
    for (int p = 0; p < 3; p++) {
        planes[p].name[0] = "RGB"[p];
        planes[p].samples = row;
        planes[p].stride = 1;
    }
    const struct bd_exr_picture picture = {
        .width_px = WIDE, .height_px = 1, .planes = planes, .plane_count = 3};
    struct bd_bytes file = {0};
    assert_int_equal(bd_exr_write(&picture, &file, NULL), BD_ERR_OK);
    free(row);
    assert_map_refused(file, file.size_bytes, BD_ERR_BAD_INPUT, "8192");
}

struct bytes {
    uint8_t *data;
    size_t size;
};

static bool collect(void *user, const void *bytes, size_t size)
{
    struct bytes *out = user;
    out->data = realloc(out->data, out->size + size + 1);
    assert_non_null(out->data);
    memcpy(out->data + out->size, bytes, size);
    out->size += size;
    return true;
}

static struct bd_scene *scene_under_map(void)
{
    struct bd_scene *scene = bd_scene_create();
    uint64_t negative_count;
    scene->environment =
        (struct bd_environment){.radiance = {1, 2, 3}, .map = read_map(7, &negative_count)};
    return scene;
}

static void a_sky_survives_the_flat_form_and_no_cut_of_it_does(void **state)
{
    (void)state;
    struct bd_scene *scene = scene_under_map(), *again;
    struct bytes flat = {0};
    struct bd_err_detail detail = {0};
    assert_true(bd_flat_write(scene, collect, &flat));
    assert_int_equal(bd_flat_read(flat.data, flat.size, &again, &detail), BD_ERR_OK);
    assert_memory_equal(again->environment.radiance, scene->environment.radiance, 12);
    assert_int_equal(again->environment.map->content_hash, scene->environment.map->content_hash);
    bd_scene_release(&again);
    for (size_t size = 0; size < flat.size; size++) {
        uint8_t *cut = malloc(size ? size : 1);
        assert_non_null(cut);
        memcpy(cut, flat.data, size);
        assert_int_equal(bd_flat_read(cut, size, &again, &detail), BD_ERR_BAD_INPUT);
        free(cut);
    }
    // A texel that no sky has.
    const float nan = NAN;
    memcpy(flat.data + flat.size - 4 - sizeof nan, &nan, sizeof nan); // the count of flags is last
    assert_int_equal(bd_flat_read(flat.data, flat.size, &again, &detail), BD_ERR_BAD_INPUT);
    assert_string_equal(detail.field, "environment");
    free(flat.data);
    bd_scene_release(&scene);
}

// And one that is not turned is written as it was before any could be: a byte that says a map.
static void a_turned_sky_survives_the_flat_form(void **state)
{
    (void)state;
    struct bd_scene *scene = scene_under_map(), *again;
    struct bytes straight = {0}, turned = {0};
    struct bd_err_detail detail = {0};
    assert_true(bd_flat_write(scene, collect, &straight));
    bd_environment_turn(&scene->environment, (const double[4]){0, 2e9, 0, 2e9});
    assert_true(bd_flat_write(scene, collect, &turned));
    assert_int_equal(turned.size, straight.size + 16);
    assert_int_equal(bd_flat_read(turned.data, turned.size, &again, &detail), BD_ERR_OK);
    assert_memory_equal(again->environment.rotation, scene->environment.rotation, 16);
    assert_float_equal(again->environment.rotation[1], sqrtf(0.5f), 1e-7);
    bd_scene_release(&again);
    bd_environment_turn(&scene->environment, (const double[4]){0, 0, 5e-324, 0});
    assert_true(scene->environment.rotation[2] == 1);
    bd_environment_turn(&scene->environment, (const double[4]){0, 0, 0, -3});
    assert_false(bd_environment_is_turned(&scene->environment));
    free(straight.data);
    free(turned.data);
    bd_scene_release(&scene);
}

// A quarter turn about y has the map's x axis point along -z.
static void axes_are_where_the_map_is_turned_to(void **state)
{
    (void)state;
    struct bd_environment sky = {.map = NULL};
    bd_dvec3 axes[3];
    bd_environment_axes(&sky, axes);
    assert_true(axes[0].x == 1 && axes[1].y == 1 && axes[2].z == 1);
    bd_environment_turn(&sky, (const double[4]){0, 1, 0, 1});
    bd_environment_axes(&sky, axes);
    assert_float_equal(axes[0].z, -1, 1e-7);
    assert_float_equal(axes[1].y, 1, 1e-7);
    assert_float_equal(axes[2].x, 1, 1e-7);
}

// Where the sky shines the default rig is for those who are not lit by it; a black one is as good
// as none.
static void the_default_lights_yield_to_a_shining_sky(void **state)
{
    (void)state;
    const struct {
        float radiance[3];
        bool has_map, shines;
    } cases[] = {{{0, 0, 0}, false, false},
                 {{0, 0.1f, 0}, false, true},
                 {{1, 1, 1}, true, true},
                 {{0, 0, 0}, true, false}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct bd_scene *scene = cases[i].has_map ? scene_under_map() : bd_scene_create();
        struct bd_err_detail detail = {0};
        memcpy(scene->environment.radiance, cases[i].radiance, sizeof cases[i].radiance);
        assert_int_equal(bd_scene_finish(scene, &detail), BD_ERR_OK);
        assert_int_equal(scene->features.has_environment, cases[i].shines);
        assert_int_equal(scene->placed_light_count, 2);
        assert_int_equal(bd_scene_lights_yield(scene, false, true), cases[i].shines);
        bd_scene_release(&scene);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_map_is_read_texel_by_texel),
        cmocka_unit_test(a_luminance_alone_is_grey),
        cmocka_unit_test(a_radiance_picture_is_a_map),
        cmocka_unit_test(what_is_negative_becomes_dark_and_is_counted),
        cmocka_unit_test(maps_that_are_none_are_refused),
        cmocka_unit_test(a_map_of_9000_texels_a_side_is_too_large),
        cmocka_unit_test(a_sky_survives_the_flat_form_and_no_cut_of_it_does),
        cmocka_unit_test(a_turned_sky_survives_the_flat_form),
        cmocka_unit_test(axes_are_where_the_map_is_turned_to),
        cmocka_unit_test(the_default_lights_yield_to_a_shining_sky),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
