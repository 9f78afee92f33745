// Lights that have a size, as they are described and sampled, against integrals known on paper.

#include "lights/area_lights.h"
#include "lights/sequence.h"
#include "lights/triangle_view.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "scene/model/render_space.h"
#include "tests/reference/stage.h"
#include "tests/unit/cmocka_all.h"

#define SAMPLES 4096u

static enum bd_err go_on(void *user)
{
    ++*(int *)user;
    return BD_ERR_OK;
}

static enum bd_err give_up(void *user)
{
    (void)user;
    return BD_ERR_CANCELLED;
}

static struct bd_area_lights *lights_of(struct bd_scene *scene)
{
    struct bd_err_detail detail;
    struct bd_area_lights *lights;
    int pauses = 0;
    assert_int_equal(bd_area_lights_create(scene, false, go_on, &pauses, &lights, &detail),
                     BD_ERR_OK);
    return lights;
}

static struct bd_scene *finished(struct stage *stage)
{
    struct bd_err_detail detail;
    bd_scene_seal(stage->scene);
    assert_int_equal(bd_scene_finish(stage->scene, &detail), BD_ERR_OK);
    return stage->scene;
}

static void near(double seen, double expected, double relative)
{
    if (!(fabs(seen - expected) <= relative * fabs(expected)))
        fail_msg("%.9g instead of %.9g", seen, expected);
}

static float luminance(f3 rgb)
{
    return 0.2126f * rgb.x + 0.7152f * rgb.y + 0.0722f * rgb.z;
}

// --- sequences ----------------------------------------------------------------------------------

// Every aligned block of 2^(a+b) numbers has one in each of 2^a x 2^b boxes.
static void numbers_are_spread_in_every_block(void **state)
{
    (void)state;
    const struct bd_sequence sequence = bd_sequence_of(7, 3);
    for (uint32_t block = 0; block < 64; block++)
        for (uint32_t a = 0; a <= 4; a++) {
            uint32_t seen = 0;
            for (uint32_t i = 0; i < 16; i++) {
                float number[2];
                bd_sequence_pair(&sequence, 16 * block + i, number);
                assert_true(number[0] >= 0 && number[0] < 1 && number[1] >= 0 && number[1] < 1);
                const uint32_t x = (uint32_t)(number[0] * (float)(1u << a));
                const uint32_t y = (uint32_t)(number[1] * (float)(16u >> a));
                seen |= 1u << (x * (16u >> a) + y);
            }
            assert_int_equal(seen, 0xffffu);
        }
}

// --- triangles ----------------------------------------------------------------------------------

static struct bd_area_light triangle_of(f3 a, f3 b, f3 c)
{
    const f3 across = f3_cross(f3_sub(b, a), f3_sub(c, a));
    const float twice = f3_length(across);
    return (struct bd_area_light){.corner = {a, b, c},
                                  .normal = f3_scale(across, 1 / twice),
                                  .area = twice / 2,
                                  .brightest = 1,
                                  .u = {0, 1, 0},
                                  .v = {0, 0, 1}};
}

// Lambert's formula, of a triangle above the horizon.
static double irradiance_of(const struct bd_area_light *light, f3 point, f3 normal)
{
    double sum = 0;
    for (int i = 0; i < 3; i++) {
        const f3 a = f3_unit(f3_sub(light->corner[i], point));
        const f3 b = f3_unit(f3_sub(light->corner[(i + 1) % 3], point));
        const f3 across = f3_cross(a, b);
        const double sine = f3_length(across);
        sum += atan2(sine, f3_dot(a, b)) / sine * f3_dot(across, normal);
    }
    return fabs(sum) / 2;
}

static void check_triangle(const struct bd_area_light *light, double relative)
{
    const f3 point = f3_of(0.1f, 0, 0.05f), normal = f3_of(0, 1, 0);
    const struct bd_triangle_view view = bd_triangle_view_of(light, true, point, normal);
    const struct bd_triangle_aim aim = bd_triangle_aim_of(&view);
    const struct bd_sequence sequence = bd_sequence_of(1, 2);
    double irradiance = 0, solid_sr = 0;
    for (uint32_t i = 0; i < SAMPLES; i++) {
        struct bd_triangle_point at;
        float number[2];
        bd_sequence_pair(&sequence, i, number);
        assert_true(bd_triangle_view_choose(&view, &aim, light, point, number, &at));
        const f3 span = f3_sub(at.position, point), to = f3_unit(span);
        near(bd_triangle_view_pdf(&view, light, to, f3_length(span)), at.pdf, 1e-4);
        assert_true(at.u >= 0 && at.v >= 0 && at.u + at.v <= 1.00001f);
        irradiance += f3_dot(to, normal) / at.pdf / SAMPLES;
        solid_sr += 1 / at.pdf / SAMPLES;
    }
    near(irradiance, irradiance_of(light, point, normal), relative);
    near(solid_sr, view.solid_sr, relative);
}

