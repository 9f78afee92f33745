// How surfaces scatter, against closed forms and against themselves.

#include "reference/bsdf.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "reference/bsdf_albedo.h"
#include "reference/bsdf_microfacet.h"
#include "tests/tools/bsdf_once.h"

#define PI 3.14159265358979323846

// Cells of the sphere: equal solid angles.
#define RINGS   24
#define SECTORS 24

static uint64_t state_of_numbers = 1;

// PCG32 (O'Neill 2014), so that a failure repeats.
static float uniform(void)
{
    uint64_t old = state_of_numbers;
    state_of_numbers = old * 6364136223846793005u + 1442695040888963407u;
    uint32_t shifted = (uint32_t)(((old >> 18) ^ old) >> 27), turn = (uint32_t)(old >> 59);
    uint32_t bits = (shifted >> turn) | (shifted << ((32 - turn) & 31));
    return (float)(bits >> 8) * 0x1p-24f;
}

static struct bd_surface surface_of(float metallic, float roughness, float transmission)
{
    return (struct bd_surface){
        .normal_geometric = {0, 0, 1},
        .normal = {0, 0, 1},
        .base_color = {1, 1, 1},
        .metallic = metallic,
        .roughness = roughness,
        .ior = 1.5f,
        .transmission = transmission,
        .thin = true,
        .entering = true,
    };
}

static void direction(float cosine, float phi, float out[3])
{
    float sine = sqrtf(fmaxf(1 - cosine * cosine, 0));
    out[0] = sine * cosf(phi), out[1] = sine * sinf(phi), out[2] = cosine;
}

// What comes back of light that is 1 from everywhere, in what is conserved: radiance by the square
// of the index.
static double albedo(const struct bd_surface *s, const float wo[3], int side)
{
    double sum = 0, through = s->thin ? 1 : s->entering ? s->ior * s->ior : 1 / (s->ior * s->ior);
    for (int a = 0; a < side; a++) {
        for (int b = 0; b < side; b++) {
            float u[3] = {((float)a + uniform()) / (float)side,
                          ((float)b + uniform()) / (float)side, uniform()};
            struct bd_bsdf_sample sample;
            if (!sample_once(s, wo, u, &sample)) continue;
            assert_true(isfinite(sample.weight[0]) && sample.weight[0] >= 0);
            sum += sample.weight[0] * (sample.transmitted ? through : 1);
        }
    }
    return sum / (side * side);
}

// --- closed forms -----------------------------------------------------------------------------

// D11, by sampling and, where a grid can resolve the lobe, by evaluation alone.
static void ggx_albedos(void **state)
{
    (void)state;
    static const double expected[3][3] = {
        {.98831, .96914, .88410}, {.68785, .69825, .86009}, {.30685, .45069, .76021}};
    static const float alphas[3] = {.1f, .5f, 1}, cosines[3] = {1, .5f, .1f};
    for (int a = 0; a < 3; a++) {
        struct bd_surface s = surface_of(1, sqrtf(alphas[a]), 0);
        for (int c = 0; c < 3; c++) {
            float wo[3];
            direction(cosines[c], 0, wo);
            assert_true(fabs(albedo(&s, wo, 300) - expected[a][c]) < 2e-3);
            if (alphas[a] < .5f) continue;
            double sum = 0;
            for (int i = 0; i < 400; i++) {
                for (int k = 0; k < 400; k++) {
                    float wi[3], f[3], pdf;
                    direction(((float)i + .5f) / 400, 2 * (float)PI * ((float)k + .5f) / 400, wi);
                    eval_once(&s, wo, wi, f, &pdf);
                    sum += f[0] * 2 * PI / 160000;
                }
            }
            assert_true(fabs(sum - expected[a][c]) < 5e-4);
        }
    }
}

