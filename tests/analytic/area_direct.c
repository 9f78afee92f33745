// Light of emissive surfaces and of the sky where it first falls, against closed forms: what
// `direct` shows of a diffuse floor, with as many rays as it has by itself and with many.

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "world.h"

#define ALBEDO 0.5
#define CD_M2  3.0
#define SIDE   16u

static const double up[3] = {0, 1, 0};

// Rays a pixel, and what a picture of one place may be off by: in its mean, and by pixel.
static const struct {
    const char *rays;
    double mean_most, pixel_most;
} asked[] = {{"light_rays=16", 0.02, 0.1}, {"light_rays=256", 0.006, 0.025}};

// --- scenes -------------------------------------------------------------------------------------

static int32_t add_emitter(struct world *w)
{
    const int32_t material = world_add_material(w, 0);
    for (int c = 0; c < 3; c++) w->scene->materials[material].emissive[c] = (float)CD_M2;
    return material;
}

static void begin_floor(struct world *w, double half)
{
    const double floor[4][3] = {
        {-half, 0, half}, {half, 0, half}, {half, 0, -half}, {-half, 0, -half}};
    world_clear(w);
    world_add_quad(w, world_add_material(w, (float)ALBEDO), floor, 1);
}

// A millimetre of the surface at `at`.
static struct bd_image *look_at(struct world *w, int32_t camera, const char *rays)
{
    const char *const settings[] = {"brdf=lambert", rays, NULL};
    struct bd_image *layers[BD_LAYER_COUNT];
    world_render(w, "direct", (uint32_t)camera, SIDE, SIDE, 1u << BD_LAYER_DIRECT, settings,
                 layers);
    struct bd_image *direct = layers[BD_LAYER_DIRECT];
    layers[BD_LAYER_DIRECT] = NULL;
    world_free_layers(layers);
    return direct;
}

// The pixels of such a picture are to show what the floor reflects of the irradiance.
static void check_at(struct world *w, const char *what, const double at[3], const double normal[3],
                     double irradiance)
{
    const double expected = ALBEDO / M_PI * irradiance;
    const int32_t camera = world_add_probe(w, at, normal, 1e-3);
    for (size_t a = 0; a < sizeof asked / sizeof *asked; a++) {
        struct bd_image *image = look_at(w, camera, asked[a].rays);
        double mean = 0, squares = 0;
        for (uint32_t i = 0; i < SIDE * SIDE; i++) {
            mean += image->pixels[3 * i] / (SIDE * SIDE);
            squares += pow(image->pixels[3 * i] / expected - 1, 2) / (SIDE * SIDE);
        }
        bd_image_destroy(&image);
        print_message("    %s, %s: %.5g of %.5g cd/m2, by pixel %.2f %%\n", what, asked[a].rays,
                      mean, expected, 100 * sqrt(squares));
        ASSERT_REL(mean, expected, asked[a].mean_most);
        assert_true(sqrt(squares) <= asked[a].pixel_most);
    }
}

// --- emissive surfaces --------------------------------------------------------------------------

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// Lambert 1760: of a polygon above the horizon of a floor at `at`, front towards it.
static double polygon_irradiance(const double corners[][3], int count, const double at[3])
{
    double sum = 0;
    for (int i = 0; i < count; i++) {
        double a[3], b[3];
        for (int c = 0; c < 3; c++) {
            a[c] = corners[i][c] - at[c];
            b[c] = corners[(i + 1) % count][c] - at[c];
        }
        const double across[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                                  a[0] * b[1] - a[1] * b[0]};
        const double angle = acos(dot(a, b) / sqrt(dot(a, a) * dot(b, b)));
        sum += angle * across[1] / sqrt(dot(across, across));
    }
    return fabs(CD_M2 / 2 * sum);
}

static const double places[][3] = {{0, 0, 0}, {.7, 0, .2}, {-2.1, 0, 1.3}};

static void a_rectangle(void **state)
{
    struct world *w = *state;
    static const double lamp[4][3] = {{-.6, 1, -.3}, {.6, 1, -.3}, {.6, 1.2, .3}, {-.6, 1.2, .3}};
    for (size_t p = 0; p < sizeof places / sizeof *places; p++) {
        begin_floor(w, 9);
        world_add_quad(w, add_emitter(w), lamp, 1);
        check_at(w, "rectangle", places[p], up, polygon_irradiance(lamp, 4, places[p]));
    }
}

#define CORNERS 128u

static void add_disk(struct world *w, double radius, double height)
{
    float positions[3 * (CORNERS + 1)] = {0}, normals[3 * (CORNERS + 1)] = {0};
    uint32_t indices[3 * CORNERS];
    for (uint32_t i = 0; i <= CORNERS; i++) {
        const double angle = 2 * M_PI * i / CORNERS;
        positions[3 * i] = i < CORNERS ? (float)(radius * cos(angle)) : 0;
        positions[3 * i + 1] = (float)height;
        positions[3 * i + 2] = i < CORNERS ? (float)(radius * sin(angle)) : 0;
        normals[3 * i + 1] = -1;
    }
    for (uint32_t i = 0; i < CORNERS; i++) {
        const uint32_t triangle[3] = {CORNERS, i, (i + 1) % CORNERS};
        memcpy(indices + 3 * i, triangle, sizeof triangle);
    }
    world_add_mesh(w, add_emitter(w), positions, normals, CORNERS + 1, indices, 3 * CORNERS);
}