static void triangles_give_lamberts_irradiance(void **state)
{
    (void)state;
    const struct bd_area_light large =
        triangle_of(f3_of(-1, 0.4f, -1), f3_of(2, 0.3f, -1), f3_of(-1, 0.8f, 2));
    const struct bd_area_light touching =
        triangle_of(f3_of(0, 1e-3f, 0), f3_of(1, 1e-3f, 0), f3_of(0, 1e-3f, 1));
    const struct bd_area_light far =
        triangle_of(f3_of(0, 9, 3), f3_of(0.2f, 9.1f, 3), f3_of(0.1f, 9.3f, 3.2f));
    check_triangle(&large, 1e-3);
    check_triangle(&touching, 5e-3);
    check_triangle(&far, 1e-3);
}

static void rears_and_planes_give_nothing(void **state)
{
    (void)state;
    const struct bd_area_light light =
        triangle_of(f3_of(0, 1, 0), f3_of(1, 1, 0), f3_of(0, 1, 1)); // its front is below
    const f3 below = f3_of(0.2f, 0, 0.2f), above = f3_of(0.2f, 2, 0.2f), in = f3_of(3, 1, 0);
    const f3 up = f3_of(0, 1, 0), down = f3_of(0, -1, 0), aside = f3_of(-1, 0, 0);
    assert_true(light.normal.y < 0);
    assert_true(bd_triangle_view_of(&light, false, below, up).solid_sr > 0);
    assert_true(bd_triangle_view_of(&light, false, above, down).solid_sr == 0);
    assert_true(bd_triangle_view_of(&light, true, above, down).solid_sr > 0);
    assert_true(bd_triangle_view_of(&light, true, in, aside).solid_sr == 0);
    assert_true(bd_triangle_view_of(&light, true, below, down).solid_sr == 0);
}

// --- emitters -----------------------------------------------------------------------------------

static void add_picture(struct bd_scene *scene, uint32_t width_px, uint32_t height_px,
                        const uint8_t *rgba)
{
    const size_t bytes = 4 * (size_t)width_px * height_px;
    scene->pictures = calloc(1, sizeof *scene->pictures);
    scene->textures = calloc(1, sizeof *scene->textures);
    struct bd_picture *picture = scene->pictures[0] = calloc(1, sizeof *picture);
    picture->reference_count = 1;
    picture->width_px = width_px, picture->height_px = height_px;
    picture->rgba = malloc(bytes);
    memcpy(picture->rgba, rgba, bytes);
    scene->textures[0] = (struct bd_texture){.nearest = true};
    scene->picture_count = scene->texture_count = 1;
}

// Of 2 m, its front up, that shines by a picture.
static struct stage *screen_of(uint32_t width_px, uint32_t height_px, const uint8_t *rgba)
{
    static const float positions[] = {-1, 0, -1, 1, 0, -1, -1, 0, 1, 1, 0, 1};
    static const float uv[] = {0, 0, 1, 0, 0, 1, 1, 1};
    static const uint32_t indices[] = {0, 2, 1, 1, 2, 3};
    struct stage *stage = stage_create();
    const int32_t material = stage_material(stage, 0.5f);
    add_picture(stage->scene, width_px, height_px, rgba);
    stage_emission(stage, material, 3);
    stage_material_at(stage, material)->double_sided = false;
    stage_material_at(stage, material)->emissive_map =
        (struct bd_texture_ref){.texture = 0, .uv_transform = {1, 0, 0, 0, 1, 0}};
    stage_triangles(stage, material, positions, uv, indices, 6);
    return stage;
}

