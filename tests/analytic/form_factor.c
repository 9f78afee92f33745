// The form factor of a clipped parallelogram (shaders/kernel/form_factor.h) against the same
// integral in double precision, with corners below, above and exactly on the receiver's horizon.

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "base/vec.h"
#include "kernel.h"
#include "shared/types.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

struct quad {
    const char *name;
    bd_dvec3 centre, u, v;
};

static const struct quad quads[] = {
    {"all above", {.3, .2, 1}, {.5, 0, 0}, {0, .5, 0}},
    {"all below", {.3, .2, -1}, {.5, 0, 0}, {0, .5, 0}},
    {"wall, cut across", {1, 0, .25}, {0, .5, 0}, {0, 0, .5}},
    {"wall, standing on the horizon", {1, 0, .5}, {0, .5, 0}, {0, 0, .5}},
    {"wall, hanging from the horizon", {1, 0, -.5}, {0, .5, 0}, {0, 0, .5}},
    {"one corner on the horizon, all else above", {1, .25, .5}, {0, .5, .25}, {0, -.5, .25}},
    {"one corner above", {1, 0, -.25}, {0, .5, .25}, {0, -.5, .25}},
    {"two opposite corners on the horizon", {1, 0, 0}, {0, .5, .25}, {0, -.5, .25}},
    {"corners above, above, below, on", {1, .1, .25}, {.25, .5, -.25}, {0, -.5, -.5}},
    {"corners above, on, below, above", {1, .1, .25}, {.25, .5, -.5}, {0, -.5, -.25}},
    {"corners on, below, above, above", {1, .1, .25}, {.25, .5, -.25}, {0, -.5, .5}},
    {"close, off the axis", {.02, .01, .03}, {.5, .1, .2}, {-.1, .4, .1}},
};

// Corners of the quad above the plane z = 0 (Sutherland and Hodgman), in double precision.
static int clip(const struct quad *q, bd_dvec3 out[8])
{
    const double signs[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    bd_dvec3 corners[4];
    int count = 0;
    for (int k = 0; k < 4; k++)
        corners[k] = bd_dvec3_add(q->centre, bd_dvec3_add(bd_dvec3_scale(q->u, signs[k][0]),
                                                          bd_dvec3_scale(q->v, signs[k][1])));
    for (int k = 0; k < 4; k++) {
        bd_dvec3 a = corners[k], b = corners[(k + 1) % 4];
        if (a.z >= 0) out[count++] = a;
        if ((a.z > 0 && b.z < 0) || (a.z < 0 && b.z > 0)) {
            double t = a.z / (a.z - b.z);
            out[count++] = bd_dvec3_add(bd_dvec3_scale(a, 1 - t), bd_dvec3_scale(b, t));
        }
    }
    return count;
}

// Lambert's formula; the receiver's normal is +z.
static double expected_form_factor(const struct quad *q)
{
    bd_dvec3 polygon[8];
    int count = clip(q, polygon);
    double sum = 0;
    for (int k = 0; k < count; k++) {
        bd_dvec3 a = polygon[k], b = polygon[(k + 1) % count], across = bd_dvec3_cross(a, b);
        double sine = sqrt(bd_dvec3_dot(across, across));
        if (sine > 0) sum += atan2(sine, bd_dvec3_dot(a, b)) * across.z / sine;
    }
    return fabs(sum) / (2 * M_PI);
}

static struct bd_vec4 vec4_of(bd_dvec3 v)
{
    return (struct bd_vec4){(float)v.x, (float)v.y, (float)v.z, 0};
}

static void evaluate(struct bd_gpu *gpu, struct bd_vec4 results[COUNT(quads)])
{
    struct bd_vec4 cases[COUNT(quads)][4];
    for (size_t i = 0; i < COUNT(quads); i++) {
        cases[i][0] = vec4_of(quads[i].centre);
        cases[i][1] = vec4_of(quads[i].u);
        cases[i][2] = vec4_of(quads[i].v);
        cases[i][3] = (struct bd_vec4){0, 0, 1, 0};
    }
    kernel_run(gpu, "test/form_factor.comp", COUNT(quads), cases, sizeof cases, results,
               COUNT(quads) * sizeof *results);
}

static void clipped_quads_match_the_integral(void **state)
{
    struct bd_vec4 results[COUNT(quads)];
    int wrong = 0;
    evaluate(*state, results);
    for (size_t i = 0; i < COUNT(quads); i++) {
        double expected = expected_form_factor(&quads[i]), error = results[i].x - expected;
        print_message("    %-44s %.6f, expected %.6f\n", quads[i].name, (double)results[i].x,
                      expected);
        wrong += !(fabs(error) <= 1e-6 + 1e-5 * expected);
    }
    assert_int_equal(wrong, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(clipped_quads_match_the_integral)};
    return cmocka_run_group_tests(tests, kernel_open_device, kernel_close_device);
}