// Hamilton and Morgan 1952: an element in a plane that is parallel to the disk's.
static void a_disk(void **state)
{
    struct world *w = *state;
    const double radius = .8, height = 1.1;
    for (size_t p = 0; p < sizeof places / sizeof *places; p++) {
        const double aside2 = dot(places[p], places[p]), r2 = radius * radius;
        const double sum = aside2 + height * height + r2;
        const double form = .5 * (1 - (sum - 2 * r2) / sqrt(sum * sum - 4 * aside2 * r2));
        begin_floor(w, 9);
        add_disk(w, radius, height);
        check_at(w, "disk", places[p], up, M_PI * CD_M2 * form);
    }
}

// A sphere above the horizon gives what a disk of its solid angle gives, face on.
static void a_sphere(void **state)
{
    struct world *w = *state;
    const double radius = .5, depth = 1.5;
    const double floor[4][3] = {{-9, -depth, 9}, {9, -depth, 9}, {9, -depth, -9}, {-9, -depth, -9}};
    for (size_t p = 0; p < sizeof places / sizeof *places; p++) {
        const double at[3] = {places[p][0], -depth, places[p][2]}, d2 = dot(at, at);
        world_clear(w);
        world_add_quad(w, world_add_material(w, (float)ALBEDO), floor, 1);
        const int32_t material = add_emitter(w);
        world_add_sphere_room(w, material, radius, 5);
        w->scene->materials[material].double_sided = true; // its outside, too
        check_at(w, "sphere", at, up, M_PI * CD_M2 * radius * radius / d2 * depth / sqrt(d2));
    }
}

// In a room that shines, corners included, light comes from the whole half space.
static void a_furnace(void **state)
{
    static const double centre[3] = {0, 0, 0};
    static const double spots[][3] = {{0, -1, 0}, {.9, -1, -.9}, {.99, -1, .4}};
    struct world *w = *state;
    for (size_t p = 0; p < sizeof spots / sizeof *spots; p++) {
        world_clear(w);
        const int32_t wall = world_add_material(w, (float)ALBEDO);
        for (int c = 0; c < 3; c++) w->scene->materials[wall].emissive[c] = (float)CD_M2;
        world_add_box_room(w, wall, centre, 1);
        check_at(w, "furnace", spots[p], up, M_PI * CD_M2);
    }
}

// --- the sky ------------------------------------------------------------------------------------

// Behind a wall without end, of height 1, at a distance.
static void a_sky_behind_a_half_plane(void **state)
{
    static const double distances[] = {.2, 1, 5};
    struct world *w = *state;
    for (size_t d = 0; d < sizeof distances / sizeof *distances; d++) {
        const double x = distances[d], at[3] = {0, 0, 0};
        const double wall[4][3] = {{x, 0, 2000}, {x, 0, -2000}, {x, 1, -2000}, {x, 1, 2000}};
        begin_floor(w, 9);
        const int32_t black = world_add_material(w, 0);
        world_add_quad(w, black, wall, 1);
        w->scene->materials[black].double_sided = true;
        w->scene->environment = (struct bd_environment){.radiance = {CD_M2, CD_M2, CD_M2}};
        check_at(w, "half plane", at, up, M_PI * CD_M2 * .5 * (1 + x / sqrt(x * x + 1)));
    }
}

#define MAP_WIDTH  128u
#define MAP_HEIGHT 64u
// The texel of the sun: some 50 degrees above the horizon.
#define SUN_X     70u
#define SUN_Y     14u
#define SUN_CD_M2 50000.0f

static struct bd_sky_map *map_with_a_sun(void)
{
    struct bd_sky_map *map = calloc(1, sizeof *map);
    map->reference_count = 1;
    map->width_px = MAP_WIDTH, map->height_px = MAP_HEIGHT;
    map->rgb = malloc(3 * (size_t)MAP_WIDTH * MAP_HEIGHT * sizeof *map->rgb);
    for (uint32_t i = 0; i < 3 * MAP_WIDTH * MAP_HEIGHT; i++) map->rgb[i] = .5f;
    for (int c = 0; c < 3; c++) map->rgb[3 * (SUN_Y * MAP_WIDTH + SUN_X) + c] = SUN_CD_M2;
    bd_sky_map_seal(map);
    return map;
}

// Of a direction's place in texels, between the four about it.
static double radiance_at(double x, double y)
{
    const double away_x = fabs(x - .5 - SUN_X), away_y = fabs(y - .5 - SUN_Y);
    const double sun = fmax(1 - away_x, 0) * fmax(1 - away_y, 0);
    return .5 + sun * ((double)SUN_CD_M2 - .5);
}