// A screen whose right half shines red: that half alone lights, by half of the whole's flux.
static void a_screen_lights_where_it_is_bright(void **state)
{
    (void)state;
    static const uint8_t half[16] = {0, 0, 0, 255, 0, 0, 0, 255, 255, 0, 0, 255, 255, 0, 0, 255};
    struct stage *stage = screen_of(4, 1, half);
    struct bd_area_lights *lights = lights_of(finished(stage));
    double flux = 0;
    for (uint32_t i = 0; i < lights->count; i++) {
        const struct bd_area_light *light = &lights->lights[i];
        const float u = (light->u[0] + light->u[1] + light->u[2]) / 3;
        const float v = (light->v[0] + light->v[1] + light->v[2]) / 3;
        const f3 front = light->normal, rear = f3_scale(front, -1);
        assert_true(front.y > 0);
        assert_true(bd_area_light_at(lights, light->triangle, u, v) == light);
        assert_true(luminance(bd_area_emission(lights, light, u, v, rear)) == 0);
        flux += light->area * luminance(bd_area_emission(lights, light, u, v, front));
    }
    // Of a square of 2 m; parts that are black all over are left out.
    const double render_per_m = bd_render_space_of(stage->scene).render_per_m;
    near(flux, 0.5 * 3 * 0.2126 * 4 * render_per_m * render_per_m, 0.02);
    assert_true(lights->count < 2 * 64);
    bd_area_lights_destroy(&lights);
    stage_destroy(&stage);
}

// Of a picture in which one texel of a hundred is lit, each is in parts that are not much larger,
// and little else is in any; whoever asks by a point finds them.
static void lit_texels_have_parts_of_their_own(void **state)
{
    (void)state;
    enum { SIDE = 128 };
    uint8_t *rgba = calloc(SIDE * SIDE, 4);
    for (int i = 0; i < SIDE * SIDE; i += 101) memset(rgba + 4 * (size_t)i, 255, 4);
    struct stage *stage = screen_of(SIDE, SIDE, rgba);
    struct bd_area_lights *lights = lights_of(finished(stage));
    const double per_m = bd_render_space_of(stage->scene).render_per_m;
    const double texel = 4 * per_m * per_m / (SIDE * SIDE);
    double area = 0, flux = 0, worst = 0;
    for (uint32_t i = 0; i < lights->count; i++) {
        area += (double)lights->lights[i].area / texel;
        flux += (double)lights->lights[i].area / texel * (double)lights->lights[i].brightest / 3;
    }
    for (int i = 0; i < SIDE * SIDE; i += 101) {
        const float x = ((float)(i % SIDE) + 0.3f) / SIDE, y = ((float)(i / SIDE) + 0.4f) / SIDE;
        const struct bd_area_light *part = x + y < 1
                                               ? bd_area_light_at(lights, 0, y, x)
                                               : bd_area_light_at(lights, 1, 1 - x, x + y - 1);
        assert_non_null(part);
        worst = fmax(worst, (double)part->area / texel);
    }
    const double lit = SIDE * SIDE / 101 + 1;
    print_message(
        "    %u parts of %.1f times the lit area, %.2f times its flux, one of %.1f texels\n",
        lights->count, area / lit, flux / lit, worst);
    assert_true(area < 8 * lit && flux > 0.7 * lit && flux < 1.5 * lit && worst <= 4);
    bd_area_lights_destroy(&lights);
    stage_destroy(&stage);
    free(rgba);
}

// Where coordinates are none, or name no texel, nothing tells where a screen is bright: it stays
// whole, and leaves the room to others.
static void screens_that_nothing_is_told_of_stay_whole(void **state)
{
    (void)state;
    static const float scales[] = {1e12f, NAN, 1e30f, INFINITY};
    static const uint8_t half[16] = {0, 0, 0, 255, 0, 0, 0, 255, 255, 0, 0, 255, 255, 0, 0, 255};
    for (size_t i = 0; i < sizeof scales / sizeof *scales; i++) {
        struct stage *stage = screen_of(4, 1, half);
        stage_material_at(stage, 0)->emissive_map.uv_transform[0] = scales[i];
        struct bd_area_lights *lights = lights_of(finished(stage));
        assert_int_equal(lights->count, 2);
        assert_true(lights->lights[0].brightest > 0 && lights->lights[1].brightest > 0);
        bd_area_lights_destroy(&lights);
        stage_destroy(&stage);
    }
}

