// The oracles of algorithms.md D that have a closed form (numbers as there).

#include <math.h>
#include <stddef.h>

#include "stage.h"
#include "tests/unit/cmocka_all.h"

static const double pi = 3.14159265358979323846;
static const double origin[3] = {0, 0, 0};

static struct bd_integrand lambert(uint32_t bounces)
{
    struct bd_integrand integrand = bd_integrand_full;
    integrand.lambert = true;
    integrand.bounces_max = bounces;
    return integrand;
}

// Without the lamps that the importer hangs into a scene that has none.
static struct bd_integrand lambert_by_emission(uint32_t bounces)
{
    struct bd_integrand integrand = lambert(bounces);
    integrand.lights = BD_REFERENCE_EMISSIVE;
    return integrand;
}

// Irradiance from below on a horizontal receiver at height y.
static struct estimate looking_down(struct stage *s, const struct bd_integrand *integrand,
                                    enum bd_reference_part part, double x, double y, uint32_t count)
{
    return stage_irradiance(s, integrand, part, x, y, 0, 0, -1, 0, count);
}

// --- D1: furnaces -------------------------------------------------------------------------------

static void furnace_outside(void **state)
{
    (void)state;
    for (int k = 0; k < 2; k++) {
        struct stage *s = stage_create();
        float albedo = k ? 1 : 0.3f;
        for (int c = 0; c < 3; c++) s->scene->environment.radiance[c] = 2;
        stage_sphere(s, stage_material(s, albedo), origin, 1, 4, false);
        const double eye[3] = {0, 0, 4};
        uint32_t camera = stage_camera(s, eye, origin, 0.2);
        struct bd_integrand integrand = lambert(BD_BOUNCES_UNLIMITED);
        CHECK(stage_radiance(s, &integrand, camera, BD_PART_COUNT, 4, 256), 2 * albedo, 2e-6);
        stage_destroy(&s);
    }
}

// Walls of albedo .5 that emit .5, with a sphere of the same in the room: 1 - .5^(n + 2) is seen
// with n bounces of indirect light, since the walls themselves are seen, and light them directly.
static void furnace_inside(void **state)
{
    (void)state;
    struct stage *s = stage_create();
    int32_t wall = stage_material(s, 0.5f);
    stage_emission(s, wall, 0.5f);
    const double low[3] = {-1, -1, -1}, high[3] = {2, 1, 1}, ball[3] = {0.3, -0.4, 0.2};
    stage_box(s, wall, low, high);
    stage_sphere(s, wall, ball, 0.5, 3, false);
    const double eye[3] = {1.7, 0.8, 0.9};
    uint32_t camera = stage_camera(s, eye, ball, 1.0);
    for (uint32_t n = 0; n < 4; n++) {
        struct bd_integrand integrand = lambert_by_emission(n);
        struct estimate all = stage_radiance(s, &integrand, camera, BD_PART_COUNT, 8, 256);
        CHECK(all, 1 - pow(0.5, n + 2.0), 1e-6);
    }
    struct bd_integrand whole = lambert_by_emission(BD_BOUNCES_UNLIMITED);
    CHECK(stage_radiance(s, &whole, camera, BD_PART_COUNT, 8, 1024), 1, 1e-6);
    CHECK(stage_radiance(s, &whole, camera, BD_PART_DIRECT, 8, 256), 0.25, 1e-6);
    stage_destroy(&s);
}

// --- D2, D14: flux ------------------------------------------------------------------------------

// The mean irradiance over the walls of a box, by points spread over each (Roberts 2018, R2).
static struct estimate mean_over_box(struct stage *s, const struct bd_integrand *integrand,
                                     enum bd_reference_part part, const double size[3])
{
    struct estimate sum = {0, 0};
    double area = 0;
    const int count = 150;
    for (int face = 0; face < 6; face++) {
        int axis = face / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
        double weight = size[u] * size[v];
        for (int i = 0; i < count; i++) {
            double p[3], normal[3] = {0, 0, 0};
            p[u] = fmod(0.5 + i * 0.7548776662466927, 1) * size[u];
            p[v] = fmod(0.5 + i * 0.5698402909980532, 1) * size[v];
            p[axis] = face % 2 ? size[axis] : 0;
            normal[axis] = face % 2 ? -1 : 1;
            struct estimate e = stage_irradiance(s, integrand, part, p[0], p[1], p[2], normal[0],
                                                 normal[1], normal[2], 32);
            sum.mean += weight * e.mean, sum.error += weight * weight * e.error * e.error;
            area += weight;
        }
    }
    return (struct estimate){sum.mean / area, sqrt(sum.error) / area};
}

