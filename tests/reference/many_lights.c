// Scenes of many lights: as exact as before, and legible after a few samples.

#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "base/pool.h"
#include "reference/sampler.h"
#include "stage.h"
#include "tests/unit/cmocka_all.h"

static struct bd_integrand integrand(bool by_flux)
{
    struct bd_integrand integrand = bd_integrand_full;
    integrand.lights_by_flux = by_flux;
    integrand.lambert = true;
    return integrand;
}

// Uniform in [0, 1).
static double uniform(uint64_t *state)
{
    return (double)(bd_mix64((*state)++) >> 11) * 0x1p-53;
}

// --- the corridor -------------------------------------------------------------------------------

enum lamp_shape { PANEL, SPHERE };

static void add_corridor_lamp(struct stage *s, int32_t glow, enum lamp_shape shape, double x,
                              double z)
{
    const double panel[4][3] = {{x - .1, 2.9, z - .05},
                                {x + .1, 2.9, z - .05},
                                {x + .1, 2.9, z + .05},
                                {x - .1, 2.9, z + .05}};
    if (shape == PANEL)
        stage_quad(s, glow, panel);
    else
        stage_sphere(s, glow, (const double[3]){x, 2.8, z}, 0.07, 1, false);
}

// 36 m with pillars, in which each lamp lights a few metres.
static struct stage *make_corridor(enum lamp_shape shape, int lamp_count, int spot_count)
{
    struct stage *s = stage_create();
    int32_t white = stage_material(s, 0.7f), glow = stage_material(s, 0.5f);
    stage_emission(s, glow, 2000);
    stage_material_at(s, glow)->double_sided = false;
    stage_box(s, white, (const double[3]){-1.5, 0, -36}, (const double[3]){1.5, 3, 0});
    for (int i = 0; i < 6; i++) {
        double z = -5.5 - 5.5 * i, x = i % 2 ? 1.15 : -1.15;
        const double low[3] = {x + .2, 0, z + .2}, high[3] = {x - .2, 3, z - .2};
        stage_box(s, white, low, high);
    }
    if (lamp_count == 1) add_corridor_lamp(s, glow, shape, 0.3, -12);
    for (int i = 0; lamp_count > 1 && i < lamp_count; i++)
        add_corridor_lamp(s, glow, shape, i % 2 ? 0.7 : -0.7,
                          -0.5 - (i / 2) * 35.0 / (lamp_count / 2 - 1));
    for (int i = 0; i < spot_count; i++)
        stage_light(s, BD_LIGHT_SPOT, i % 2 ? 1.3 : -1.3, 2.6, -1 - 34.0 * i / spot_count,
                    (const double[3]){i % 2 ? -1 : 1, -1.5, 0.3}, 60);
    const double eye[3] = {0.2, 1.6, -0.3};
    stage_camera(s, eye, (const double[3]){0, 1.3, -10}, 1.1);
    stage_finish(s, 1);
    return s;
}

#define SIZE 32

struct noise {
    double direct, beauty; // root mean square error of half a picture over its mean
};

// By the two halves' difference.
static struct noise noise_of(struct stage *stage, const struct bd_integrand *of, uint32_t samples)
{
    const struct bd_reference_view view = {.width_px = SIZE, .height_px = SIZE};
    double square[2] = {0, 0}, sum[2] = {0, 0};
    for (uint32_t i = 0; i < SIZE * SIZE; i++) {
        struct bd_reference_pixel p = {0};
        bd_reference_trace(stage->reference, of, &view, 7, i % SIZE, i / SIZE, 0, samples, &p);
        double total[2] = {0, 0};
        const enum bd_reference_part parts[3] = {BD_PART_DIRECT, BD_PART_INDIRECT,
                                                 BD_PART_EMISSION};
        for (int l = 0, k = 0; l < 2; l++) {
            for (; k < (l ? 3 : 1); k++)
                for (int half = 0; half < 2; half++) total[half] += p.sum[half][parts[k]][0];
            sum[l] += (total[0] + total[1]) / 2;
            square[l] += pow(total[0] - total[1], 2) / 2;
        }
    }
    double per[2];
    for (int l = 0; l < 2; l++) per[l] = sqrt(square[l] * SIZE * SIZE) / sum[l];
    return (struct noise){per[0], per[1]};
}

