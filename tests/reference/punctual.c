// Where a spot's light ends: to the ten-thousandth of a radian, however narrow or wide the cone.

#include <math.h>

#include "reference/punctual.h"
#include "tests/unit/cmocka_all.h"

// At the origin, along -y, with an edge too sharp for its falloff to hide a wrong angle.
static struct bd_punctual hard_spot(double half_angle)
{
    return (struct bd_punctual){
        .kind = BD_LIGHT_SPOT,
        .axis = {0, -1, 0},
        .intensity = {1, 1, 1},
        .cos_outer = (float)cos(half_angle),
        .cos_ramp_inverse = 1e6f,
        .steradians = 1,
        .probability = 1,
        .cumulated = 1,
    };
}

static bool is_lit(const struct bd_punctual *lamp, double angle, double azimuth, double distance)
{
    const struct bd_punctuals lamps = {.count = 1, .radius = 1};
    const float position[3] = {(float)(distance * sin(angle) * cos(azimuth)),
                               (float)(-distance * cos(angle)),
                               (float)(distance * sin(angle) * sin(azimuth))};
    struct bd_illumination found;
    return bd_punctual_illuminates(&lamps, lamp, position, &found) &&
           found.normal_illuminance[0] > 0;
}

static void a_cone_ends_at_its_angle(void **state)
{
    (void)state;
    const double half_angles[] = {0.02, 0.4, 1.2, 1.57};
    for (int i = 0; i < 4; i++) {
        const struct bd_punctual lamp = hard_spot(half_angles[i]);
        for (int k = 0; k < 64; k++) {
            const double azimuth = 0.1 + k, distance = pow(10, k % 7 - 3);
            assert_true(is_lit(&lamp, half_angles[i] - 1e-4, azimuth, distance));
            assert_false(is_lit(&lamp, half_angles[i] + 1e-4, azimuth, distance));
            assert_false(is_lit(&lamp, 3.14159265 - half_angles[i] / 2, azimuth, distance));
        }
    }
}

static void a_point_shines_everywhere(void **state)
{
    (void)state;
    struct bd_punctual lamp = hard_spot(0.4);
    lamp.kind = BD_LIGHT_POINT;
    for (int k = 0; k < 32; k++) assert_true(is_lit(&lamp, 0.1 * k, k, 1));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_cone_ends_at_its_angle),
        cmocka_unit_test(a_point_shines_everywhere),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
