// What is hidden from what: occlusion, leaks, alpha, glass (algorithms.md D10, D12, hazards 22 to
// 25, 36, 37, 61, 62).

#include <float.h>
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "stage.h"
#include "tests/unit/cmocka_all.h"

static const double pi = 3.14159265358979323846;
static const double origin[3] = {0, 0, 0};

static struct bd_integrand lambert(uint32_t bounces, uint32_t lights)
{
    struct bd_integrand integrand = bd_integrand_full;
    integrand.lambert = true;
    integrand.bounces_max = bounces;
    integrand.lights = lights;
    return integrand;
}

static void set_sky(struct stage *s, float cd_m2)
{
    for (int k = 0; k < 3; k++) s->scene->environment.radiance[k] = cd_m2;
}

// --- D12 ----------------------------------------------------------------------------------------

static void concentric_spheres(void **state)
{
    (void)state;
    struct stage *s = stage_create();
    int32_t outer = stage_material(s, 0.5f), inner = stage_material(s, 0.8f);
    stage_emission(s, outer, (float)(1 / pi));
    stage_sphere(s, outer, origin, 2, 5, true);
    stage_sphere(s, inner, origin, 1, 5, false);
    const double eye[3] = {1.5, 0.1, 0.2}, away[3] = {3, 1, 0.5};
    uint32_t to_outer = stage_camera(s, eye, away, 0.3);
    uint32_t to_inner = stage_camera(s, eye, origin, 0.3);
    struct bd_integrand whole = lambert(BD_BOUNCES_UNLIMITED, BD_REFERENCE_EMISSIVE);
    CHECK(stage_radiance(s, &whole, to_outer, BD_PART_COUNT, 4, 4096), 1.9047619 / pi, 1e-3);
    CHECK(stage_radiance(s, &whole, to_inner, BD_PART_COUNT, 4, 4096), 1.5238095 / pi, 1e-3);
    stage_destroy(&s);
}

static void sphere_over_floor(void **state)
{
    (void)state;
    const double cases[][3] = {{1, 0, 0}, {2, 0, 0.75}, {1, 1, 0.646447}, {2, 1, 0.8211146}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct stage *s = stage_create();
        const double centre[3] = {0, cases[i][0], 0};
        stage_sphere(s, stage_material(s, 0), centre, 1, 6, false);
        stage_floor(s, stage_material(s, 0), 20, 0, 1);
        set_sky(s, 1);
        struct bd_integrand direct = lambert(0, BD_REFERENCE_ENVIRONMENT);
        struct estimate e =
            stage_irradiance(s, &direct, BD_PART_DIRECT, cases[i][1], 0, 0, 0, 1, 0, 32768);
        CHECK(e, pi * cases[i][2], 5e-4);
        if (cases[i][2] == 0) assert_true(e.mean < 2e-3);
        stage_destroy(&s);
    }
}

// --- nothing leaks ------------------------------------------------------------------------------

static double everything(struct stage *s, uint32_t camera, uint32_t size, uint32_t count)
{
    return stage_radiance(s, &bd_integrand_full, camera, BD_PART_COUNT, size, count).mean;
}

// Walls of no thickness and exactly shared edges, light on their other side: not one ray may pass.
static void closed_rooms_stay_dark(void **state)
{
    (void)state;
    for (int shape = 0; shape < 2; shape++) {
        struct stage *s = stage_create();
        int32_t wall = stage_material(s, 0.8f);
        const double low[3] = {-0.7, -0.5, -1.1}, high[3] = {1.3, 0.9, 0.6};
        if (shape)
            stage_sphere(s, wall, origin, 1, 4, true);
        else
            stage_box(s, wall, low, high);
        set_sky(s, 100);
        stage_light(s, BD_LIGHT_POINT, 3, 4, 5, NULL, 1e4f);
        const double eye[3] = {0.3, 0.2, 0.1};
        const double target[3] = {1, 0.4, -0.6};
        uint32_t camera = stage_camera(s, eye, target, 2.2);
        // At the latter, rays began nearer to a wall than they looked for it.
        assert_true(everything(s, camera, 48, 64) == 0);
        assert_true(everything(s, camera, 44, 64) == 0);
        stage_destroy(&s);
    }
}