// How many times the samples of one lamp, for the same error.
static void check_corridor(enum lamp_shape shape)
{
    const struct bd_integrand by_place = integrand(false), by_flux = integrand(true);
    struct stage *one = make_corridor(shape, 1, 0), *many = make_corridor(shape, 120, 40);
    const struct noise alone = noise_of(one, &by_place, 16);
    const struct noise now = noise_of(many, &by_place, 16);
    const struct noise before = noise_of(many, &by_flux, 16);
    const double direct = pow(now.direct / alone.direct, 2);
    const double beauty = pow(now.beauty / alone.beauty, 2);
    const double flux = pow(before.direct / alone.direct, 2);
    print_message("    samples of one lamp's: direct %.2f (by flux %.1f), beauty %.2f (%.1f)\n",
                  direct, flux, beauty, pow(before.beauty / alone.beauty, 2));
    assert_true(direct <= 4);
    assert_true(beauty <= 4);
    assert_true(flux > 8); // or the corridor is no test
    stage_destroy(&one);
    stage_destroy(&many);
}

static void a_corridor_of_panels_is_legible(void **state)
{
    (void)state;
    check_corridor(PANEL);
}

static void a_corridor_of_spheres_is_legible(void **state)
{
    (void)state;
    check_corridor(SPHERE);
}

// --- closed forms -------------------------------------------------------------------------------

// Without the rig that stands in where a scene has no lamps.
static const struct bd_integrand glow_alone = {
    .indirect_visibility = true, .lights = BD_REFERENCE_EMISSIVE, .clamp_per_m2 = INFINITY};

struct panel {
    double corners[4][3];
    double cd_m2;
};

// Lambert's formula: irradiance per luminance of a polygon above the horizon.
static double form_of(const struct panel *panel, const double p[3], const double n[3])
{
    double v[4][3], sum = 0;
    for (int c = 0; c < 4; c++) {
        double length = 0;
        for (int k = 0; k < 3; k++) v[c][k] = panel->corners[c][k] - p[k];
        for (int k = 0; k < 3; k++) length += v[c][k] * v[c][k];
        for (int k = 0; k < 3; k++) v[c][k] /= sqrt(length);
    }
    for (int c = 0; c < 4; c++) {
        const double *a = v[c], *b = v[(c + 1) % 4];
        const double cross[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                                 a[0] * b[1] - a[1] * b[0]};
        double length = 0, along = 0, cosine = 0;
        for (int k = 0; k < 3; k++) {
            length += cross[k] * cross[k];
            along += cross[k] * n[k];
            cosine += a[k] * b[k];
        }
        length = sqrt(length);
        if (length > 0) sum += atan2(length, cosine) * along / length;
    }
    return fabs(sum) / 2;
}

#define PANELS 64

// A ceiling of panels of all sizes, which face down but for some that face up. They shadow nothing.
static void make_panels(double scale, const double offset[3], struct panel panels[PANELS],
                        struct stage *s)
{
    uint64_t random = 5;
    for (int i = 0; i < PANELS; i++) {
        double x = (i % 8 - 3.5) * scale, z = (i / 8 - 3.5) * scale;
        double half = scale * (0.01 + 0.4 * uniform(&random));
        int32_t glow = stage_material(s, 0.5f);
        panels[i].cd_m2 = pow(10, 4 * uniform(&random));
        const double corners[4][3] = {{x - half, scale, z - half},
                                      {x + half, scale, z - half},
                                      {x + half, scale, z + half},
                                      {x - half, scale, z + half}};
        memcpy(panels[i].corners, corners, sizeof corners);
        stage_emission(s, glow, (float)panels[i].cd_m2);
        stage_material_at(s, glow)->double_sided = false;
        bool up = i % 5 == 2;
        double turned[4][3];
        for (int c = 0; c < 4; c++) memcpy(turned[c], corners[up ? 3 - c : c], sizeof turned[c]);
        int32_t node = stage_quad(s, glow, (const double(*)[3])turned);
        for (int k = 0; k < 3; k++) s->scene->nodes[node].parent_from_node.m[12 + k] = offset[k];
        if (up) panels[i].cd_m2 = 0;
    }
}