static double dot(const float a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// Appendix B as it is printed there, in double, away from grazing angles.
static double appendix_b(const struct bd_surface *s, int channel, const float wo[3],
                         const float wi[3])
{
    double h[3] = {wo[0] + wi[0], wo[1] + wi[1], wo[2] + wi[2]};
    double length = sqrt(h[0] * h[0] + h[1] * h[1] + h[2] * h[2]);
    for (int k = 0; k < 3; k++) h[k] /= length;
    double a2 = pow(s->roughness, 4), n_l = wi[2], n_v = wo[2], base = s->base_color[channel];
    double d = a2 / (PI * pow(h[2] * h[2] * (a2 - 1) + 1, 2));
    double g_l = 2 * n_l / (n_l + sqrt(a2 + (1 - a2) * n_l * n_l));
    double g_v = 2 * n_v / (n_v + sqrt(a2 + (1 - a2) * n_v * n_v));
    // Height-correlated, from the two one-sided terms: 1 / G = 1 / G_l + 1 / G_v - 1.
    double specular = d / (1 / g_l + 1 / g_v - 1) / (4 * n_l * n_v);
    double grazing = pow(1 - fabs(dot(wo, h)), 5), f0 = pow((1 - s->ior) / (1 + s->ior), 2);
    double fresnel = f0 + (1 - f0) * grazing;
    double dielectric = base / PI * (1 - fresnel) + specular * fresnel;
    double metal = specular * (base + (1 - base) * grazing);
    return dielectric * (1 - s->metallic) + metal * s->metallic;
}

static void agrees_with_appendix_b(void **state)
{
    (void)state;
    for (int k = 0; k < 5000; k++) {
        struct bd_surface s = surface_of(uniform(), .25f + .75f * uniform(), 0);
        s.base_color[0] = .5f * uniform(), s.base_color[1] = .5f, s.ior = 1 + uniform();
        float wo[3], wi[3], f[3], pdf;
        direction(.15f + .85f * uniform(), 6 * uniform(), wo);
        direction(.15f + .85f * uniform(), 6 * uniform(), wi);
        eval_once(&s, wo, wi, f, &pdf);
        for (int j = 0; j < 2; j++) {
            double expected = appendix_b(&s, j, wo, wi) * wi[2];
            assert_true(fabs(f[j] - expected) < 1e-4 * expected + 1e-6);
        }
    }
}

// Hazard 16: a roughness of .01 has alpha 1e-4, below what the lobe is allowed.
static void sharp_lobes_are_mirrors(void **state)
{
    (void)state;
    for (float cosine = 1; cosine > .02f; cosine *= .7f) {
        float wo[3];
        direction(cosine, 1, wo);
        struct bd_surface s = surface_of(1, .01f, 0);
        assert_true(fabs(albedo(&s, wo, 200) - 1) < 1e-3);
        s.roughness = 0;
        assert_true(bd_bsdf_is_delta(&s));
        struct bd_bsdf_sample sample;
        assert_true(sample_once(&s, wo, (float[3]){.3f, .6f, .5f}, &sample));
        assert_true(sample.delta && sample.pdf == 0 && fabsf(sample.weight[1] - 1) < 1e-6f);
        assert_true(fabsf(sample.wi[0] + wo[0]) < 1e-6f && fabsf(sample.wi[2] - wo[2]) < 1e-6f);
    }
    struct bd_surface plastic = surface_of(0, 0, 0);
    assert_false(bd_bsdf_is_delta(&plastic));
}

// D10, and Brewster's angle, the critical angle and total reflection.
static void fresnel(void **state)
{
    (void)state;
    assert_true(fabs(bd_fresnel_dielectric(1, 1.5f) - .04) < 1e-7);
    assert_true(fabs(bd_fresnel_dielectric(1, 1 / 1.5f) - .04) < 1e-7);
    assert_true(bd_fresnel_dielectric(0, 1.5f) == 1);
    double brewster = cos(atan(1.5)); // only the perpendicular part: ((1 - n^2) / (1 + n^2))^2 / 2
    assert_true(fabs(bd_fresnel_dielectric((float)brewster, 1.5f) - .5 * pow(1.25 / 3.25, 2)) <
                1e-6);
    double critical = sqrt(1 - 1 / 2.25);
    assert_true(bd_fresnel_dielectric((float)critical - 1e-4f, 1 / 1.5f) == 1);
    assert_true(bd_fresnel_dielectric((float)critical + 1e-2f, 1 / 1.5f) < .7f);
    assert_true(bd_fresnel_dielectric(.5f, 0) == 1);
}

// D10: a slab of two smooth faces lets (1 - R) / (1 + R) pass, followed through its reflections.
static void slab_transmits(void **state)
{
    (void)state;
    double through = 0;
    const int paths = 200000;
    for (int p = 0; p < paths; p++) {
        struct bd_surface face = surface_of(0, 0, 1);
        face.thin = false;
        double weight = 1;
        float wo[3] = {0, 0, 1};
        for (int k = 0; k < 64; k++) {
            struct bd_bsdf_sample sample;
            const float u[3] = {uniform(), uniform(), uniform()};
            assert_true(sample_once(&face, wo, u, &sample));
            assert_true(sample.delta);
            weight *= sample.weight[0];
            if (sample.transmitted == face.entering) {
                face.entering = false; // inside, at the other face
            } else if (sample.transmitted) {
                through += k % 2 == 1 ? weight : 0; // left by the far face
                break;
            } else if (face.entering) {
                break; // reflected off the front
            }
        }
    }
    assert_true(fabs(through / paths - .9230769) < 3e-3);
}

// Snell: a direction that enters under 60 degrees runs under asin(sin 60 / 1.5).
static void refraction_bends(void **state)
{
    (void)state;
    struct bd_surface glass = surface_of(0, 0, 1);
    glass.thin = false;
    float wo[3];
    direction(.5f, 0, wo);
    struct bd_bsdf_sample sample;
    assert_true(sample_once(&glass, wo, (float[3]){.5f, .5f, .999f}, &sample));
    assert_true(sample.transmitted && sample.wi[2] < 0);
    assert_true(fabsf(sample.wi[0] + wo[0] / 1.5f) < 1e-6f);
    // Radiance, not flux: compressed by the index squared.
    assert_true(fabsf(sample.weight[0] - 1 / 2.25f) < 1e-6f);
    glass.thin = true;
    assert_true(sample_once(&glass, wo, (float[3]){.5f, .5f, .999f}, &sample));
    assert_true(sample.transmitted && fabsf(sample.wi[0] + wo[0]) < 1e-6f &&
                fabsf(sample.wi[2] + wo[2]) < 1e-6f && sample.weight[0] == 1);
}

// --- agreement with itself --------------------------------------------------------------------

struct sweep {
    float metallic, roughness, transmission;
    bool thin, entering;
    float ior;
};

static const struct sweep sweeps[] = {
    {0, 1, 0, true, true, 1.5f},      {0, .5f, 0, true, true, 1.5f},
    {.5f, .7f, 0, true, true, 1.5f},  {1, .4f, 0, true, true, 1.5f},
    {1, 1, 0, true, true, 1.5f},      {0, .6f, 1, true, true, 1.5f},
    {.2f, .8f, .5f, true, true, 2},   {0, .6f, 1, false, true, 1.5f},
    {0, .6f, 1, false, false, 1.5f},  {0, .9f, .7f, false, true, 1.3f},
    {.3f, .5f, .5f, false, false, 2}, {0, 0, 0, true, true, 1.5f},
};
static const float cosines[] = {.95f, .5f, .12f};

static struct bd_surface swept(const struct sweep *at)
{
    struct bd_surface s = surface_of(at->metallic, at->roughness, at->transmission);
    s.thin = at->thin, s.entering = at->entering, s.ior = at->ior;
    s.base_color[1] = .6f, s.base_color[2] = .1f;
    return s;
}

// Share of the pdf in each cell, by a grid in it. `wide`: turned frame, so that the world's
// axes are not the surface's.
static double fill_cells(const struct bd_surface *s, const float wo[3], double *cells)
{
    const int fine = 16;
    double total = 0;
    for (int ring = 0; ring < RINGS * fine; ring++) {
        for (int sector = 0; sector < SECTORS * fine; sector++) {
            float wi[3], f[3], pdf;
            direction(1 - 2 * ((float)ring + .5f) / (RINGS * fine),
                      2 * (float)PI * ((float)sector + .5f) / (SECTORS * fine), wi);
            eval_once(s, wo, wi, f, &pdf);
            assert_true(pdf >= 0 && isfinite(pdf));
            // What can be evaluated can be sampled.
            assert_true(pdf > 0 || f[0] == 0);
            double share = pdf * 4 * PI / (RINGS * SECTORS * fine * fine);
            cells[ring / fine * SECTORS + sector / fine] += share;
            total += share;
        }
    }
    return total;
}

// Samples fall into the cells as the pdf says; what is not in the pdf was absorbed or is a
// delta lobe's. Pearson's statistic over the cells that expect 20 or more.
static void density_is_what_is_sampled(void **state)
{
    (void)state;
    static double cells[RINGS * SECTORS];
    static uint32_t counts[RINGS * SECTORS];
    const int samples = 60000;
    for (size_t i = 0; i < sizeof sweeps / sizeof *sweeps; i++) {
        for (size_t c = 0; c < sizeof cosines / sizeof *cosines; c++) {
            struct bd_surface s = swept(&sweeps[i]);
            float wo[3];
            direction(cosines[c], .7f, wo);
            memset(cells, 0, sizeof cells);
            memset(counts, 0, sizeof counts);
            double total = fill_cells(&s, wo, cells);
            assert_true(total < 1.003);
            int kept = 0, delta = 0;
            for (int k = 0; k < samples; k++) {
                const float u[3] = {uniform(), uniform(), uniform()};
                struct bd_bsdf_sample sample;
                if (!sample_once(&s, wo, u, &sample)) continue;
                if (sample.delta) {
                    delta++;
                    continue;
                }
                kept++;
                int ring = (int)((1 - sample.wi[2]) * .5f * RINGS);
                double turn = atan2(sample.wi[1], sample.wi[0]) / (2 * PI);
                int sector = (int)((turn < 0 ? turn + 1 : turn) * SECTORS);
                ring = ring >= RINGS ? RINGS - 1 : ring;
                counts[ring * SECTORS + sector % SECTORS]++;
            }
            double sigma = sqrt(samples * total * (1 - fmin(total, 1)) + 1);
            assert_true(fabs(kept - samples * total) < 4.5 * sigma + .003 * samples);
            assert_true(sweeps[i].roughness > 0 ? delta == 0 : delta > 0);
            double statistic = 0;
            int freedom = 0;
            for (int k = 0; k < RINGS * SECTORS; k++) {
                double expected = cells[k] * samples;
                if (expected < 20) continue;
                statistic += (counts[k] - expected) * (counts[k] - expected) / expected;
                freedom++;
            }
            assert_true(freedom > 20);
            // Five standard deviations, and some for what the grid itself gets wrong.
            assert_true(statistic < freedom + 5 * sqrt(2.0 * freedom) + .1 * freedom);
        }
    }
}

static void weight_times_density_is_f(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof sweeps / sizeof *sweeps; i++) {
        struct bd_surface s = swept(&sweeps[i]);
        for (int k = 0; k < 3000; k++) {
            float wo[3], f[3], pdf;
            direction(uniform() * .99f + .01f, 6 * uniform(), wo);
            const float u[3] = {uniform(), uniform(), uniform()};
            struct bd_bsdf_sample sample;
            if (!sample_once(&s, wo, u, &sample) || sample.delta) continue;
            eval_once(&s, wo, sample.wi, f, &pdf);
            assert_true(fabsf(pdf - sample.pdf) <= 1e-3f * pdf);
            for (int j = 0; j < 3; j++)
                assert_true(fabsf(sample.weight[j] * pdf - f[j]) <= 1e-3f * f[j] + 1e-6f);
            assert_true(sample.transmitted == (sample.wi[2] < 0));
        }
    }
}

