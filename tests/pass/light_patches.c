// Patches of points that are lit: what little light there is in the next room stays there.

#include "pass/light_patches.h"

#include <math.h>

#include "tests/unit/cmocka_all.h"

#define BRIGHT  1000u
#define DIM     6u
#define PATCHES 64u

// On one floor, 10 x 10 cm each: a bright field at x from 4 to 5, and few dim ones about x = 0.
static void light_stays_in_its_room(void **state)
{
    (void)state;
    static struct bd_surface_point points[BRIGHT + DIM];
    static f3 irradiance[BRIGHT + DIM];
    for (uint32_t i = 0; i < BRIGHT + DIM; i++) {
        const bool is_dim = i >= BRIGHT;
        const uint32_t number = is_dim ? i - BRIGHT : i;
        const float x = is_dim ? 0.1f * (float)number : 4 + 0.1f * (float)(number % 10);
        const float z = is_dim ? 0.05f : 0.1f * (float)(number / 10);
        points[i] = (struct bd_surface_point){
            .position = {x, 0, z}, .normal = {0, 1, 0}, .diffuse = {.5f, .5f, .5f}};
        irradiance[i] = is_dim ? f3_of(.1f, .1f, .1f) : f3_of(1, 1, 1);
    }
    const struct bd_surface_points spread = {BRIGHT + DIM, 0.01f, points};
    // One that has measured before asks no device.
    struct bd_slicer slicer = {.kind_count = 1, .kinds = {{.name = "divide", .units_per_ms = 1}}};
    const struct bd_light_patches_inputs inputs = {
        .points = &spread, .irradiance = irradiance, .count = PATCHES, .slicer = &slicer};
    struct bd_light_patches patches;
    struct bd_err_detail detail;
    assert_int_equal(bd_light_patches_init(&patches, &inputs, &detail), BD_ERR_OK);
    double here = 0, there = 0;
    for (uint32_t i = 0; i < PATCHES; i++) {
        const float x = patches.lights[i][0].x, flux = patches.lights[i][2].x;
        assert_true(flux == 0 || x <= .5f + 1e-4f || (x >= 4 - 1e-4f && x <= 4.9f + 1e-4f));
        *(x < 2 ? &there : &here) += (double)flux;
    }
    assert_true(fabs(there / (DIM * .1 * .5 * .01) - 1) < 1e-4);
    assert_true(fabs(here / (BRIGHT * .5 * .01) - 1) < 1e-4);
    bd_light_patches_finish(&patches);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(light_stays_in_its_room),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