static void check_panels(double scale, double offset_m, double relative)
{
    const double points[4][3] = {{0, 0, 0}, {3.1, 0.9, -2.2}, {-6, -1, 3}, {0.5, -5, 0.5}};
    const double offset[3] = {offset_m, -offset_m, 2 * offset_m}, up[3] = {0, 1, 0};
    struct panel panels[PANELS];
    struct stage *s = stage_create();
    make_panels(scale, offset, panels, s);
    for (int i = 0; i < 4; i++) {
        double expected = 0, at[3];
        for (int k = 0; k < 3; k++) at[k] = points[i][k] * scale;
        for (int l = 0; l < PANELS; l++) expected += panels[l].cd_m2 * form_of(&panels[l], at, up);
        for (int k = 0; k < 3; k++) at[k] += offset[k];
        CHECK(
            stage_irradiance(s, &glow_alone, BD_PART_DIRECT, at[0], at[1], at[2], 0, 1, 0, 1 << 14),
            expected, relative);
    }
    stage_destroy(&s);
}

static void panels_give_what_is_known_on_paper(void **state)
{
    (void)state;
    check_panels(1, 0, 1e-4);
}

static void size_and_place_change_nothing(void **state)
{
    (void)state;
    check_panels(1e-6, 0, 1e-4);
    check_panels(1e6, 0, 1e-4);
    check_panels(1, 1e7, 1e-4);
}

// --- hard places --------------------------------------------------------------------------------

// In the plane of the lamps, before them, and behind the receiver: nothing, and no number that is
// none. Triangles without area take no part.
static void lamps_in_the_plane_give_nothing(void **state)
{
    (void)state;
    struct panel panels[PANELS];
    struct stage *s = stage_create();
    make_panels(1, (const double[3]){0, 0, 0}, panels, s);
    const float point[9] = {0, 1, 0, 0, 1, 0, 0, 1, 0}, line[9] = {0, 1, 0, 1, 1, 0, 2, 1, 0};
    const uint32_t indices[3] = {0, 1, 2};
    int32_t glow = stage_material(s, 0.5f);
    stage_emission(s, glow, 1e6f);
    stage_triangles(s, glow, point, NULL, indices, 3);
    stage_triangles(s, glow, line, NULL, indices, 3);
    const double at[3][4] = {{0.97, 1, 0.51, 1}, {20, 1, 3, 1}, {0, 0, 0, -1}};
    for (int i = 0; i < 3; i++) {
        struct estimate found = stage_irradiance(s, &glow_alone, BD_PART_DIRECT, at[i][0], at[i][1],
                                                 at[i][2], 0, at[i][3], 0, 1024);
        assert_true(fabs(found.mean) < 1e-3);
    }
    stage_destroy(&s);
}

// A billion times the luminance behind a wall: the lamps before it are still seen.
static void a_strong_lamp_behind_a_wall_hides_no_others(void **state)
{
    (void)state;
    struct panel panels[PANELS];
    struct stage *s = stage_create();
    make_panels(1, (const double[3]){0, 0, 0}, panels, s);
    int32_t strong = stage_material(s, 0.5f), wall = stage_material(s, 0.5f);
    stage_emission(s, strong, 1e13f);
    stage_disc(s, strong, 0.3, 2, -1, 12);
    stage_floor(s, wall, 5, 1.5, -1);
    const double at[3] = {0.2, 0, 0.3}, up[3] = {0, 1, 0};
    double expected = 0;
    for (int l = 0; l < PANELS; l++) expected += panels[l].cd_m2 * form_of(&panels[l], at, up);
    struct estimate found =
        stage_irradiance(s, &glow_alone, BD_PART_DIRECT, at[0], at[1], at[2], 0, 1, 0, 1 << 15);
    CHECK(found, expected, 0.03);
    assert_true(found.error < 0.05 * expected);
    stage_destroy(&s);
}