// The other way round, with a second room beside that shares a wall (hazards 23, 36).
static void lamps_stay_in_their_room(void **state)
{
    (void)state;
    struct stage *s = stage_create();
    int32_t wall = stage_material(s, 0.8f);
    const double low[3] = {0, 0, 0}, high[3] = {1, 1, 1}, high_2[3] = {2, 1, 1}, low_2[3] = {1, 0, 0};
    stage_box(s, wall, low, high);
    stage_box(s, wall, low_2, high_2);
    stage_light(s, BD_LIGHT_POINT, 0.95, 0.5, 0.5, NULL, 100);
    stage_light(s, BD_LIGHT_SPOT, 0.5, 0.5, 0.5, (const double[3]){1, 0.2, 0}, 100);
    const double outside[3] = {3.5, 2, 4}, target[3] = {1, 0.5, 0.5}, in_second[3] = {1.9, 0.5, 0.4};
    uint32_t from_outside = stage_camera(s, outside, target, 0.6);
    uint32_t from_second = stage_camera(s, in_second, target, 2);
    assert_true(everything(s, from_outside, 48, 64) == 0);
    assert_true(everything(s, from_second, 48, 64) == 0);
    stage_destroy(&s);
}

static void camera_inside_a_solid(void **state)
{
    (void)state;
    struct stage *s = stage_create();
    stage_sphere(s, stage_material(s, 0.5f), origin, 1, 3, false);
    stage_light(s, BD_LIGHT_POINT, 0.2, 0, 0, NULL, 1);
    const double eye[3] = {0.3, 0.2, 0.1}, target[3] = {0, 0, 1};
    uint32_t camera = stage_camera(s, eye, target, 1);
    assert_true(isfinite(everything(s, camera, 8, 64)));
    stage_destroy(&s);
}

// --- no acne ------------------------------------------------------------------------------------

// A floor of many triangles under a lamp, at sizes and places that are no powers of two: every
// pixel has the direct light of the closed form.
static void floors_at_any_scale(void **state)
{
    (void)state;
    const double scales[] = {1e-4, 1, 1e6}, offsets[] = {0, 1e7};
    for (int i = 0; i < 6; i++) {
        double scale = scales[i / 2], offset = offsets[i % 2] * scale;
        struct stage *s = stage_create();
        int32_t white = stage_material(s, 1);
        for (int x = -4; x < 4; x++)
            for (int z = -4; z < 4; z++) {
                double a = 0.37 * scale;
                const double q[4][3] = {{a * x, 0, a * (z + 1)}, {a * (x + 1), 0, a * (z + 1)},
                                        {a * (x + 1), 0, a * z}, {a * x, 0, a * z}};
                stage_quad(s, white, q);
            }
        stage_light(s, BD_LIGHT_POINT, 0, scale, 0, NULL, (float)(scale * scale));
        const double eye[3] = {0, 1.5 * scale, 1.5 * scale};
        stage_camera(s, eye, origin, 0.6);
        s->scene->cameras[0].near_m = (float)(1e-3 * scale);
        for (uint32_t n = 0; n < s->scene->node_count; n++)
            s->scene->nodes[n].parent_from_node.m[12] += offset;
        stage_finish(s, 1);
        struct bd_integrand direct = lambert(0, BD_REFERENCE_PUNCTUAL);
        const struct bd_reference_view view = {.width_px = 24, .height_px = 24};
        for (uint32_t p = 0; p < 24 * 24; p++) {
            struct bd_reference_pixel pixel = {0};
            bd_reference_trace(s->reference, &direct, &view, 1, p % 24, p / 24, 0, 1, &pixel);
            // From depth and place in the picture follows the distance to the lamp's foot: the eye's
            // axes are right (1, 0, 0), up (0, 1, -1) / root 2, back (0, 1, 1) / root 2.
            double tangent = tan(0.3), depth = pixel.depth_m / pixel.coverage / scale;
            double right = depth * tangent * ((p % 24 + 0.5) / 12 - 1);
            double up = depth * tangent * (1 - (p / 24 + 0.5) / 12);
            double z = 1.5 - (depth + up) / sqrt(2), r2 = 1 + right * right + z * z;
            double expected = 1 / pi / (r2 * sqrt(r2));
            double value = pixel.sum[0][BD_PART_DIRECT][0];
            if (fabs(value / expected - 1) > 1e-3)
                fail_msg("scale %g, offset %g, pixel %u: %g instead of %g", scale, offset, p, value,
                         expected);
        }
        stage_destroy(&s);
    }
}

