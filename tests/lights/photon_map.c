// Photons and the irradiance that they tell (lights/photon_map.h): even light, a focus, what faces
// away, and the map's edges.

#include <math.h>
#include <stdlib.h>

#include "lights/directions.h"
#include "lights/photon_map.h"
#include "lights/sequence.h"
#include "tests/unit/cmocka_all.h"

#define COUNT 16384u
#define REACH 0.2f

static enum bd_err go_on(void *user)
{
    (void)user;
    return BD_ERR_OK;
}

static struct bd_photon_map *map_made(const struct bd_photon *photons, uint32_t count,
                                      struct bd_photon_map_how how)
{
    struct bd_photon_map *map;
    struct bd_err_detail detail;
    assert_int_equal(bd_photon_map_create(photons, count, &how, go_on, NULL, &map, &detail),
                     BD_ERR_OK);
    return map;
}

static struct bd_photon_map *map_of(const struct bd_photon *photons, uint32_t count)
{
    return map_made(photons, count, (struct bd_photon_map_how){.reach = REACH});
}

// By chance over the square of side 1 in the plane z = 0, of 3 units of flux.
static struct bd_photon *even_photons(void)
{
    struct bd_photon *photons = calloc(COUNT, sizeof *photons);
    assert_non_null(photons);
    for (uint32_t i = 0; i < COUNT; i++) {
        const float x = (float)(bd_stirred(2 * i) >> 8) * 0x1p-24f;
        const float y = (float)(bd_stirred(2 * i + 1) >> 8) * 0x1p-24f;
        photons[i] = (struct bd_photon){{x, y, 0}, {0, 0, 1}, {3.0f / COUNT, 6.0f / COUNT, 0}};
    }
    return photons;
}

// Mean of many places in the middle.
static f3 seen(const struct bd_photon_map *map, float z, f3 normal, float least)
{
    f3 sum = f3_of(0, 0, 0);
    for (uint32_t i = 0; i < 1024; i++)
        sum = f3_add(sum,
                     bd_photon_map_look(
                         map, f3_of(0.25f + (float)(i % 32) / 64, 0.25f + (float)(i / 32) / 64, z),
                         normal, least));
    return f3_scale(sum, 1 / 1024.0f);
}

static void even_light_is_what_it_is(void **state)
{
    (void)state;
    struct bd_photon *photons = even_photons();
    struct bd_photon_map *map = map_of(photons, COUNT);
    const f3 up = f3_of(0, 0, 1), down = f3_of(0, 0, -1);
    const f3 nearest = seen(map, 0, up, 0), wide = seen(map, 0, up, 0.1f);
    assert_float_equal(nearest.x, 3, 0.12);
    assert_float_equal(nearest.y, 6, 0.24);
    assert_float_equal(wide.x, 3, 0.12);
    assert_float_equal(seen(map, 0, down, 0).x, 0, 0);
    assert_float_equal(seen(map, 2 * REACH, up, 0).x, 0, 0);
    bd_photon_map_destroy(&map);
    free(photons);
}

// All in one point: over a disk that is no smaller than asked for, nothing is lost.
static void a_focus_keeps_its_flux(void **state)
{
    (void)state;
    struct bd_photon photons[100];
    for (uint32_t i = 0; i < 100; i++)
        photons[i] = (struct bd_photon){{0.5f, 0.5f, 0}, {0, 0, 1}, {0.01f, 0.01f, 0.01f}};
    struct bd_photon_map *map = map_of(photons, 100);
    const uint32_t side = 200;
    double flux = 0;
    for (uint32_t i = 0; i < side * side; i++)
        flux += bd_photon_map_look(map,
                                   f3_of(((float)(i % side) + 0.5f) / (float)side,
                                         ((float)(i / side) + 0.5f) / (float)side, 0),
                                   f3_of(0, 0, 1), 0.05f)
                    .x;
    assert_float_equal(flux / (side * side), 1, 0.02);
    assert_float_equal(bd_photon_map_look(map, f3_of(0.5f, 0.5f, 0), f3_of(0, 0, 1), 0.05f).x,
                       2 / (M_PI * 0.05 * 0.05), 1);
    bd_photon_map_destroy(&map);
}

static void few_tell_what_they_have(void **state)
{
    (void)state;
    const struct bd_photon one = {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}};
    struct bd_photon_map *map = map_of(&one, 1), *none = map_of(NULL, 0);
    const f3 origin = f3_of(0, 0, 0), up = f3_of(0, 0, 1);
    assert_float_equal(bd_photon_map_look(map, origin, up, 0).x, 2 / (M_PI * REACH * REACH), 1e-3);
    assert_float_equal(bd_photon_map_look(none, origin, up, 0).x, 0, 0);
    bd_photon_map_destroy(&map);
    bd_photon_map_destroy(&none);
}

// Of places along a line from the middle of an edge, or of the square: mean and standard deviation.
static double looked_at(const struct bd_photon_map *map, f3 from, f3 step, double *deviation)
{
    double sum = 0, sum2 = 0;
    for (uint32_t i = 0; i < 64; i++) {
        const double e =
            bd_photon_map_look(map, f3_add(from, f3_scale(step, (float)i / 64)), f3_of(0, 0, 1), 0)
                .x;
        sum += e;
        sum2 += e * e;
    }
    *deviation = sqrt(fmax(sum2 / 64 - sum * sum / 64 / 64, 0));
    return sum / 64;
}