// The same of lamps, which nothing but the choice can find: noisy, where a choice by power alone
// would find none.
static void nor_does_a_strong_spot(void **state)
{
    (void)state;
    struct stage *s = stage_create();
    struct bd_integrand direct = glow_alone;
    direct.lights = BD_REFERENCE_PUNCTUAL;
    double expected = 0;
    for (int i = 0; i < 40; i++) {
        double x = i % 8 - 3.5, z = i / 8 - 2.5, squared = x * x + 1 + z * z;
        stage_light(s, BD_LIGHT_POINT, x, 1, z, NULL, 1);
        expected += 1 / (squared * sqrt(squared));
    }
    stage_light(s, BD_LIGHT_POINT, 0, 2, 0, NULL, 1e9f);
    stage_floor(s, stage_material(s, 0.5f), 1, 1.5, -1);
    struct estimate found = stage_irradiance(s, &direct, BD_PART_DIRECT, 0, 0, 0, 0, 1, 0, 1 << 15);
    CHECK(found, expected, 0);
    assert_true(found.error < 0.6 * expected);
    stage_destroy(&s);
}

// --- two estimators -----------------------------------------------------------------------------

// A heap of triangles that glow, some on both sides, between walls of which some shine and one lets
// light pass; spots and points out of and in range; `afar` directional lights.
static struct stage *make_heap(double scale, int lamp_count, int afar)
{
    struct stage *s = stage_create();
    uint64_t random = 21;
    int32_t white = stage_material(s, 0.6f), glass = stage_material(s, 0.8f);
    int32_t gloss = stage_material(s, 0.5f), glow[4];
    stage_material_at(s, gloss)->roughness = 0.3f;
    stage_material_at(s, glass)->transmission = 0.7f;
    stage_material_at(s, glass)->roughness = 0.5f;
    for (int i = 0; i < 4; i++) {
        glow[i] = stage_material(s, 0.3f);
        stage_emission(s, glow[i], powf(4, (float)i));
        stage_material_at(s, glow[i])->double_sided = i % 2;
    }
    stage_floor(s, white, 2 * scale, -scale, 1);
    stage_floor(s, gloss, 2 * scale, 1.5 * scale, -1);
    stage_sphere(s, glass, (const double[3]){0.3 * scale, -0.3 * scale, 0.4 * scale}, 0.4 * scale,
                 2, false);
    for (int i = 0; i < 80; i++) {
        const uint32_t indices[3] = {0, 1, 2};
        float positions[9];
        double middle[3];
        for (int k = 0; k < 3; k++) middle[k] = 1.6 * (uniform(&random) - 0.5);
        for (int k = 0; k < 9; k++)
            positions[k] = (float)(scale * (middle[k % 3] + 0.2 * (uniform(&random) - 0.5)));
        stage_triangles(s, glow[i % 4], positions, NULL, indices, 3);
    }
    for (int i = 0; i < lamp_count + afar; i++) {
        enum bd_light_kind kind = i >= lamp_count ? BD_LIGHT_DIRECTIONAL
                                  : i % 3         ? BD_LIGHT_SPOT
                                                  : BD_LIGHT_POINT;
        const double along[3] = {uniform(&random) - 0.5, -0.3, uniform(&random) - 0.5};
        double at[3];
        for (int k = 0; k < 3; k++) at[k] = 2 * scale * (uniform(&random) - 0.5);
        struct bd_light *light = stage_light(s, kind, at[0], at[1], at[2], along,
                                             (float)(i >= lamp_count ? 0.3 : 0.4 * scale * scale));
        if (i % 4 == 0) light->range_m = (float)scale;
    }
    stage_camera(s, (const double[3]){0, 0.2 * scale, 3 * scale}, (const double[3]){0, 0, 0}, 0.8);
    s->scene->cameras[0].near_m = (float)(scale / 64);
    return s;
}