static void flux_is_kept(void **state)
{
    (void)state;
    struct stage *s = stage_create();
    const double low[3] = {0, 0, 0}, size[3] = {2, 1, 1.5};
    const double rho = 0.6, intensity = 3, area = 2 * (2 * 1 + 1 * 1.5 + 2 * 1.5);
    stage_box(s, stage_material(s, (float)rho), low, size);
    stage_light(s, BD_LIGHT_POINT, 0.8, 0.5, 0.7, NULL, (float)intensity);
    double flux = 4 * pi * intensity / area, before = 0;
    for (uint32_t n = 1; n <= 3; n++) {
        struct bd_integrand integrand = lambert(n);
        struct estimate e = mean_over_box(s, &integrand, BD_PART_INDIRECT, size);
        double expected = 0;
        for (uint32_t k = 1; k <= n; k++) expected += flux * pow(rho, k);
        CHECK(e, expected, 0.003); // points
        // D14: each bounce has rho of the one before.
        if (n > 1) {
            struct estimate last = {e.mean - before, 2 * e.error};
            CHECK(last, flux * pow(rho, n), 0.006);
        }
        before = e.mean;
    }
    struct bd_integrand whole = lambert(BD_BOUNCES_UNLIMITED);
    CHECK(mean_over_box(s, &whole, BD_PART_INDIRECT, size), flux * rho / (1 - rho), 0.003);
    stage_destroy(&s);
}

// --- D3: the integrating sphere -----------------------------------------------------------------

#define SPHERE_RADIUS 2.0

struct sphere {
    struct stage *stage;
    uint32_t camera;
};

// From the middle at a patch that the light, wherever it is, does not favour.
static struct sphere make_sphere(double rho, double light_x, float intensity)
{
    struct sphere s = {stage_create(), 0};
    stage_sphere(s.stage, stage_material(s.stage, (float)rho), origin, SPHERE_RADIUS, 6, true);
    stage_light(s.stage, BD_LIGHT_POINT, light_x, 0, 0, NULL, intensity);
    const double eye[3] = {0.1, 0, 0}, target[3] = {0.3, 1, 0.2};
    s.camera = stage_camera(s.stage, eye, target, 0.5);
    return s;
}

static void sphere_with_light_anywhere(void **state)
{
    (void)state;
    const double rho = 0.5, flux = 100, e_direct = flux / (4 * pi * 4);
    for (int off = 0; off < 2; off++) {
        struct sphere s = make_sphere(rho, off ? 1.2 : 0, (float)(flux / (4 * pi)));
        for (uint32_t n = 1; n <= 3; n++) {
            struct bd_integrand integrand = lambert(n);
            double expected = 0;
            for (uint32_t k = 1; k <= n; k++) expected += rho / pi * e_direct * pow(rho, k);
            CHECK(stage_radiance(s.stage, &integrand, s.camera, BD_PART_INDIRECT, 4, 1024),
                  expected, 2e-3);
        }
        struct bd_integrand whole = lambert(BD_BOUNCES_UNLIMITED);
        CHECK(stage_radiance(s.stage, &whole, s.camera, BD_PART_INDIRECT, 4, 4096),
              rho / pi * e_direct * rho / (1 - rho), 2e-3);
        if (!off)
            CHECK(stage_radiance(s.stage, &whole, s.camera, BD_PART_DIRECT, 4, 64),
                  rho / pi * 1.989437, 2e-3);
        stage_destroy(&s.stage);
    }
}

// Every factor cos cos / r^2 of a sphere is 1 / (4 R^2): a bound of beta times that leaves the
// share beta of each bounce, whichever way it is found.
static void sphere_clamped(void **state)
{
    (void)state;
    const double rho = 0.8, beta = 0.25, flux = 100, direct = rho / pi * flux / (16 * pi);
    struct sphere s = make_sphere(rho, 0.9, (float)(flux / (4 * pi)));
    for (int vertices = 0; vertices < 2; vertices++)
        for (uint32_t n = 1; n <= 2; n++) {
            struct bd_integrand integrand = lambert(n);
            integrand.clamp_per_m2 = beta / (4 * SPHERE_RADIUS * SPHERE_RADIUS);
            integrand.light_vertices = vertices;
            double share = beta * rho, expected = direct * (n == 1 ? share : share + share * share);
            CHECK(stage_radiance(s.stage, &integrand, s.camera, BD_PART_INDIRECT, 4, 2048),
                  expected, 2e-3);
        }
    stage_destroy(&s.stage);
}