// f(wo, wi) = f(wi, wo) on one side, and over the squared indices across a solid's surface.
static void reciprocity(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof sweeps / sizeof *sweeps; i++) {
        for (int k = 0; k < 3000; k++) {
            struct bd_surface s = swept(&sweeps[i]);
            float wo[3], wi[3], there[3], back[3], pdf;
            direction(uniform() * .98f + .02f, 6 * uniform(), wo);
            direction(1.96f * uniform() - .98f, 6 * uniform(), wi);
            if (fabsf(wi[2]) < 1e-3f) continue; // BD_GGX_COSINE_MIN
            eval_once(&s, wo, wi, there, &pdf);
            float scale = 1;
            if (wi[2] < 0) {
                s.normal[2] = s.normal_geometric[2] = -1;
                scale = s.thin ? 1 : s.entering ? s.ior * s.ior : 1 / (s.ior * s.ior);
                s.entering = !s.entering;
            }
            eval_once(&s, wi, wo, back, &pdf);
            for (int j = 0; j < 3; j++) {
                float one = there[j] / fabsf(wi[2]) * scale, other = back[j] / wo[2];
                assert_true(fabsf(one - other) <= 2e-3f * fmaxf(one, other) + 1e-5f);
            }
        }
    }
}

static void plain_colors_are_never_lowered(void **state)
{
    (void)state;
    uint32_t plain = 0;
    for (int i = 0; i < 20000; i++) {
        const float color[3] = {uniform(), uniform(), uniform()};
        float roughness = uniform(), factor[3];
        if (!bd_albedo_is_plain(color, roughness)) continue;
        plain++;
        for (int k = 0; k < 20; k++) {
            float c = uniform();
            bd_albedo_diffuse_factor(color, roughness, c * c, factor);
            for (int j = 0; j < 3; j++) assert_true(factor[j] == 1);
        }
    }
    assert_true(plain > 2000 && plain < 18000);
    assert_true(bd_albedo_is_plain((float[3]){.8f, .8f, .8f}, .6f));
    assert_false(bd_albedo_is_plain((float[3]){.8f, .8f, .8f}, .1f));
}