// By flux a single sample of indirect light may be a tenth of the picture.
static void compare(double scale, int lamp_count, int afar, uint32_t lights, bool lambert)
{
    struct stage *s = make_heap(scale, lamp_count, afar);
    struct bd_integrand by_place = integrand(false), by_flux = integrand(true);
    by_place.lights = by_flux.lights = lights;
    by_place.lambert = by_flux.lambert = lambert;
    by_place.bounces_max = by_flux.bounces_max = 1;
    for (enum bd_reference_part part = BD_PART_DIRECT; part <= BD_PART_INDIRECT; part++)
        CHECK_SAME(stage_radiance(s, &by_place, 0, part, 8, 1024),
                   stage_radiance(s, &by_flux, 0, part, 8, 2048),
                   part == BD_PART_DIRECT ? 0.05 : 0.25);
    stage_destroy(&s);
}

static void both_choices_have_the_same_mean(void **state)
{
    (void)state;
    compare(1, 0, 0, BD_REFERENCE_EMISSIVE, true);
    compare(1, 0, 0, BD_REFERENCE_EMISSIVE, false);
    compare(1, 40, 0, BD_REFERENCE_PUNCTUAL, true);
    compare(1e-4, 40, 3, BD_REFERENCE_PUNCTUAL, false);
    compare(1e4, 14, 7, BD_REFERENCE_ALL_LIGHTS, false);
}

// --- threads ------------------------------------------------------------------------------------

struct picture {
    const struct stage *stage;
    uint32_t batch;
    struct bd_reference_pixel pixels[SIZE * SIZE];
};

static void trace_pixel(void *user, uint32_t i)
{
    struct picture *p = user;
    const struct bd_reference_view view = {.width_px = SIZE, .height_px = SIZE};
    for (uint32_t first = 0; first < 4; first += p->batch)
        bd_reference_trace(p->stage->reference, &bd_integrand_full, &view, 3, i % SIZE, i / SIZE,
                           first, p->batch, &p->pixels[i]);
}

static void trace_picture(struct picture *picture, double scale, uint32_t threads, uint32_t batch)
{
    struct stage *s = make_heap(scale, 40, 3);
    stage_finish(s, threads);
    memset(picture, 0, sizeof *picture);
    picture->stage = s;
    picture->batch = batch;
    struct bd_pool *pool = bd_pool_create(threads);
    assert_int_equal(bd_pool_run(pool, SIZE * SIZE, trace_pixel, NULL, picture), BD_ERR_OK);
    bd_pool_destroy(&pool);
    stage_destroy(&s);
}

static void threads_batches_and_another_build_change_nothing(void **state)
{
    (void)state;
    static struct picture one, other;
    trace_picture(&one, 1, 1, 4);
    trace_picture(&other, 1, 3, 1);
    for (uint32_t p = 0; p < SIZE * SIZE; p++)
        assert_memory_equal(one.pixels[p].sum, other.pixels[p].sum, sizeof one.pixels[p].sum);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_corridor_of_panels_is_legible),
        cmocka_unit_test(a_corridor_of_spheres_is_legible),
        cmocka_unit_test(panels_give_what_is_known_on_paper),
        cmocka_unit_test(size_and_place_change_nothing),
        cmocka_unit_test(lamps_in_the_plane_give_nothing),
        cmocka_unit_test(a_strong_lamp_behind_a_wall_hides_no_others),
        cmocka_unit_test(nor_does_a_strong_spot),
        cmocka_unit_test(both_choices_have_the_same_mean),
        cmocka_unit_test(threads_batches_and_another_build_change_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
