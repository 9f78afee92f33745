// The shaders' BRDF (shaders/kernel/brdf.h): it gains no energy, the limit that sees to that is
// what quadrature says, and the reference has the same one.

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "kernel.h"
#include "reference/bsdf.h"
#include "shared/types.h"
#include "tests/tools/bsdf_once.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

// As test/brdf.comp reads it.
struct query {
    struct bd_vec4 color_metallic, roughness_f0, to_light, to_eye;
};

static struct bd_vec4 *evaluate(struct bd_gpu *gpu, const struct query *queries, size_t count)
{
    struct bd_vec4 *results = calloc(count, sizeof *results);
    assert_non_null(results);
    kernel_run(gpu, "test/brdf.comp", (uint32_t)((count + 63) / 64), queries,
               count * sizeof *queries, results, count * sizeof *results);
    return results;
}

static struct bd_vec4 direction(double cosine, double phi)
{
    double sine = sqrt(fmax(1 - cosine * cosine, 0));
    return (struct bd_vec4){(float)(sine * cos(phi)), (float)(sine * sin(phi)), (float)cosine, 0};
}

static struct query query_of(double base, double roughness, double f0, struct bd_vec4 to_light,
                             struct bd_vec4 to_eye)
{
    float b = (float)base;
    return (struct query){.color_metallic = {b, b, b, 0},
                          .roughness_f0 = {(float)roughness, (float)f0, 0, 0},
                          .to_light = to_light,
                          .to_eye = to_eye};
}

// --- energy -----------------------------------------------------------------------------------

#define SIDE 48 // midpoints of a square, for each of two ways to choose directions

static const double furnace_roughnesses[] = {0, .03, .05, .1, .2, .3, .45, .6, .8, 1};
static const double furnace_cosines[] = {1, .7, .5, .3, .2, .1, .05, .03, .01};
static const double furnace_f0s[] = {.04, .2};

// Density of the directions below, per steradian, which mixes both ways in equal parts.
static double density_of(struct bd_vec4 l, double cosine, double alpha)
{
    double sine = sqrt(1 - cosine * cosine);
    double x = l.x + sine, y = l.y, z = l.z + cosine, length = sqrt(x * x + y * y + z * z);
    double across2 = (x * x + y * y) / (length * length), n_h = z / length;
    double d = across2 + n_h * n_h * alpha * alpha;
    double o_h = (x * sine + z * cosine) / length;
    return .5 * (l.z / M_PI + alpha * alpha / (M_PI * d * d) * n_h / (4 * o_h));
}

static struct bd_vec4 mirrored(double cosine, double n_h, double phi)
{
    double o[3] = {sqrt(1 - cosine * cosine), 0, cosine}, s = sqrt(1 - n_h * n_h);
    double h[3] = {s * cos(phi), s * sin(phi), n_h};
    double o_h = o[0] * h[0] + o[2] * h[2];
    return (struct bd_vec4){(float)(2 * o_h * h[0] - o[0]), (float)(2 * o_h * h[1]),
                            (float)(2 * o_h * h[2] - o[2]), 0};
}

// Half of the directions by the cosine, half by normals of GGX. Some lie below the surface.
static void furnace_queries(double roughness, double cosine, double f0, struct query *out)
{
    double alpha = fmax(roughness * roughness, 1e-3);
    struct bd_vec4 o = direction(cosine, 0);
    for (int k = 0; k < SIDE * SIDE; k++) {
        double u = (k / SIDE + .5) / SIDE, phi = 2 * M_PI * (k % SIDE + .5) / SIDE;
        double n_h = sqrt((1 - u) / (1 + (alpha * alpha - 1) * u));
        *out++ = query_of(1, roughness, f0, direction(sqrt(u), phi), o);
        *out++ = query_of(1, roughness, f0, mirrored(cosine, n_h, phi), o);
    }
}

static double albedo_of(const struct query *queries, const struct bd_vec4 *results)
{
    double roughness = (double)queries->roughness_f0.x, cosine = (double)queries->to_eye.z, sum = 0;
    for (int k = 0; k < 2 * SIDE * SIDE; k++) {
        struct bd_vec4 l = queries[k].to_light;
        if (l.z <= 0) continue;
        double density = density_of(l, cosine, fmax(roughness * roughness, 1e-3));
        sum += (double)(results[k].x * l.z) / density / (2 * SIDE * SIDE);
    }
    return sum;
}

