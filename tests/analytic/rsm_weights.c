// Texel weights of reflective shadow maps against closed forms (algorithms.md A0.2, hazards 59
// and 60). No device.

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

#include "pass/rsm_weights.h"

static struct bd_light_setup light_of(enum bd_light_kind kind, double inner, double outer,
                                      struct bd_light *light)
{
    *light = (struct bd_light){
        .kind = kind,
        .color = {1, 1, 1},
        .intensity = 1,
        .range_m = INFINITY,
        .cone_inner = (float)inner,
        .cone_outer = (float)outer,
    };
    bool one_face = kind == BD_LIGHT_SPOT && outer <= M_PI / 3;
    return (struct bd_light_setup){
        .light = light,
        .face_count = one_face ? 1 : 6,
        .half_width = one_face ? tan(outer) * 1.0005 : 1,
        .half_height = one_face ? tan(outer) * 1.0005 : 1,
    };
}

static struct bd_rsm_weights weights_of(const struct bd_light_setup *setup, uint32_t side_px,
                                        bool paper_mode)
{
    struct bd_rsm_weights weights;
    assert_int_equal(bd_rsm_weights_create(setup, 1, side_px, paper_mode, NULL, &weights),
                     BD_ERR_OK);
    return weights;
}

static void face_solid_angles_cover_the_sphere(void **state)
{
    (void)state;
    double face = bd_rectangle_solid_angle_sr(-1, 1, -1, 1);
    assert_true(fabs(6 * face - 4 * M_PI) < 1e-12);
    double sum = 0;
    for (int y = 0; y < 64; y++)
        for (int x = 0; x < 64; x++)
            sum += bd_rectangle_solid_angle_sr(-1 + x / 32.0, -1 + (x + 1) / 32.0, -1 + y / 32.0,
                                               -1 + (y + 1) / 32.0);
    assert_true(fabs(sum - face) < 1e-12);
}

static void texel_solid_angles_are_exact(void **state)
{
    (void)state;
    struct bd_light light;
    struct bd_light_setup setup = light_of(BD_LIGHT_POINT, 0, 0, &light);
    struct bd_rsm_weights w = weights_of(&setup, 256, false);
    assert_int_equal(w.layer_count, 1);
    // Central and corner texel against the midpoint rule's own known error, 1.5e-5 at 256.
    double step = 2.0 / 256, centre = step * step / pow(1 + step * step / 2, 1.5);
    assert_true(fabs(w.values[2 * (127 * 256 + 127)] / centre - 1) < 3e-5);
    double u = 1 - step / 2, corner = step * step / pow(1 + 2 * u * u, 1.5);
    assert_true(fabs(w.values[0] / corner - 1) < 3e-5);
    assert_true(fabs(w.raw_sum / (4 * M_PI) - 1) < 1e-9);
    bd_rsm_weights_destroy(&w);
}

static void cone_flux_before_normalising(void **state)
{
    (void)state;
    const double cones[][2] = {{0, 0.3}, {0.29, 0.3}, {0, M_PI / 4}, {0.5, 0.78},
                               {0.2, 1.0}, {0.9, 1.3}, {0, M_PI / 2}};
    for (size_t i = 0; i < sizeof cones / sizeof cones[0]; i++) {
        struct bd_light light;
        struct bd_light_setup setup = light_of(BD_LIGHT_SPOT, cones[i][0], cones[i][1], &light);
        struct bd_rsm_weights w = weights_of(&setup, 256, false);
        double error = w.raw_sum / w.exact_sum - 1, sum = 0;
        print_message("    cone %.2f to %.2f: raw flux %+.2e\n", cones[i][0], cones[i][1], error);
        assert_true(fabs(error) < 1e-3);
        for (size_t t = 0; t < (size_t)256 * 256 * w.layer_count; t++) sum += w.values[2 * t];
        assert_true(fabs(sum / w.exact_sum - 1) < 1e-6);
        bd_rsm_weights_destroy(&w);
    }
}

static void paper_mode_spreads_evenly(void **state)
{
    (void)state;
    struct bd_light light;
    struct bd_light_setup setup = light_of(BD_LIGHT_POINT, 0, 0, &light);
    struct bd_rsm_weights w = weights_of(&setup, 16, true);
    for (int t = 0; t < 256; t++)
        assert_true(fabs(w.values[2 * t] / (2 * M_PI / (3 * 256)) - 1) < 1e-6);
    bd_rsm_weights_destroy(&w);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(face_solid_angles_cover_the_sphere),
        cmocka_unit_test(texel_solid_angles_are_exact),
        cmocka_unit_test(cone_flux_before_normalising),
        cmocka_unit_test(paper_mode_spreads_evenly),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