// Algorithms.md D9: with k photons in the disk noise is sqrt(4 / (3 k)); an edge has half of the
// light, and a corner a quarter, but for points that say what of the disk is there.
static void more_photons_are_less_noise_and_edges_are_whole(void **state)
{
    (void)state;
    struct bd_photon *photons = even_photons();
    struct bd_surface_points square[BD_EDGE_LEVELS] = {
        {.count = COUNT, .area = 1.0f / COUNT, .points = calloc(COUNT, sizeof *square->points)},
        {.count = COUNT / 16, .area = 16.0f / COUNT}};
    assert_non_null(square[0].points);
    square[1].points = square[0].points;
    const struct bd_sequence sequence = bd_sequence_of(7, 7);
    for (uint32_t i = 0; i < COUNT; i++) {
        float at[2];
        bd_sequence_pair(&sequence, i, at);
        square[0].points[i] =
            (struct bd_surface_point){.position = f3_of(at[0], at[1], 0), .normal = f3_of(0, 0, 1)};
    }
    struct bd_photon_map_how how = {.reach = 0.4f, .near = 256};
    struct bd_photon_map *cut = map_made(photons, COUNT, how);
    how.surfaces = square;
    struct bd_photon_map *whole = map_made(photons, COUNT, how);
    double noise, noise_whole, unused;
    const f3 middle = f3_of(0.15f, 0.5f, 0), edge = f3_of(0.15f, 0, 0), along = f3_of(0.7f, 0, 0);
    assert_float_equal(looked_at(cut, middle, along, &noise), 3, 0.1);
    assert_float_equal(looked_at(whole, middle, along, &noise_whole), 3, 0.1);
    assert_float_equal(noise / 3, sqrt(4.0 / (3 * 256)), 0.02);
    assert_true(noise_whole < 1.1 * noise);
    assert_float_equal(looked_at(cut, edge, along, &unused), 1.5, 0.15);
    assert_float_equal(looked_at(whole, edge, along, &unused), 3, 0.15);
    const f3 corner = f3_of(0, 0, 0), nowhere = f3_of(0, 0, 0);
    assert_float_equal(looked_at(cut, corner, nowhere, &unused), 0.75, 0.2);
    assert_float_equal(looked_at(whole, corner, nowhere, &unused), 3, 0.5);
    bd_photon_map_destroy(&cut);
    bd_photon_map_destroy(&whole);
    free(square[0].points);
    free(photons);
}

// A wall stands at x = .5: of what is lit behind it nothing counts, and of what is before it the
// disk's part there.
static void walls_cut_disks(void **state)
{
    (void)state;
    struct bd_photon *photons = even_photons();
    struct bd_photon_map *map =
        map_made(photons, COUNT, (struct bd_photon_map_how){.reach = REACH, .near = 256});
    struct bd_disk_cut cuts[BD_DISK_CUTS] = {0}, none[BD_DISK_CUTS] = {0};
    const struct bd_photon_disk disk =
        bd_photon_disk_of(map, f3_of(0.5f - 1e-4f, 0.5f, 0), f3_of(0, 0, 1), 0);
    const struct bd_basis basis = bd_basis_of(disk.normal);
    for (uint32_t k = 0; k < BD_DISK_CUTS; k++) {
        const float turn = 2 * F_PI * (float)k / BD_DISK_CUTS;
        if (f3_add(f3_scale(basis.x, cosf(turn)), f3_scale(basis.y, sinf(turn))).x > 0.01f)
            cuts[k] = (struct bd_disk_cut){f3_of(0.5f, 0.5f, 0), f3_of(-1, 0, 0)};
    }
    assert_float_equal(bd_photon_map_tell(map, &disk, none).x, 3, 0.6);
    assert_float_equal(bd_photon_map_tell(map, &disk, cuts).x, 1.5, 0.4);
    for (uint32_t i = 0; i < COUNT; i++)
        if (photons[i].position.x < 0.5f) photons[i].flux = f3_of(0, 0, 0);
    struct bd_photon_map *behind =
        map_made(photons, COUNT, (struct bd_photon_map_how){.reach = REACH, .near = 256});
    assert_float_equal(bd_photon_map_tell(behind, &disk, none).x, 1.5, 0.6);
    assert_float_equal(bd_photon_map_tell(behind, &disk, cuts).x, 0, 0);
    bd_photon_map_destroy(&map);
    bd_photon_map_destroy(&behind);
    free(photons);
}

static void a_radius_holds_everywhere(void **state)
{
    (void)state;
    const struct bd_photon one = {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}};
    struct bd_photon_map *map =
        map_made(&one, 1, (struct bd_photon_map_how){.reach = REACH, .radius = 0.1f});
    const f3 up = f3_of(0, 0, 1);
    assert_float_equal(bd_photon_map_look(map, f3_of(0, 0, 0), up, 0).x, 2 / (M_PI * 0.01), 1e-3);
    assert_float_equal(bd_photon_map_look(map, f3_of(0.11f, 0, 0), up, 0).x, 0, 0);
    bd_photon_map_destroy(&map);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(even_light_is_what_it_is),
        cmocka_unit_test(a_focus_keeps_its_flux),
        cmocka_unit_test(few_tell_what_they_have),
        cmocka_unit_test(more_photons_are_less_noise_and_edges_are_whole),
        cmocka_unit_test(walls_cut_disks),
        cmocka_unit_test(a_radius_holds_everywhere),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
