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

// On the plane z = 0, from straight above.
static struct bd_photon photon_at(float x, float y, f3 flux)
{
    return (struct bd_photon){
        .position = f3_of(x, y, 0), .normal = f3_of(0, 0, 1), .flux = flux, .way = f3_of(0, 0, 1)};
}

// By chance over the square of side 1 in the plane z = 0, of 3 units of flux.
static struct bd_photon *even_photons(void)
{
    struct bd_photon *photons = calloc(COUNT, sizeof *photons);
    assert_non_null(photons);
    for (uint32_t i = 0; i < COUNT; i++) {
        const float x = (float)(bd_stirred(2 * i) >> 8) * 0x1p-24f;
        const float y = (float)(bd_stirred(2 * i + 1) >> 8) * 0x1p-24f;
        photons[i] = photon_at(x, y, f3_of(3.0f / COUNT, 6.0f / COUNT, 0));
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
        photons[i] = photon_at(0.5f, 0.5f, f3_of(0.01f, 0.01f, 0.01f));
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
    const struct bd_photon one = photon_at(0, 0, f3_of(1, 0, 0));
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
    struct bd_surface_points square = {
        .count = COUNT, .area = 1.0f / COUNT, .points = calloc(COUNT, sizeof *square.points)};
    assert_non_null(square.points);
    const struct bd_sequence sequence = bd_sequence_of(7, 7);
    for (uint32_t i = 0; i < COUNT; i++) {
        float at[2];
        bd_sequence_pair(&sequence, i, at);
        square.points[i] =
            (struct bd_surface_point){.position = f3_of(at[0], at[1], 0), .normal = f3_of(0, 0, 1)};
    }
    struct bd_photon_map_how how = {.reach = 0.4f, .near = 256};
    struct bd_photon_map *cut = map_made(photons, COUNT, how);
    how.surfaces = &square;
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
    free(square.points);
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
    assert_float_equal(bd_photon_map_tell(map, &disk, none, NULL).x, 3, 0.6);
    assert_float_equal(bd_photon_map_tell(map, &disk, cuts, NULL).x, 1.5, 0.4);
    for (uint32_t i = 0; i < COUNT; i++)
        if (photons[i].position.x < 0.5f) photons[i].flux = f3_of(0, 0, 0);
    struct bd_photon_map *behind =
        map_made(photons, COUNT, (struct bd_photon_map_how){.reach = REACH, .near = 256});
    assert_float_equal(bd_photon_map_tell(behind, &disk, none, NULL).x, 1.5, 0.6);
    assert_float_equal(bd_photon_map_tell(behind, &disk, cuts, NULL).x, 0, 0);
    bd_photon_map_destroy(&map);
    bd_photon_map_destroy(&behind);
    free(photons);
}

static void a_radius_holds_everywhere(void **state)
{
    (void)state;
    const struct bd_photon one = photon_at(0, 0, f3_of(1, 0, 0));
    struct bd_photon_map *map =
        map_made(&one, 1, (struct bd_photon_map_how){.reach = REACH, .radius = 0.1f});
    const f3 up = f3_of(0, 0, 1);
    assert_float_equal(bd_photon_map_look(map, f3_of(0, 0, 0), up, 0).x, 2 / (M_PI * 0.01), 1e-3);
    assert_float_equal(bd_photon_map_look(map, f3_of(0.11f, 0, 0), up, 0).x, 0, 0);
    bd_photon_map_destroy(&map);
}

struct lobe {
    f3 irradiance;
    uint32_t count, met;
    float along_x;
};

static void take(void *user, const struct bd_photon_told *told)
{
    struct lobe *lobe = user;
    lobe->irradiance = f3_add(lobe->irradiance, told->irradiance);
    lobe->count++;
    lobe->met += told->is_met;
    lobe->along_x += told->irradiance.x * told->way.x;
}

// Half of them from 30 degrees off the normal, to +x: a normal that leans there gets cos 0 / cos 30
// of those and cos 30 of the others.
static void photons_tell_whence_they_came(void **state)
{
    (void)state;
    struct bd_photon *photons = even_photons();
    const float c = sqrtf(0.75f);
    for (uint32_t i = 0; i < COUNT; i += 2) {
        photons[i].way = f3_of(0.5f, 0, c);
        photons[i].is_met = true;
    }
    struct bd_photon_map *map =
        map_made(photons, COUNT, (struct bd_photon_map_how){.reach = REACH, .near = 1024});
    const struct bd_photon_disk disk =
        bd_photon_disk_of(map, f3_of(0.5f, 0.5f, 0), f3_of(0, 0, 1), 0);
    f3 vector;
    struct lobe lobe = {0};
    const f3 all = bd_photon_map_tell(map, &disk, NULL, &vector);
    bd_photon_map_each(map, &disk, NULL, take, &lobe);
    assert_float_equal(f3_dot(vector, disk.normal), all.x + all.y, 1e-3 * 9);
    assert_float_equal(f3_dot(vector, f3_of(0.5f, 0, c)) / 9, 0.5 / c + 0.5 * c, 0.05);
    assert_float_equal(lobe.irradiance.x, all.x, 1e-3 * 3);
    assert_float_equal(lobe.irradiance.y, all.y, 1e-3 * 6);
    assert_float_equal(lobe.along_x / all.x, 0.25, 0.02);
    assert_float_equal((double)lobe.met / lobe.count, 0.5, 0.06);
    bd_photon_map_destroy(&map);
    free(photons);
}

// A focus beside it, a hundred times as dense, is no light of a place that it does not reach.
static void a_bright_place_farther_off_is_not_told(void **state)
{
    (void)state;
    const f3 at = f3_of(0.53f, 0.65f, 0), up = f3_of(0, 0, 1);
    struct bd_photon *photons = realloc(even_photons(), 2 * COUNT * sizeof *photons);
    assert_non_null(photons);
    for (uint32_t i = 0; i < COUNT; i++) {
        photons[COUNT + i] = photons[i];
        photons[COUNT + i].position =
            f3_add(f3_of(0.6f, 0.6f, 0), f3_scale(photons[i].position, 0.1f));
    }
    const struct bd_photon_map_how how = {.reach = REACH, .near = 1024};
    struct bd_photon_map *even = map_made(photons, COUNT, how);
    struct bd_photon_map *both = map_made(photons, 2 * COUNT, how);
    const float alone = bd_photon_map_look(even, at, up, 0).x,
                beside = bd_photon_map_look(both, at, up, 0).x;
    print_message("    %.3f, and beside it %.3f\n", (double)alone, (double)beside);
    assert_float_equal(alone, 3, 0.3);
    assert_float_equal(beside, alone, 0.5 * alone); // 28 while disks were the pilot's
    bd_photon_map_destroy(&even);
    bd_photon_map_destroy(&both);
    free(photons);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_bright_place_farther_off_is_not_told),
        cmocka_unit_test(even_light_is_what_it_is),
        cmocka_unit_test(a_focus_keeps_its_flux),
        cmocka_unit_test(few_tell_what_they_have),
        cmocka_unit_test(more_photons_are_less_noise_and_edges_are_whole),
        cmocka_unit_test(walls_cut_disks),
        cmocka_unit_test(a_radius_holds_everywhere),
        cmocka_unit_test(photons_tell_whence_they_came),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