// --- energy -----------------------------------------------------------------------------------

// Hazard 18: white in a white furnace is never brighter than the furnace, at any angle.
static void nothing_gains_energy(void **state)
{
    (void)state;
    for (int t = 0; t < 4; t++) {
        for (int m = 0; m < 3; m++) {
            for (float roughness = 0; roughness <= 1; roughness += .125f) {
                for (float cosine = 1; cosine > .01f; cosine *= .6f) {
                    struct bd_surface s = surface_of((float)m / 2, roughness, t == 0 ? 0 : .9f);
                    s.thin = t < 2, s.entering = t < 3;
                    float wo[3];
                    direction(cosine, 2, wo);
                    double a = albedo(&s, wo, 60);
                    assert_true(a < 1.02);
                    if (m == 2 && roughness == 0) assert_true(fabs(a - 1) < 1e-5);
                }
            }
        }
    }
}

// A white Lambertian surface, and white smooth glass from either side, lose nothing (D1).
static void furnace_is_kept(void **state)
{
    (void)state;
    for (float cosine = 1; cosine > .01f; cosine *= .6f) {
        float wo[3];
        direction(cosine, 2, wo);
        struct bd_surface s = surface_of(0, .5f, 0);
        s.lambert = true;
        assert_true(fabs(albedo(&s, wo, 50) - 1) < 1e-6);
        struct bd_surface glass = surface_of(0, 0, 1);
        glass.thin = false;
        assert_true(fabs(albedo(&glass, wo, 50) - 1) < 1e-5);
        glass.entering = false;
        assert_true(fabs(albedo(&glass, wo, 50) - 1) < 1e-5);
    }
}

