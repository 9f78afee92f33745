// What surfaces send on in all (lights/sent.h), against integrals of the BRDF that is rendered.

#include <math.h>
#include <stdio.h>

#include "kernel/brdf.h"
#include "lights/sent.h"
#include "tests/unit/cmocka_all.h"

#define F0      0.04f
#define INWARD  32
#define OUTWARD 128
#define AROUND  512

// Cosine-weighted: the square of the sine is uniform.
static f3 direction(float sine2, float angle)
{
    const float sine = sqrtf(sine2);
    return f3_of(sine * cosf(angle), sine * sinf(angle), sqrtf(1 - sine2));
}

// Of light under one angle, or with `cosine` below 0 from everywhere.
static f3 integral(f3 base, float metallic, float roughness, float cosine)
{
    const f3 n = f3_of(0, 0, 1);
    const int inward = cosine < 0 ? INWARD : 1;
    double sum[3] = {0};
    for (int i = 0; i < inward; i++)
        for (int o = 0; o < OUTWARD; o++)
            for (int k = 0; k < AROUND; k++) {
                const f3 l =
                    direction(cosine < 0 ? ((float)i + .5f) / INWARD : 1 - cosine * cosine, 0);
                const f3 v = direction(((float)o + .5f) / OUTWARD,
                                       F_PI * ((float)k + .5f) / AROUND); // the other half is alike
                const f3 f = gltf_brdf(base, metallic, roughness, F0, n, l, v);
                sum[0] += (double)f.x, sum[1] += (double)f.y, sum[2] += (double)f.z;
            }
    const double scale = (double)F_PI / (inward * OUTWARD * AROUND);
    return f3_of((float)(scale * sum[0]), (float)(scale * sum[1]), (float)(scale * sum[2]));
}

static const float roughnesses[] = {.2f, .3f, .5f, .7f, 1};

static void compare(f3 base, float cosine, const float most[3])
{
    const int sharpest = cosine < 0 ? 0 : 1; // of one angle the sum is too coarse
    for (int r = sharpest; r < 5; r++)
        for (int metallic = 0; metallic < 2; metallic++) {
            const f3 whole = integral(base, (float)metallic, roughnesses[r], cosine);
            const f3 sent = bd_sent_by_all(base, (float)metallic, roughnesses[r], F0, cosine);
            print_message("    cosine %.2f, roughness %.2f, metallic %d: %.3f %.3f %.3f, integrals "
                          "%.3f %.3f %.3f\n",
                          (double)cosine, (double)roughnesses[r], metallic, (double)sent.x,
                          (double)sent.y, (double)sent.z, (double)whole.x, (double)whole.y,
                          (double)whole.z);
            assert_true(fabsf(sent.x - whole.x) < most[0]);
            assert_true(fabsf(sent.y - whole.y) < most[1]);
            assert_true(fabsf(sent.z - whole.z) < most[2]);
        }
}

// Bright colours are limited.
static void it_is_what_the_brdf_returns(void **state)
{
    (void)state;
    compare(f3_of(0, .4f, .8f), BD_FROM_EVERYWHERE, (const float[3]){.002f, .006f, .006f});
    compare(f3_of(.9f, .95f, 1), BD_FROM_EVERYWHERE, (const float[3]){.006f, .006f, .004f});
}

static void flat_light_is_returned_more(void **state)
{
    (void)state;
    compare(f3_of(0, .4f, .8f), 1, (const float[3]){.002f, .003f, .006f});
    compare(f3_of(0, .4f, .8f), .6f, (const float[3]){.004f, .005f, .008f});
    compare(f3_of(0, .4f, .8f), .2f, (const float[3]){.005f, .01f, .02f});
}

// Light goes both ways: what returns of light under an angle returns to who looks under it. Flat
// looks have more of the diffuse lobe's rim.
static void rough_ones_return_it_to_who_looks(void **state)
{
    (void)state;
    const f3 base = f3_of(0, .3f, .6f);
    for (float roughness = .6f; roughness < 1.01f; roughness += .1f)
        for (float cosine = .1f; cosine < 1.01f; cosine += .15f) {
            const f3 limited = diffuse_limited(base, roughness, cosine);
            const f3 sent = sent_by_rough(limited, roughness, F0, cosine);
            const f3 whole = integral(base, 0, roughness, cosine);
            assert_float_equal(sent.x, whole.x, .003);
            assert_float_equal(sent.y, whole.y, .006);
            assert_float_equal(sent.z, whole.z, .01);
        }
}

static void nothing_returns_more_than_all(void **state)
{
    (void)state;
    for (int r = 0; r <= 100; r++)
        for (int m = 0; m <= 4; m++) {
            const float metallic = .25f * (float)m, roughness = .01f * (float)r;
            const f3 white =
                bd_sent_by_all(f3_of(1, 1, 1), metallic, roughness, F0, BD_FROM_EVERYWHERE);
            const f3 black =
                bd_sent_by_all(f3_of(0, 0, 0), metallic, roughness, F0, BD_FROM_EVERYWHERE);
            assert_true(white.x < 1 && black.x > 0);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(it_is_what_the_brdf_returns),
        cmocka_unit_test(flat_light_is_returned_more),
        cmocka_unit_test(rough_ones_return_it_to_who_looks),
        cmocka_unit_test(nothing_returns_more_than_all),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