// rho = 1 (hazard 14): n bounces give n times the direct light, none is lost or made.
static void sphere_that_absorbs_nothing(void **state)
{
    (void)state;
    struct sphere s = make_sphere(1, 0.5, 1);
    for (uint32_t n = 1; n <= 12; n += 11) {
        struct bd_integrand integrand = lambert(n);
        CHECK(stage_radiance(s.stage, &integrand, s.camera, BD_PART_INDIRECT, 4, 2048),
              n * 1 / pi / 4.0, 0.01);
    }
    stage_destroy(&s.stage);
}

// --- D4: floor and ceiling ----------------------------------------------------------------------

// Light at height a over a floor, ceiling at 1: the disc of radius D as algorithms.md has it.
static double ceiling_factor(double a, double d)
{
    if (fabs(a - 1) < 1e-3) return 0.4 * (1 - pow(1 + d * d, -2.5));
    double b2 = 1 - a * a, b = sqrt(b2), psi[2];
    for (int k = 0; k < 2; k++) {
        double w = k ? sqrt(a * a + d * d) : a, arc = atan(w / b);
        psi[k] = -1 / (b2 * b2 * w) - arc / pow(b, 5) -
                 (arc / (2 * b * b2) + w / (2 * b2 * (w * w + b2))) / b2;
    }
    return 2 * a * (psi[1] - psi[0]);
}

static void floor_and_ceiling(void **state)
{
    (void)state;
    const double heights[] = {0.001, 0.1, 0.25, 0.5, 0.75, 1};
    const double table[] = {1.9953, 1.5983968, 1.1849861, 0.7754678, 0.5432904, 0.4};
    const double rho = 0.7, intensity = 4;
    for (size_t i = 0; i < sizeof heights / sizeof *heights; i++) {
        double a = heights[i], m = ceiling_factor(a, 40);
        assert_true(fabs(m / table[i] - 1) < 3e-3); // the table's floor has no end
        struct stage *s = stage_create();
        stage_disc(s, stage_material(s, (float)rho), 40, 0, 1, 256);
        stage_light(s, BD_LIGHT_POINT, 0, a, 0, NULL, (float)intensity);
        struct bd_integrand one = lambert(1);
        CHECK(looking_down(s, &one, BD_PART_INDIRECT, 0, 1, 8192), rho * intensity * m, 1e-3);
        stage_destroy(&s);
    }
}

static void floor_direct(void **state)
{
    (void)state;
    struct stage *s = stage_create();
    stage_floor(s, stage_material(s, 0.5f), 10, 0, 1);
    stage_light(s, BD_LIGHT_POINT, 0, 1, 0, NULL, 1);
    struct bd_integrand direct = lambert(0);
    const double expected[] = {1, 0.353553391, 0.0894427191};
    for (int x = 0; x < 3; x++)
        CHECK(stage_irradiance(s, &direct, BD_PART_DIRECT, x, 0, 0, 0, 1, 0, 64), expected[x],
              2e-6);
    stage_destroy(&s);
}

// --- D5: the bound on cos cos / r^2 ------------------------------------------------------------

// A large plane at distance d below the receiver, lit uniformly by a sun: with u = d sqrt(b), the
// bound leaves 2 u - u^2 of its irradiance.
static void clamped_plane(void **state)
{
    (void)state;
    struct stage *s = stage_create();
    stage_floor(s, stage_material(s, 0.5f), 60, 0, 1);
    const double straight_down[3] = {0, -1, 0};
    stage_light(s, BD_LIGHT_DIRECTIONAL, 0, 1, 0, straight_down, 10);
    const double radiance = 0.5 / pi * 10;
    for (int vertices = 0; vertices < 2; vertices++)
        for (double u = 0.2; u < 1; u += 0.3) {
            struct bd_integrand one = lambert(1);
            one.clamp_per_m2 = u * u;
            one.light_vertices = vertices;
            // The floor's end at 60 distances takes 1 / 3600.
            CHECK(looking_down(s, &one, BD_PART_INDIRECT, 0, 1, 16384),
                  pi * radiance * (2 * u - u * u), 6e-4);
        }
    stage_destroy(&s);
}