// Hazard 18: white in a white furnace is never brighter than the furnace.
static void white_gains_no_energy(void **state)
{
    const size_t per_case = 2 * SIDE * SIDE;
    const size_t cases = COUNT(furnace_roughnesses) * COUNT(furnace_cosines) * COUNT(furnace_f0s);
    struct query *queries = calloc(cases * per_case, sizeof *queries), *at = queries;
    assert_non_null(queries);
    for (size_t f = 0; f < COUNT(furnace_f0s); f++)
        for (size_t r = 0; r < COUNT(furnace_roughnesses); r++)
            for (size_t c = 0; c < COUNT(furnace_cosines); c++, at += per_case)
                furnace_queries(furnace_roughnesses[r], furnace_cosines[c], furnace_f0s[f], at);
    struct bd_vec4 *results = evaluate(*state, queries, cases * per_case);
    int wrong = 0;
    double least = 1, most = 0;
    for (size_t k = 0; k < cases; k++) {
        const struct query *first = &queries[k * per_case];
        double a = albedo_of(first, &results[k * per_case]);
        least = fmin(least, a), most = fmax(most, a);
        if (a <= 1.01 && a >= .8) continue;
        wrong++;
        print_message("    albedo %.4f at roughness %g, cosine %g, f0 %g\n", a,
                      (double)first->roughness_f0.x, (double)first->to_eye.z,
                      (double)first->roughness_f0.y);
    }
    print_message("    albedo of white from %.4f to %.4f\n", least, most);
    assert_int_equal(wrong, 0);
    free(queries);
    free(results);
}

// --- the diffuse lobe's limit -----------------------------------------------------------------

// Mean of (1 - o.h)^5 over the normals of GGX that are visible from o (Heitz 2018): what Schlick's
// term takes from a furnace by way of the microfacets.
static double taken_by_facets(double cosine, double roughness, int side)
{
    if (roughness == 0) return pow(1 - cosine, 5);
    double alpha = roughness * roughness, sine = sqrt(1 - cosine * cosine), sum = 0;
    double length = sqrt(alpha * alpha * sine * sine + cosine * cosine);
    double v[2] = {alpha * sine / length, cosine / length}; // x, z of the stretched direction
    for (int k = 0; k < side * side; k++) {
        double r = sqrt((k / side + .5) / side), phi = 2 * M_PI * (k % side + .5) / side;
        double p1 = r * cos(phi), flat = sqrt(1 - p1 * p1), s = .5 * (1 + v[1]);
        double p2 = (1 - s) * flat + s * r * sin(phi), p3 = sqrt(fmax(1 - p1 * p1 - p2 * p2, 0));
        double h[3] = {alpha * (p3 * v[0] - p2 * v[1]), alpha * p1, p2 * v[0] + p3 * v[1]};
        double size = sqrt(h[0] * h[0] + h[1] * h[1] + h[2] * h[2]);
        double o_h = (sine * h[0] + cosine * h[2]) / size;
        if (2 * o_h * h[2] / size > cosine) sum += pow(1 - o_h, 5);
    }
    return sum / (side * side);
}

// What Schlick's term takes from a white diffuse lobe.
static double taken_from_diffuse(double cosine, int side)
{
    double sine = sqrt(1 - cosine * cosine), sum = 0;
    for (int k = 0; k < side * side; k++) {
        double u = (k / side + .5) / side, phi = 2 * M_PI * (k % side + .5) / side;
        double o_i = sine * sqrt(u) * cos(phi) + cosine * sqrt(1 - u);
        sum += pow(1 - sqrt(fmax(.5 * (1 + o_i), 0)), 5);
    }
    return sum / (side * side);
}

#define LIMIT_SIDE 25
#define ERROR_MAX  .003f

static double limit_cosine(int i)
{
    return pow(.1 + .9 * i / (LIMIT_SIDE - 1), 2);
}

static void limit_matches_the_integrals(void **state)
{
    struct query queries[LIMIT_SIDE * LIMIT_SIDE];
    for (int k = 0; k < LIMIT_SIDE * LIMIT_SIDE; k++) {
        struct bd_vec4 o = direction(limit_cosine(k / LIMIT_SIDE), 0);
        queries[k] = query_of(1, (double)(k % LIMIT_SIDE) / (LIMIT_SIDE - 1), .04, o, o);
    }
    struct bd_vec4 *results = evaluate(*state, queries, COUNT(queries));
    double largest = 0;
    for (int k = 0; k < LIMIT_SIDE * LIMIT_SIDE; k++) {
        double cosine = (double)queries[k].to_eye.z, roughness = (double)queries[k].roughness_f0.x;
        double exact =
            (1 - taken_by_facets(cosine, roughness, 200)) / (1 - taken_from_diffuse(cosine, 80));
        double error = fmin((double)results[k].w, 1) - fmin(exact, 1);
        if (fabs(error) > fabs(largest)) largest = error;
        if (!(fabs(error) < (double)ERROR_MAX))
            fail_msg("%.4f instead of %.4f at roughness %g, cosine %g", (double)results[k].w, exact,
                     roughness, cosine);
    }
    print_message("    largest error of the limit %.5f\n", largest);
    free(results);
}