// --- sides --------------------------------------------------------------------------------------

// Light that falls on a wall's back does not come out in front (hazard 22); two single-sided walls
// in one plane are as good as one with two sides; the back of one is black.
static struct estimate behind_wall(int walls, bool double_sided, double lamp_z)
{
    struct stage *s = stage_create();
    int32_t white = stage_material(s, 0.8f);
    stage_material_at(s, white)->double_sided = double_sided;
    const double front[4][3] = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
    const double back[4][3] = {{1, -1, 0}, {-1, -1, 0}, {-1, 1, 0}, {1, 1, 0}};
    if (walls & 1) stage_quad(s, white, front);
    if (walls & 2) stage_quad(s, white, back);
    stage_light(s, BD_LIGHT_POINT, 0.2, 0.1, lamp_z, NULL, 5);
    struct bd_integrand one = lambert(1, BD_REFERENCE_PUNCTUAL);
    struct estimate e =
        stage_irradiance(s, &one, BD_PART_INDIRECT, 0, 0.1, 1, 0, 0, -1, 4096);
    stage_destroy(&s);
    return e;
}

static void sides_of_walls(void **state)
{
    (void)state;
    struct estimate lit = behind_wall(1, true, 0.5);
    assert_true(lit.mean > 0.1);
    CHECK(behind_wall(1, true, -0.5), 0, 0);
    CHECK(behind_wall(2, false, 0.5), 0, 0);
    CHECK_SAME(behind_wall(1, false, 0.5), lit, 0.01);
    CHECK_SAME(behind_wall(3, false, 0.5), lit, 0.01);
}

// --- without indirect visibility (rung R3) ------------------------------------------------------

// A black screen before a wall in the sun hides nothing, with one bounce or with more, where all
// surfaces along a ray count; what the lamp does not reach stays dark.
static struct stage *sunlit_wall_behind_screen(bool screen)
{
    struct stage *s = stage_create();
    const double wall[4][3] = {{-50, 0, -1}, {50, 0, -1}, {50, 1, -1}, {-50, 1, -1}};
    // Edge-on to the sun, which comes from above and in front.
    const double board[4][3] = {{-50, 0.4, -0.5}, {50, 0.4, -0.5}, {50, 0.1, -0.8}, {-50, 0.1, -0.8}};
    stage_quad(s, stage_material(s, 0.8f), wall);
    if (screen) stage_quad(s, stage_material(s, 0), board);
    const double towards[3] = {0, -1, -1};
    stage_light(s, BD_LIGHT_DIRECTIONAL, 0, 1, 0, towards, 5);
    return s;
}

