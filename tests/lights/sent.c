// What surfaces send on in all (lights/sent.h), against integrals of the BRDF that is rendered.

#include <math.h>
#include <stdio.h>

#include "kernel/brdf.h"
#include "lights/sent.h"
#include "tests/unit/cmocka_all.h"

#define F0      0.04f
#define INWARD  64
#define OUTWARD 128
#define AROUND  256

// Cosine-weighted: the square of the sine is uniform.
static f3 direction(float sine2, float angle)
{
    const float sine = sqrtf(sine2);
    return f3_of(sine * cosf(angle), sine * sinf(angle), sqrtf(1 - sine2));
}

static f3 integral(f3 base, float metallic, float roughness)
{
    const f3 n = f3_of(0, 0, 1);
    double sum[3] = {0};
    for (int i = 0; i < INWARD; i++)
        for (int o = 0; o < OUTWARD; o++)
            for (int k = 0; k < AROUND; k++) {
                const f3 l = direction(((float)i + .5f) / INWARD, 0);
                const f3 v = direction(((float)o + .5f) / OUTWARD,
                                       F_PI * ((float)k + .5f) / AROUND); // the other half is alike
                const f3 f = gltf_brdf(base, metallic, roughness, F0, n, l, v);
                sum[0] += (double)f.x, sum[1] += (double)f.y, sum[2] += (double)f.z;
            }
    const double scale = (double)F_PI / (INWARD * OUTWARD * AROUND);
    return f3_of((float)(scale * sum[0]), (float)(scale * sum[1]), (float)(scale * sum[2]));
}

static void it_is_what_the_brdf_returns(void **state)
{
    (void)state;
    static const float roughnesses[] = {.3f, .5f, .75f, 1};
    const f3 base = f3_of(0, .4f, .8f);
    for (int r = 0; r < 4; r++)
        for (int metallic = 0; metallic < 2; metallic++) {
            const f3 whole = integral(base, (float)metallic, roughnesses[r]);
            const f3 sent = bd_sent_by_all(base, (float)metallic, roughnesses[r], F0);
            print_message("    roughness %.2f, metallic %d: %.3f %.3f %.3f, integrals %.3f %.3f "
                          "%.3f\n",
                          (double)roughnesses[r], metallic, (double)sent.x, (double)sent.y,
                          (double)sent.z, (double)whole.x, (double)whole.y, (double)whole.z);
            assert_true(fabsf(sent.x - whole.x) < .002f);
            assert_true(fabsf(sent.y - whole.y) < .003f);
            assert_true(fabsf(sent.z - whole.z) < .012f); // bright colours are limited
        }
}

static void nothing_returns_more_than_all(void **state)
{
    (void)state;
    for (int r = 0; r <= 100; r++)
        for (int m = 0; m <= 4; m++) {
            const float metallic = .25f * (float)m, roughness = .01f * (float)r;
            const f3 white = bd_sent_by_all(f3_of(1, 1, 1), metallic, roughness, F0);
            const f3 black = bd_sent_by_all(f3_of(0, 0, 0), metallic, roughness, F0);
            assert_true(white.x < 1.05f && black.x > 0);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(it_is_what_the_brdf_returns),
        cmocka_unit_test(nothing_returns_more_than_all),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