// Any shading normal, any direction, odd materials: finite, non-negative, on the side that the
// geometry allows (hazard 61).
static void odd_input_stays_finite(void **state)
{
    (void)state;
    static const float roughnesses[] = {0, 1e-20f, .01f, .04f, .3f, 1};
    static const float iors[] = {0, 1, 1.0001f, 1.5f, 40};
    for (int k = 0; k < 200000; k++) {
        struct bd_surface s = surface_of(uniform() < .5f ? 0 : uniform(), roughnesses[k % 6],
                                         uniform() < .5f ? 0 : 1);
        s.ior = iors[k % 5], s.thin = k % 3 == 0, s.entering = k % 2 == 0;
        s.base_color[1] = 0;
        float wo[3], f[3], pdf, cosine = k % 7 == 0 ? 1e-6f : uniform();
        direction(uniform(), 6 * uniform(), s.normal);
        direction(cosine, 6 * uniform(), wo);
        const float u[3] = {k % 11 == 0 ? 0 : uniform(), k % 13 == 0 ? 0x1.fffffep-1f : uniform(),
                            uniform()};
        struct bd_bsdf_sample sample;
        if (!sample_once(&s, wo, u, &sample)) continue;
        for (int j = 0; j < 3; j++)
            assert_true(isfinite(sample.weight[j]) && sample.weight[j] >= 0);
        assert_true(sample.transmitted == (sample.wi[2] < 0));
        float length = sqrtf(sample.wi[0] * sample.wi[0] + sample.wi[1] * sample.wi[1] +
                             sample.wi[2] * sample.wi[2]);
        assert_true(fabsf(length - 1) < 1e-4f);
        eval_once(&s, wo, sample.wi, f, &pdf);
        assert_true(isfinite(f[0]) && f[0] >= 0 && isfinite(pdf) && pdf >= 0);
    }
}

// A normal bent towards a light behind the geometry lets none of it through.
static void light_from_below_the_geometry(void **state)
{
    (void)state;
    struct bd_surface s = surface_of(0, .5f, 0);
    direction(.5f, 0, s.normal);
    float wo[3], wi[3], f[3], pdf;
    direction(.8f, 0, wo);
    direction(-.1f, 0, wi); // above the shading normal's plane, below the triangle's
    for (int lambert = 0; lambert < 2; lambert++) {
        s.lambert = lambert;
        eval_once(&s, wo, wi, f, &pdf);
        assert_true(f[0] == 0 && pdf == 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ggx_albedos),
        cmocka_unit_test(agrees_with_appendix_b),
        cmocka_unit_test(sharp_lobes_are_mirrors),
        cmocka_unit_test(fresnel),
        cmocka_unit_test(slab_transmits),
        cmocka_unit_test(refraction_bends),
        cmocka_unit_test(density_is_what_is_sampled),
        cmocka_unit_test(weight_times_density_is_f),
        cmocka_unit_test(reciprocity),
        cmocka_unit_test(plain_colors_are_never_lowered),
        cmocka_unit_test(nothing_gains_energy),
        cmocka_unit_test(furnace_is_kept),
        cmocka_unit_test(odd_input_stays_finite),
        cmocka_unit_test(light_from_below_the_geometry),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