static void screens_hide_nothing(void **state)
{
    (void)state;
    struct stage *open = sunlit_wall_behind_screen(false);
    struct stage *hidden = sunlit_wall_behind_screen(true);
    for (int vertices = 0; vertices < 2; vertices++)
        for (uint32_t bounces = 1; bounces < 3; bounces++) {
            struct bd_integrand i = lambert(bounces, BD_REFERENCE_PUNCTUAL);
            i.light_vertices = vertices;
            struct estimate free =
                stage_irradiance(open, &i, BD_PART_INDIRECT, 0, 0.1, 0, 0, 0.6, -0.8, 16384);
            struct estimate seen =
                stage_irradiance(hidden, &i, BD_PART_INDIRECT, 0, 0.1, 0, 0, 0.6, -0.8, 16384);
            i.indirect_visibility = false;
            struct estimate through =
                stage_irradiance(hidden, &i, BD_PART_INDIRECT, 0, 0.1, 0, 0, 0.6, -0.8, 16384);
            assert_true(seen.mean < 0.9 * free.mean);
            CHECK_SAME(through, free, 0.02);
        }
    stage_destroy(&open);
    stage_destroy(&hidden);
}

// --- alpha --------------------------------------------------------------------------------------

static int32_t add_checker(struct stage *s, float alpha_of_holes)
{
    const uint32_t size = 16;
    struct bd_scene *scene = s->scene;
    struct bd_picture *picture = calloc(1, sizeof *picture);
    *picture = (struct bd_picture){.reference_count = 1, .width_px = size, .height_px = size};
    picture->rgba = malloc(4 * size * size);
    for (uint32_t i = 0; i < size * size; i++) {
        memset(picture->rgba + 4 * i, 255, 4);
        if ((i % size + i / size) % 2) picture->rgba[4 * i + 3] = (uint8_t)(255 * alpha_of_holes);
    }
    bd_picture_seal(picture);
    scene->pictures = calloc(1, sizeof(struct bd_picture *));
    scene->pictures[0] = picture;
    scene->textures = calloc(1, sizeof *scene->textures);
    scene->textures[0] = (struct bd_texture){.picture = 0, .nearest = true};
    scene->picture_count = scene->texture_count = 1;
    int32_t material = stage_material(s, 0.5f);
    stage_material_at(s, material)->base_color_map.texture = 0;
    return material;
}

// Mean irradiance over a square below a screen, in a light straight from above.
static double below_screen(struct stage *s, enum bd_alpha_reading alpha)
{
    struct bd_integrand direct = lambert(0, BD_REFERENCE_PUNCTUAL);
    direct.alpha = alpha;
    double sum = 0;
    const int n = 32;
    for (int i = 0; i < n * n; i++)
        sum += stage_irradiance(s, &direct, BD_PART_DIRECT, (i % n + 0.5) / n - 0.5, -1,
                                (i / n + 0.5) / n - 0.5, 0, 1, 0, 64)
                   .mean;
    return sum / (n * n);
}

static void alpha_lets_light_pass(void **state)
{
    (void)state;
    const struct {
        enum bd_alpha_mode mode;
        float holes;
        double as_mask, as_coverage;
    } cases[] = {{BD_ALPHA_OPAQUE, 0, 0, 0},
                 {BD_ALPHA_MASK, 0, 0.5, 0.5},
                 {BD_ALPHA_BLEND, 0.2f, 0.5, 0.4},
                 {BD_ALPHA_BLEND, 0.8f, 0, 0.1}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct stage *s = stage_create();
        int32_t screen = add_checker(s, cases[i].holes);
        stage_material_at(s, screen)->alpha_mode = cases[i].mode;
        stage_floor(s, screen, 1, 0, 1);
        stage_floor(s, stage_material(s, 0), 1, -2, 1);
        stage_light(s, BD_LIGHT_DIRECTIONAL, 0, 1, 0, (const double[3]){0, -1, 0}, 1);
        assert_true(fabs(below_screen(s, BD_ALPHA_AS_MASK) - cases[i].as_mask) < 1e-6);
        // 65,536 draws at least: four deviations are .008 at most.
        assert_true(fabs(below_screen(s, BD_ALPHA_AS_COVERAGE) - cases[i].as_coverage) < 6e-3);
        stage_destroy(&s);
    }
}