// As scene.h has it: the map begins at -z and turns towards +x.
static void direction_of(double x, double y, double out[3])
{
    const double azimuth = x / MAP_WIDTH * 2 * M_PI, polar = y / MAP_HEIGHT * M_PI;
    out[0] = sin(polar) * sin(azimuth);
    out[1] = cos(polar);
    out[2] = -sin(polar) * cos(azimuth);
}

// A roof of height 1 with a window of [-half, half]^2 about the axis of the sun's light that comes
// to the floor at 0.
struct window {
    double middle[2], half;
};

static struct window window_of(double half)
{
    double sun[3];
    direction_of(SUN_X + .5, SUN_Y + .5, sun);
    return (struct window){{sun[0] / sun[1], sun[2] / sun[1]}, half};
}

// Summed over the map, a few hundred steps to a texel at the sun.
static double window_irradiance(const struct window *window, const double at[3])
{
    double sum = 0;
    for (uint32_t texel = 0; texel < MAP_WIDTH * MAP_HEIGHT / 2; texel++) {
        const uint32_t x0 = texel % MAP_WIDTH, y0 = texel / MAP_WIDTH;
        const bool near = x0 + 1 >= SUN_X && x0 <= SUN_X + 1 && y0 + 1 >= SUN_Y && y0 <= SUN_Y + 1;
        const int steps = near ? 200 : 20;
        for (int i = 0; i < steps * steps; i++) {
            const double x = x0 + (i % steps + .5) / steps, y = y0 + (i / steps + .5) / steps;
            double d[3];
            direction_of(x, y, d);
            const double over[2] = {at[0] + d[0] / d[1] - window->middle[0],
                                    at[2] + d[2] / d[1] - window->middle[1]};
            if (fabs(over[0]) > window->half || fabs(over[1]) > window->half) continue;
            sum += radiance_at(x, y) * d[1] * sin(y / MAP_HEIGHT * M_PI) * 2 * M_PI / MAP_WIDTH *
                   M_PI / MAP_HEIGHT / (steps * steps);
        }
    }
    return sum;
}

static void add_roof(struct world *w, const struct window *window)
{
    const double a = -400, b = 400, h = window->half;
    const double left = window->middle[0] - h, right = window->middle[0] + h;
    const double back = window->middle[1] - h, front = window->middle[1] + h;
    const double parts[4][4] = {
        {a, left, a, b}, {right, b, a, b}, {left, right, a, back}, {left, right, front, b}};
    const int32_t black = world_add_material(w, 0);
    for (int p = 0; p < 4; p++) {
        const double x0 = parts[p][0], x1 = parts[p][1], z0 = parts[p][2], z1 = parts[p][3];
        const double corners[4][3] = {{x0, 1, z0}, {x1, 1, z0}, {x1, 1, z1}, {x0, 1, z1}};
        world_add_quad(w, black, corners, 1);
    }
    w->scene->materials[black].double_sided = true;
}

// In the middle of the light that falls in, and in its half shadow.
static void a_sun_through_a_window(void **state)
{
    struct world *w = *state;
    const struct window window = window_of(.1);
    static const double spots[][3] = {{0, 0, 0}, {.1, 0, 0}, {0, 0, -.09}};
    for (size_t p = 0; p < sizeof spots / sizeof *spots; p++) {
        begin_floor(w, 9);
        add_roof(w, &window);
        w->scene->environment =
            (struct bd_environment){.radiance = {1, 1, 1}, .map = map_with_a_sun()};
        check_at(w, "window", spots[p], up, window_irradiance(&window, spots[p]));
    }
}

// Beside the beam the sky is seen, dimly, and nothing of the sun.
static void no_sun_beside_a_window(void **state)
{
    struct world *w = *state;
    static const double at[3] = {.3, 0, .2}, lit[3] = {0, 0, 0};
    const struct window window = window_of(.1);
    begin_floor(w, 9);
    add_roof(w, &window);
    w->scene->environment = (struct bd_environment){.radiance = {1, 1, 1}, .map = map_with_a_sun()};
    const int32_t camera = world_add_probe(w, at, up, 1e-3);
    struct bd_image *image = look_at(w, camera, "light_rays=256");
    double mean = 0;
    for (uint32_t i = 0; i < SIDE * SIDE; i++) mean += image->pixels[3 * i] / (SIDE * SIDE);
    bd_image_destroy(&image);
    ASSERT_REL(mean, ALBEDO / M_PI * window_irradiance(&window, at), 0.1);
    assert_true(mean < 1e-3 * ALBEDO / M_PI * window_irradiance(&window, lit));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_rectangle),
        cmocka_unit_test(a_disk),
        cmocka_unit_test(a_sphere),
        cmocka_unit_test(a_furnace),
        cmocka_unit_test(a_sky_behind_a_half_plane),
        cmocka_unit_test(a_sun_through_a_window),
        cmocka_unit_test(no_sun_beside_a_window),
    };
    return cmocka_run_group_tests(tests, world_open, world_close);
}