static void what_is_unlit_or_dark_emits_nothing(void **state)
{
    (void)state;
    struct stage *stage = stage_create();
    const int32_t grey = stage_material(stage, 0.5f), unlit = stage_material(stage, 0.5f);
    stage_emission(stage, unlit, 3);
    stage_material_at(stage, unlit)->unlit = true;
    stage_floor(stage, grey, 1, 0, 1);
    stage_floor(stage, unlit, 1, 1, 1);
    struct bd_area_lights *lights = lights_of(finished(stage));
    assert_int_equal(lights->count, 0);
    assert_false(bd_area_lights_shine(lights));
    bd_area_lights_destroy(&lights);
    stage_destroy(&stage);
}

// Of a tree: chances of all emitters add up to 1 at any receiver that one of them may reach, what
// is drawn has the chance that is told, and what may send light has one.
static void trees_draw_what_they_tell(void **state)
{
    (void)state;
    struct stage *stage = stage_create();
    for (int i = 0; i < 100; i++) {
        const int32_t material = stage_material(stage, 0.5f);
        stage_emission(stage, material, 1 + (float)(i % 7));
        stage_material_at(stage, material)->double_sided = i % 3 == 0;
        stage_floor(stage, material, 0.5 + i % 5, 0.3 * i - 11, i % 2 ? 1 : -1);
    }
    static const double aside[3] = {0.9, 0.2, 0.3};
    const int32_t material = stage_material(stage, 0.5f);
    stage_emission(stage, material, 5);
    stage_material_at(stage, material)->double_sided = false;
    stage_sphere(stage, material, aside, 0.5, 2, false);
    struct bd_area_lights *lights = lights_of(finished(stage));
    assert_int_equal(lights->tree.count, 200 + 128);
    static const float heights[] = {-0.4f, 0, 0.13f, 0.4f};
    for (size_t h = 0; h < sizeof heights / sizeof *heights; h++) {
        const f3 point = f3_of(0.02f, heights[h], 0.01f), normal = f3_unit(f3_of(0.3f, 1, 0.2f));
        struct bd_emitter_cut cut;
        bd_emitter_tree_cut(&lights->tree, point, normal, &cut);
        double sum = 0;
        for (uint32_t i = 0; i < lights->count; i++) {
            const float chance = bd_emitter_tree_pdf(&lights->tree, &cut, point, normal, i);
            const struct bd_area_light *light = &lights->lights[i];
            const struct bd_triangle_view view =
                bd_triangle_view_of(light, lights->sources[light->source].two_sided, point, normal);
            if (bd_triangle_view_weight(&view, &lights->lights[i]) > 0) assert_true(chance > 0);
            sum += chance;
        }
        uint32_t drawn = 0;
        for (uint32_t i = 0; i < SAMPLES; i++) {
            uint32_t light;
            float chance;
            if (!bd_emitter_tree_draw(&lights->tree, &cut, point, normal,
                                      ((float)i + 0.5f) / SAMPLES, &light, &chance))
                continue;
            drawn++;
            near(bd_emitter_tree_pdf(&lights->tree, &cut, point, normal, light), chance, 1e-5);
        }
        near(drawn / (double)SAMPLES, sum, 2e-3);
        assert_true(sum > 0.9 && sum < 1.00001);
    }
    struct bd_emitter_cut nothing;
    uint32_t light;
    float chance;
    bd_emitter_tree_cut(&lights->tree, f3_of(0, 2, 0), f3_of(0, 1, 0), &nothing);
    assert_false(bd_emitter_tree_draw(&lights->tree, &nothing, f3_of(0, 2, 0), f3_of(0, 1, 0), 0.5f,
                                      &light, &chance));
    bd_area_lights_destroy(&lights);
    stage_destroy(&stage);
}

static double sum_of_chances(const struct bd_area_lights *lights, const struct bd_emitter_cut *cut,
                             f3 point)
{
    double sum = 0;
    for (uint32_t i = 0; i < lights->count; i++)
        sum += (double)bd_emitter_tree_pdf(&lights->tree, cut, point, f3_of(0, 1, 0), i);
    return sum;
}