// What is seen through coverage: share of the screen, share of what is behind.
static void coverage_is_seen_through(void **state)
{
    (void)state;
    struct stage *s = stage_create();
    int32_t screen = stage_material(s, 0), wall = stage_material(s, 0);
    stage_material_at(s, screen)->base_color[3] = 0.3f;
    stage_material_at(s, screen)->alpha_mode = BD_ALPHA_BLEND;
    stage_emission(s, screen, 2);
    stage_emission(s, wall, 10);
    stage_floor(s, screen, 1, 0, 1);
    stage_floor(s, wall, 4, -1, 1);
    const double eye[3] = {0.3, 2, 0}, target[3] = {0.3, 0, 0}; // off the diagonal
    uint32_t camera = stage_camera(s, eye, target, 0.2);
    CHECK(stage_radiance(s, &bd_integrand_full, camera, BD_PART_EMISSION, 2, 16384),
          0.3 * 2 + 0.7 * 10, 0);
    struct bd_integrand mask = bd_integrand_full;
    mask.alpha = BD_ALPHA_AS_MASK;
    CHECK(stage_radiance(s, &mask, camera, BD_PART_EMISSION, 2, 64), 10, 0);
    stage_destroy(&s);
}

// --- glass --------------------------------------------------------------------------------------

// A pane of index 1.5, seen at a right angle before a bright wall, clear or absorbing: all orders
// of reflection inside it add up to (1 - R)^2 a / (1 - R^2 a^2).
static void glass_pane(void **state)
{
    (void)state;
    const double r = 0.04;
    for (int tinted = 0; tinted < 2; tinted++) {
        struct stage *s = stage_create();
        int32_t glass = stage_material(s, 1), wall = stage_material(s, 0);
        struct bd_material *m = stage_material_at(s, glass);
        m->roughness = 0;
        m->transmission = 1;
        m->thickness_m = 0.2f;
        if (tinted) m->attenuation_distance_m = 0.1f;
        for (int k = 0; k < 3; k++) m->attenuation_color[k] = 0.7f;
        // A room's fronts are inside; with one axis turned round they are those of a solid.
        const double low[3] = {-1, 0.1, -1}, high[3] = {1, -0.1, 1};
        stage_box(s, glass, low, high);
        stage_emission(s, wall, 10);
        // Small: its own gloss must not see it in the pane.
        const double quad[4][3] = {{0.28, -1, 0.02}, {0.32, -1, 0.02}, {0.32, -1, -0.02}, {0.28, -1, -0.02}};
        stage_quad(s, wall, quad);
        const double eye[3] = {0.3, 2, 0}, target[3] = {0.3, 0, 0};
        uint32_t camera = stage_camera(s, eye, target, 1e-3);
        struct bd_integrand whole = bd_integrand_full;
        whole.lights = BD_REFERENCE_EMISSIVE;
        double a = tinted ? 0.49 : 1;
        double expected = 10 * (1 - r) * (1 - r) * a / (1 - r * r * a * a);
        CHECK(stage_radiance(s, &whole, camera, BD_PART_COUNT, 2, 32768), expected, 1e-4);
        stage_destroy(&s);
    }
}

// --- beyond what Embree traces ------------------------------------------------------------------

// A lit floor of a size, seen from above by a camera that the caller spoils.
static struct stage *create_lit_floor(double half, uint32_t *camera)
{
    struct stage *s = stage_create();
    stage_floor(s, stage_material(s, 0.5f), half, 0, 1);
    const double eye[3] = {0, 4 * half, 0}, down[3] = {0, -1, 0};
    stage_light(s, BD_LIGHT_POINT, 0, 2 * half, 0, down, 1);
    *camera = stage_camera(s, eye, origin, 0.4);
    return s;
}

