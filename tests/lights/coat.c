// What a virtual light sends by its coat (kernel/coat.h), against the BRDF that is rendered, and
// what it sends in all.

#include <math.h>

#include "kernel/brdf.h"
#include "kernel/coat.h"
#include "lights/sent.h"
#include "tests/unit/cmocka_all.h"

#define F0 .04f

static const f3 up = {0, 0, 1};

static f3 way_at(float cosine)
{
    return f3_of(sqrtf(1 - cosine * cosine), 0, cosine);
}

// To the VPL, from where it sends to under that cosine and turned by so much.
static f3 to_vpl_at(float cosine, float turned, float distance)
{
    const float across = sqrtf(1 - cosine * cosine);
    return f3_scale(f3_of(across * cosf(turned), across * sinf(turned), cosine), -distance);
}

static float even_of(float roughness, float cosine)
{
    const struct bd_sent_lobe lobe = bd_sent_lobe_from(roughness, cosine);
    return F0 * (lobe.white - lobe.grazing) + lobe.grazing;
}

// Of a black coat in a unit of flux.
static float sent_by_coat(float roughness, f3 way, f3 to_vpl)
{
    const float even = even_of(roughness, way.z);
    return flux_with_coat(f3_of(even, even, even), f3_of(1, 1, 1), even, -roughness, F0, up, way,
                          to_vpl, f3_dot(to_vpl, to_vpl))
        .x;
}

static void a_black_coat_sends_by_the_brdf(void **state)
{
    (void)state;
    for (float roughness = .25f; roughness <= 1; roughness += .25f)
        for (float from = .05f; from <= 1; from += .19f)
            for (float to = .05f; to <= 1; to += .19f)
                for (float turned = 0; turned < 6; turned += .7f) {
                    const f3 way = way_at(from), to_vpl = to_vpl_at(to, turned, 3);
                    const float brdf = gltf_brdf(f3_of(0, 0, 0), 0, roughness, F0, up, way,
                                                 f3_scale(to_vpl, -1 / 3.0f))
                                           .x;
                    assert_float_equal(sent_by_coat(roughness, way, to_vpl), F_PI * brdf,
                                       1e-4f * (1 + F_PI * brdf));
                }
}

// Under a cosine, over all directions by theirs.
static float sent_in_all(float roughness, float cosine)
{
    enum { STEPS = 400 };
    double sum = 0;
    for (int i = 0; i < STEPS; i++)
        for (int k = 0; k < STEPS; k++) {
            const float to = sqrtf(((float)i + .5f) / STEPS);
            const float turned = 2 * F_PI * ((float)k + .5f) / STEPS;
            sum += (double)sent_by_coat(roughness, way_at(cosine), to_vpl_at(to, turned, 1));
        }
    return (float)(sum / STEPS / STEPS);
}

static void as_much_is_sent_in_all(void **state)
{
    (void)state;
    for (float roughness = .25f; roughness <= 1; roughness += .25f)
        for (float cosine = .1f; cosine <= 1; cosine += .3f)
            assert_float_equal(sent_in_all(roughness, cosine), even_of(roughness, cosine),
                               .05f * even_of(roughness, cosine) + .001f);
}

static void light_that_grazes_goes_on(void **state)
{
    (void)state;
    const f3 way = way_at(.2f);
    const float on = sent_by_coat(.4f, way, to_vpl_at(.2f, F_PI, 1));
    const float back = sent_by_coat(.4f, way, to_vpl_at(.2f, 0, 1));
    assert_true(on > 40 * back);
}

static void one_without_sends_evenly(void **state)
{
    (void)state;
    const f3 to_vpl = to_vpl_at(.5f, 1, 2);
    // As a patch keeps its parallelogram there (shared/vpl.h).
    const f3 sent = flux_with_coat(f3_of(1, 2, 3), f3_of(4, 5, 6), 7, 8, 9, up, f3_of(10, 11, 12),
                                   to_vpl, f3_dot(to_vpl, to_vpl));
    assert_float_equal(sent.x, 1, 0);
    assert_float_equal(sent.y, 2, 0);
    assert_float_equal(sent.z, 3, 0);
}

static void nothing_is_no_number_or_below_nought(void **state)
{
    (void)state;
    const f3 ways[] = {up, way_at(0), way_at(.5f), f3_of(0, 0, -1)};
    const f3 to[] = {f3_of(0, 0, 0),      f3_of(0, 0, -1),         f3_of(0, 0, 1),
                     f3_of(1e-20f, 0, 0), f3_of(0, 1e18f, -1e18f), f3_scale(way_at(.5f), 1)};
    for (size_t i = 0; i < sizeof ways / sizeof *ways; i++)
        for (size_t k = 0; k < sizeof to / sizeof *to; k++) {
            const float sent = sent_by_coat(.25f, ways[i], to[k]);
            assert_true(isfinite(sent) && sent >= 0);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_black_coat_sends_by_the_brdf),
        cmocka_unit_test(as_much_is_sent_in_all),
        cmocka_unit_test(light_that_grazes_goes_on),
        cmocka_unit_test(one_without_sends_evenly),
        cmocka_unit_test(nothing_is_no_number_or_below_nought),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