// In the very middle of any node's box, however brightly it shines, chances are numbers.
static void no_weight_is_without_an_end(void **state)
{
    (void)state;
    struct stage *stage = stage_create();
    const int32_t material = stage_material(stage, 0.5f);
    stage_emission(stage, material, 1e15f);
    for (int i = -40; i <= 40; i++) stage_floor(stage, material, 1, 0.1 * i, 1);
    struct bd_area_lights *lights = lights_of(finished(stage));
    const uint32_t count = lights->count;
    const struct bd_emitter_cut whole = {1, {{0, 0, count, 1, 1}}, 1};
    for (uint32_t n = 0; n < 2 * count - 1; n++) {
        const struct bd_emitter_node *node = &lights->tree.nodes[n];
        const f3 half = f3_scale(f3_sub(node->most, node->least), 0.5f);
        const f3 middle = f3_add(node->least, half);
        struct bd_emitter_cut cut;
        bd_emitter_tree_cut(&lights->tree, middle, f3_of(0, 1, 0), &cut);
        assert_true(isfinite(cut.weight));
        assert_true(isfinite(sum_of_chances(lights, &cut, middle)));
        assert_true(isfinite(sum_of_chances(lights, &whole, middle)));
    }
    bd_area_lights_destroy(&lights);
    stage_destroy(&stage);
}

// Two layers of small screens that look down, as lamps in a hall do: heights that a curve through
// space jumps between.
static struct bd_area_lights *screens(struct stage *stage)
{
    enum { SCREENS = 2000 };
    float positions[9 * SCREENS];
    uint32_t indices[3 * SCREENS];
    for (uint32_t i = 0; i < 3 * SCREENS; i++) indices[i] = i;
    for (uint32_t i = 0; i < SCREENS; i++) {
        const float x = 60 * (float)fmod(i * 0.754877666, 1) - 30, y = i % 2 ? 5.5f : 7.5f;
        const float z = 30 * (float)fmod(i * 0.569840291, 1) - 15;
        const float corners[9] = {x, y, z, x + 0.1f, y, z, x, y, z + 0.1f};
        memcpy(positions + 9 * (size_t)i, corners, sizeof corners);
    }
    const int32_t material = stage_material(stage, 0);
    stage_emission(stage, material, 1);
    stage_material_at(stage, material)->double_sided = false;
    stage_triangles(stage, material, positions, NULL, indices, 3 * SCREENS);
    return lights_of(finished(stage));
}

// Over its mean squared: of what an emitter may send, over its chance, by that chance.
static double variance_at(const struct bd_area_lights *lights, f3 point, f3 normal)
{
    struct bd_emitter_cut cut;
    double sum = 0, squares = 0;
    bd_emitter_tree_cut(&lights->tree, point, normal, &cut);
    for (uint32_t i = 0; i < lights->count; i++) {
        const struct bd_triangle_view view =
            bd_triangle_view_of(&lights->lights[i], false, point, normal);
        const double weight = (double)bd_triangle_view_weight(&view, &lights->lights[i]);
        if (!(weight > 0)) continue;
        sum += weight;
        squares +=
            weight * weight / (double)bd_emitter_tree_pdf(&lights->tree, &cut, point, normal, i);
    }
    return sum > 0 ? squares / (sum * sum) - 1 : 0;
}

// A receiver on a wall beside a screen is lit by little else.
static void trees_find_what_is_near(void **state)
{
    (void)state;
    struct stage *stage = stage_create();
    struct bd_area_lights *lights = screens(stage);
    double mean = 0, worst = 0;
    for (uint32_t i = 0; i < 1000; i++) {
        const f3 *beside = lights->lights[2 * i].corner;
        const float span = f3_length(f3_sub(beside[1], beside[0])), turn = (float)i;
        const f3 off = f3_of(span * cosf(turn), -span * (float)(i % 50), span * sinf(turn));
        const f3 normal = f3_of(cosf(3 * turn), 0, sinf(3 * turn));
        const double variance = variance_at(lights, f3_add(beside[0], off), normal);
        mean += variance / 1000;
        worst = fmax(worst, variance);
    }
    print_message("    variance %.3g of the mean squared, at worst %.3g\n", mean, worst);
    assert_true(mean < 2 && worst < 200);
    bd_area_lights_destroy(&lights);
    stage_destroy(&stage);
}

static void what_pauses_may_end_it(void **state)
{
    (void)state;
    struct stage *stage = stage_create();
    const int32_t material = stage_material(stage, 0.5f);
    stage_emission(stage, material, 1);
    stage_floor(stage, material, 1, 0, 1);
    struct bd_area_lights *none;
    struct bd_err_detail detail;
    assert_int_equal(bd_area_lights_create(finished(stage), false, give_up, NULL, &none, &detail),
                     BD_ERR_CANCELLED);
    assert_null(none);
    stage_destroy(&stage);
}

// --- the sky ------------------------------------------------------------------------------------