static struct bd_reference_pixel trace_pixel(struct stage *s, uint32_t camera)
{
    struct bd_reference_pixel pixel = {0};
    const struct bd_reference_view view = {.width_px = 1, .height_px = 1, .camera = camera};
    stage_finish(s, 1);
    bd_reference_trace(s->reference, &bd_integrand_full, &view, 1, 0, 0, 0, 8, &pixel);
    assert_int_equal(pixel.sample_count[0] + pixel.sample_count[1], 16);
    assert_int_equal(pixel.nonfinite_count, 0);
    return pixel;
}

// No import and no edit lets such numbers pass any more; journals of earlier versions hold them.
static void numbers_out_of_range_are_counted(void **state)
{
    (void)state;
    const struct {
        double half;
        bool orthographic;
        float near_m, ymag;
        double lamp_height, refused; // `refused` of 16 samples; below 0: at least one
    } cases[] = {
        {1, false, 0.1f, 0, 2, 0},         {1, false, 1e19f, 0, 2, 16},
        {1, false, FLT_MAX, 0, 2, 16},     {1, true, 0, 1, 2, 0},
        {1, true, 1e19f, 1, 2, 16},        {1e-6, true, FLT_MAX, FLT_MAX, 2e-6, 16},
        {1e-6, false, 1e-7f, 0, 1e15, -1},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        uint32_t index;
        struct stage *s = create_lit_floor(cases[i].half, &index);
        struct bd_camera *camera = &s->scene->cameras[0];
        camera->orthographic = cases[i].orthographic;
        camera->near_m = cases[i].near_m;
        camera->xmag = camera->ymag = cases[i].ymag;
        for (uint32_t n = 0; n < s->scene->node_count; n++)
            if (s->scene->nodes[n].light != BD_NONE)
                s->scene->nodes[n].parent_from_node.m[13] = cases[i].lamp_height;
        struct bd_reference_pixel pixel = trace_pixel(s, index);
        if (cases[i].refused < 0)
            assert_true(pixel.refused_ray_count > 0);
        else
            assert_int_equal(pixel.refused_ray_count, cases[i].refused);
        assert_int_equal(pixel.coverage, cases[i].refused == 16 ? 0 : 16);
        stage_destroy(&s);
    }
}

// The builder leaves out triangles with such vertices by itself: the others are there.
static void vertices_out_of_range_are_left_out(void **state)
{
    (void)state;
    const float spoilt[] = {NAN, INFINITY, -INFINITY, FLT_MAX};
    for (size_t i = 0; i < sizeof spoilt / sizeof *spoilt; i++) {
        uint32_t camera;
        struct stage *s = create_lit_floor(1, &camera);
        stage_floor(s, stage_material(s, 0.5f), 1, 1, 1);
        stage_finish(s, 1); // bounds are of sound vertices, as an import's are
        bd_reference_destroy(&s->reference);
        for (int v = 0; v < 6; v++) s->scene->meshes[1]->primitives[0].position[3 * v] = spoilt[i];
        struct bd_err_detail detail = {0};
        assert_int_equal(bd_reference_create(s->scene, 1, NULL, NULL, &s->reference, &detail),
                         BD_ERR_OK);
        struct bd_reference_pixel pixel = trace_pixel(s, camera);
        assert_int_equal(pixel.coverage, 16);
        assert_float_equal(pixel.depth_m / 16, 4, 1e-4);
        stage_destroy(&s);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(concentric_spheres),
        cmocka_unit_test(sphere_over_floor),
        cmocka_unit_test(closed_rooms_stay_dark),
        cmocka_unit_test(lamps_stay_in_their_room),
        cmocka_unit_test(camera_inside_a_solid),
        cmocka_unit_test(floors_at_any_scale),
        cmocka_unit_test(sides_of_walls),
        cmocka_unit_test(screens_hide_nothing),
        cmocka_unit_test(alpha_lets_light_pass),
        cmocka_unit_test(coverage_is_seen_through),
        cmocka_unit_test(glass_pane),
        cmocka_unit_test(numbers_out_of_range_are_counted),
        cmocka_unit_test(vertices_out_of_range_are_left_out),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