// A perpendicular wall: what the bound takes is known by quadrature.
static void clamped_wall(void **state)
{
    (void)state;
    const double table[][2] = {{0.1, 0.2762}, {0.3, 0.0831}, {0.5, 0.0054}, {0.6, 0}};
    struct stage *s = stage_create();
    const double wall[4][3] = {{-900, 0, -1}, {900, 0, -1}, {900, 900, -1}, {-900, 900, -1}};
    stage_quad(s, stage_material(s, 0.8f), wall);
    const double towards[3] = {0, 0, -1};
    stage_light(s, BD_LIGHT_DIRECTIONAL, 0, 1, 0, towards, 1);
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        struct bd_integrand one = lambert(1);
        one.clamp_per_m2 = table[i][0] * table[i][0];
        double whole = 0.8 / pi * pi;
        struct estimate e =
            stage_irradiance(s, &one, BD_PART_INDIRECT, 0, 0, 0, 0, 1, 0, 32768);
        CHECK(e, whole * (0.5 - table[i][1]), 3e-3); // the wall ends; the table has four digits
    }
    stage_destroy(&s);
}

// --- D6: form factors, by what emits ------------------------------------------------------------

static void disc_form_factors(void **state)
{
    (void)state;
    struct stage *s = stage_create();
    int32_t lamp = stage_material(s, 0);
    stage_emission(s, lamp, 1);
    stage_disc(s, lamp, 1, 0, 1, 512);
    struct bd_integrand direct = lambert_by_emission(0);
    CHECK(looking_down(s, &direct, BD_PART_DIRECT, 0, 1, 4096), pi * 0.5, 1e-4);
    CHECK(looking_down(s, &direct, BD_PART_DIRECT, 0, 0.01, 4096), pi / 1.0001, 1e-4);
    CHECK(looking_down(s, &direct, BD_PART_DIRECT, 1, 1, 4096), pi * 0.2763932, 1e-4);
    CHECK(stage_irradiance(s, &direct, BD_PART_DIRECT, 2, 1, 0, -1, 0, 0, 4096), pi * 0.0854102,
          2e-4);
    stage_destroy(&s);
}

static void rectangle_form_factors(void **state)
{
    (void)state;
    struct stage *s = stage_create();
    int32_t lamp = stage_material(s, 0);
    stage_emission(s, lamp, 1);
    const double quad[4][3] = {{0, 0, 1}, {1, 0, 1}, {1, 0, 0}, {0, 0, 0}};
    stage_quad(s, lamp, quad);
    struct bd_integrand direct = lambert_by_emission(0);
    const enum bd_reference_part part = BD_PART_DIRECT;
    CHECK(stage_irradiance(s, &direct, part, 0, 1, 0, 0, -1, 0, 4096), pi * 0.1385316, 1e-4);
    CHECK(stage_irradiance(s, &direct, part, 0.5, 1, 0.5, 0, -1, 0, 4096), pi * 0.2394565, 1e-4);
    // Perpendicular, seen from the side: height 1, width 1, distance 1, corners aligned.
    CHECK(stage_irradiance(s, &direct, part, 0, 0, -1, 0, 1, 0, 4096), 0, 0);
    stage_destroy(&s);
    s = stage_create();
    lamp = stage_material(s, 0);
    stage_emission(s, lamp, 1);
    const double wall[4][3] = {{0, 0, -1}, {1, 0, -1}, {1, 1, -1}, {0, 1, -1}};
    stage_quad(s, lamp, wall);
    CHECK(stage_irradiance(s, &direct, part, 0, 0, 0, 0, 1, 0, 4096), pi * 0.0557342, 1e-4);
    // One-sided: lights its front alone.
    stage_destroy(&s);
    s = stage_create();
    lamp = stage_material(s, 0);
    stage_emission(s, lamp, 1);
    stage_material_at(s, lamp)->double_sided = false;
    stage_quad(s, lamp, wall);
    CHECK(stage_irradiance(s, &direct, part, 0, 0, 0, 0, 1, 0, 4096), pi * 0.0557342, 1e-4);
    CHECK(stage_irradiance(s, &direct, part, 0, 0, -2, 0, 1, 0, 4096), 0, 0);
    stage_destroy(&s);
}

// A wall in the sun: half of its radiosity reaches a floor beside it, whatever the distance.
static void sunlit_wall(void **state)
{
    (void)state;
    struct stage *s = stage_create();
    const double wall[4][3] = {{-50, 0, -1}, {50, 0, -1}, {50, 1, -1}, {-50, 1, -1}};
    stage_quad(s, stage_material(s, 0.8f), wall);
    const double towards[3] = {0, 0, -1};
    stage_light(s, BD_LIGHT_DIRECTIONAL, 0, 1, 0, towards, 5);
    struct bd_integrand one = lambert(1);
    for (int vertices = 0; vertices < 2; vertices++) {
        one.light_vertices = vertices;
        CHECK(stage_irradiance(s, &one, BD_PART_INDIRECT, 0, 0, 0, 0, 1, 0, 16384),
              0.8 * 5 * 0.1464466, 3e-4);
    }
    stage_destroy(&s);
}