static struct bd_sky_map *map_of(uint32_t width, uint32_t height)
{
    struct bd_sky_map *map = calloc(1, sizeof *map);
    map->reference_count = 1;
    map->width_px = width, map->height_px = height;
    map->rgb = calloc(3 * (size_t)width * height, sizeof *map->rgb);
    return map;
}

static struct bd_area_lights *sky_of(struct stage *stage, struct bd_sky_map *map,
                                     const double *rotation)
{
    bd_sky_map_seal(map);
    stage->scene->environment = (struct bd_environment){.radiance = {1, 1, 1}, .map = map};
    if (rotation) bd_environment_turn(&stage->scene->environment, rotation);
    stage_floor(stage, stage_material(stage, 0.5f), 1, 0, 1);
    return lights_of(finished(stage));
}

// The mean of what a sample brings over its density, against a sum over the sphere.
static void check_sky(uint32_t width, uint32_t height, uint32_t sun, const double *rotation,
                      double relative)
{
    struct stage *stage = stage_create();
    struct bd_sky_map *map = map_of(width, height);
    for (uint32_t i = 0; i < 3 * width * height; i++)
        map->rgb[i] = 0.1f + 0.2f * (float)(i / 3 / width) / (float)height;
    for (int c = 0; c < 3; c++) map->rgb[3 * sun + c] = 20000;
    struct bd_area_lights *lights = sky_of(stage, map, rotation);
    const struct bd_sequence sequence = bd_sequence_of(3, 4);
    double seen = 0, expected = 0;
    for (uint32_t i = 0; i < SAMPLES; i++) {
        float number[2], density;
        bd_sequence_pair(&sequence, i, number);
        const f3 d = bd_sky_light_choose(&lights->sky, number, &density);
        near(f3_length(d), 1, 1e-5);
        near(bd_sky_light_look(&lights->sky, d).pdf, density, 1e-3);
        seen += luminance(bd_sky_light_radiance(&lights->sky, d)) / density / SAMPLES;
    }
    const int steps = 8 * (int)height;
    for (int y = 0; y < steps; y++)
        for (int x = 0; x < 2 * steps; x++) {
            const double t = (y + 0.5) / steps * M_PI, p = (x + 0.5) / steps * M_PI;
            const f3 d = f3_of((float)(sin(t) * sin(p)), (float)cos(t), (float)(-sin(t) * cos(p)));
            expected += luminance(bd_sky_light_radiance(&lights->sky, d)) * sin(t) * M_PI / steps *
                        M_PI / steps;
        }
    near(seen, expected, relative);
    bd_area_lights_destroy(&lights);
    stage_destroy(&stage);
}

static void skies_with_a_sun_are_found(void **state)
{
    (void)state;
    static const double turn[4] = {0.3, -0.5, 0.1, 0.7};
    check_sky(32, 16, 5 * 32 + 9, NULL, 0.01);
    check_sky(32, 16, 31, NULL, 0.01);      // at the zenith, across the seam
    check_sky(64, 32, 31 * 64, NULL, 0.01); // at the nadir
    check_sky(32, 16, 5 * 32 + 9, turn, 0.01);
    check_sky(64, 32, 12 * 64 + 63, turn, 0.01); // across the seam
}

static void a_black_map_does_not_shine(void **state)
{
    (void)state;
    struct stage *stage = stage_create();
    struct bd_area_lights *lights = sky_of(stage, map_of(8, 4), NULL);
    assert_false(lights->sky.shines);
    bd_area_lights_destroy(&lights);
    stage_destroy(&stage);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(numbers_are_spread_in_every_block),
        cmocka_unit_test(triangles_give_lamberts_irradiance),
        cmocka_unit_test(rears_and_planes_give_nothing),
        cmocka_unit_test(a_screen_lights_where_it_is_bright),
        cmocka_unit_test(lit_texels_have_parts_of_their_own),
        cmocka_unit_test(screens_that_nothing_is_told_of_stay_whole),
        cmocka_unit_test(what_is_unlit_or_dark_emits_nothing),
        cmocka_unit_test(trees_draw_what_they_tell),
        cmocka_unit_test(no_weight_is_without_an_end),
        cmocka_unit_test(trees_find_what_is_near),
        cmocka_unit_test(what_pauses_may_end_it),
        cmocka_unit_test(skies_with_a_sun_are_found),
        cmocka_unit_test(a_black_map_does_not_shine),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