// The shader asks for the limit of the smaller cosine alone. It may fall by no more than its error.
static void limit_grows_with_the_cosine(void **state)
{
    enum { ROUGHNESSES = 41, COSINES = 400 };
    struct query *queries = calloc(ROUGHNESSES * COSINES, sizeof *queries);
    assert_non_null(queries);
    for (int k = 0; k < ROUGHNESSES * COSINES; k++) {
        struct bd_vec4 o = direction(pow((k % COSINES) / (COSINES - 1.), 2), 0);
        queries[k] = query_of(1, (k / COSINES) / (ROUGHNESSES - 1.), .04, o, o);
    }
    struct bd_vec4 *results = evaluate(*state, queries, ROUGHNESSES * COSINES);
    float most = 0;
    for (int k = 0; k < ROUGHNESSES * COSINES; k++) {
        float limit = fminf(results[k].w, 1);
        most = k % COSINES == 0 ? limit : fmaxf(most, limit);
        assert_true(limit >= 0 && limit >= most - ERROR_MAX);
    }
    free(queries);
    free(results);
}

// --- the reference ----------------------------------------------------------------------------

// PCG32 (O'Neill 2014), so that a failure repeats.
static double uniform(void)
{
    static uint64_t state = 1;
    uint64_t old = state;
    state = old * 6364136223846793005u + 1442695040888963407u;
    uint32_t shifted = (uint32_t)(((old >> 18) ^ old) >> 27), turn = (uint32_t)(old >> 59);
    uint32_t bits = (shifted >> turn) | (shifted << ((32 - turn) & 31));
    return (bits >> 8) * 0x1p-24;
}

static struct query random_query(void)
{
    struct bd_vec4 o = direction(.02 + .98 * pow(uniform(), 2), 6 * uniform());
    struct bd_vec4 i = direction(.02 + .98 * pow(uniform(), 2), 6 * uniform());
    struct query query = query_of(0, .04 + .96 * uniform(), .04, i, o);
    double metallic = uniform() < .5 ? 0 : uniform();
    query.color_metallic = (struct bd_vec4){(float)uniform(), (float)sqrt(uniform()), 1, 0};
    query.color_metallic.w = (float)metallic;
    return query;
}

static void witness_of(const struct query *query, float out[3])
{
    struct bd_vec4 colour = query->color_metallic, i = query->to_light, o = query->to_eye;
    const struct bd_surface surface = {
        .normal_geometric = {0, 0, 1},
        .normal = {0, 0, 1},
        .base_color = {colour.x, colour.y, colour.z},
        .metallic = colour.w,
        .roughness = query->roughness_f0.x,
        .ior = 1.5f,
    };
    eval_once(&surface, (const float[3]){o.x, o.y, o.z}, (const float[3]){i.x, i.y, i.z}, out,
              NULL);
    for (int k = 0; k < 3; k++) out[k] /= i.z;
}

// Each has its own limit, a fit and a table of the same integrals; the table is within .008 of them
// from a cosine of .02 on.
static void witness_has_the_same(void **state)
{
    enum { RANDOM = 200000 };
    struct query *queries = calloc(RANDOM, sizeof *queries);
    assert_non_null(queries);
    for (int k = 0; k < RANDOM; k++) queries[k] = random_query();
    struct bd_vec4 *results = evaluate(*state, queries, RANDOM);
    double largest = 0;
    for (int k = 0; k < RANDOM; k++) {
        float expected[3], found[3] = {results[k].x, results[k].y, results[k].z};
        witness_of(&queries[k], expected);
        for (int c = 0; c < 3; c++) {
            double error = fabs((double)(found[c] - expected[c])) - 1e-3 * (double)expected[c];
            largest = fmax(largest, error * M_PI);
            assert_true(error * M_PI < .012);
        }
    }
    print_message("    off the reference by at most %.4f of 1 / pi\n", largest);
    free(queries);
    free(results);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(white_gains_no_energy),
        cmocka_unit_test(limit_matches_the_integrals),
        cmocka_unit_test(limit_grows_with_the_cosine),
        cmocka_unit_test(witness_has_the_same),
    };
    return cmocka_run_group_tests(tests, kernel_open_device, kernel_close_device);
}