// --- D7: patch to patch -------------------------------------------------------------------------

// Mean over a unit square of the irradiance from another that emits 1 / pi: the form factor.
static struct estimate patch_mean(struct stage *s, bool wall)
{
    const int n = 24;
    struct estimate sum = {0, 0};
    struct bd_integrand direct = lambert_by_emission(0);
    for (int i = 0; i < n * n; i++) {
        double x = (i % n + 0.5) / n, z = (i / n + 0.5) / n;
        struct estimate e =
            wall ? stage_irradiance(s, &direct, BD_PART_DIRECT, x, z, 0, 0, 0, 1, 128)
                 : stage_irradiance(s, &direct, BD_PART_DIRECT, x, 1, z, 0, -1, 0, 128);
        sum.mean += e.mean / (n * n), sum.error += e.error * e.error;
    }
    sum.error = sqrt(sum.error) / (n * n);
    return sum;
}

static void patch_to_patch(void **state)
{
    (void)state;
    struct stage *s = stage_create();
    int32_t lamp = stage_material(s, 0);
    stage_emission(s, lamp, (float)(1 / pi));
    const double quad[4][3] = {{0, 0, 1}, {1, 0, 1}, {1, 0, 0}, {0, 0, 0}};
    stage_quad(s, lamp, quad);
    CHECK(patch_mean(s, false), 0.1998248957, 4e-4); // midpoints
    CHECK(patch_mean(s, true), 0.2000437761, 3e-3);  // midpoints, near the shared edge
    stage_destroy(&s);
}

// --- D8: the cube room --------------------------------------------------------------------------

static void cube_room(void **state)
{
    (void)state;
    const double points[3][2] = {{0, 0}, {0.5, 0}, {0.5, 0.5}};
    const double direct[3] = {1, 0.715542, 0.544331}, first[3] = {0.590616, 0.579682, 0.552789};
    const double total[3][3] = {
        {1.56316, 1.27288, 1.08611}, {3.1662, 2.8720, 2.6730}, {5.7972, 5.5016, 5.2978}};
    const double albedos[3] = {0.5, 0.8, 0.9}, low[3] = {-1, -1, -1}, high[3] = {1, 1, 1};
    for (int a = 0; a < 3; a++) {
        double rho = albedos[a];
        struct stage *s = stage_create();
        stage_box(s, stage_material(s, (float)rho), low, high);
        stage_light(s, BD_LIGHT_POINT, 0, 0, 0, NULL, 1);
        for (int p = 0; p < 3; p++) {
            struct bd_integrand one = lambert(1), whole = lambert(BD_BOUNCES_UNLIMITED);
            double x = points[p][0], z = points[p][1];
            struct estimate e = stage_irradiance(s, &whole, BD_PART_INDIRECT, x, -1, z, 0, 1, 0, 65536);
            CHECK(e, total[a][p] - direct[p], 4e-4);
            if (a) continue;
            CHECK(stage_irradiance(s, &one, BD_PART_INDIRECT, x, -1, z, 0, 1, 0, 16384),
                  rho * first[p], 1e-4);
            CHECK(stage_irradiance(s, &one, BD_PART_DIRECT, x, -1, z, 0, 1, 0, 64), direct[p], 2e-6);
            // Convex: without visibility the truth stays.
            one.indirect_visibility = false;
            CHECK(stage_irradiance(s, &one, BD_PART_INDIRECT, x, -1, z, 0, 1, 0, 16384),
                  rho * first[p], 1e-4);
        }
        stage_destroy(&s);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(furnace_outside),
        cmocka_unit_test(furnace_inside),
        cmocka_unit_test(flux_is_kept),
        cmocka_unit_test(sphere_with_light_anywhere),
        cmocka_unit_test(sphere_clamped),
        cmocka_unit_test(sphere_that_absorbs_nothing),
        cmocka_unit_test(floor_and_ceiling),
        cmocka_unit_test(floor_direct),
        cmocka_unit_test(clamped_plane),
        cmocka_unit_test(clamped_wall),
        cmocka_unit_test(disc_form_factors),
        cmocka_unit_test(rectangle_form_factors),
        cmocka_unit_test(sunlit_wall),
        cmocka_unit_test(patch_to_patch),
        cmocka_unit_test(cube_room),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
