// A cache's cells over the places that rays met: whoever lies where, in whatever order.

#include "lights/irradiance_cells.h"
#include "lights/sequence.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "tests/unit/cmocka_all.h"

#define PLACES 20000u
#define MOST   300u
#define RADIUS 4.0f

struct place {
    f3 position, normal;
};

static float number_of(uint32_t *state)
{
    *state = bd_stirred(*state + 0x9e3779b9u);
    return (float)(*state >> 8) * 0x1p-24f;
}

// Half of them on the sixteenth of a floor, the others all over it and on a wall.
static struct place place_at(uint32_t i)
{
    uint32_t state = 7 * i + 1;
    const float x = number_of(&state), y = number_of(&state);
    if (i % 2) return (struct place){f3_of(x, 0, y), f3_of(0, 1, 0)};
    if (i % 4) return (struct place){f3_of(4 * x - 2, 0, 4 * y - 2), f3_of(0, 1, 0)};
    return (struct place){f3_of(-2, 4 * x, 4 * y - 2), f3_of(1, 0, 0)};
}

static struct bd_irradiance_cells *cells_of(const struct place *places, uint32_t count,
                                            uint32_t most)
{
    uint64_t *numbers = malloc((count + 1) * sizeof *numbers);
    struct bd_irradiance_cells *cells;
    struct bd_err_detail detail;
    assert_non_null(numbers);
    for (uint32_t i = 0; i < count; i++)
        numbers[i] = bd_irradiance_cell_at(places[i].position, places[i].normal, RADIUS);
    assert_int_equal(bd_irradiance_cells_create(numbers, count, most, RADIUS, &cells, &detail),
                     BD_ERR_OK);
    free(numbers);
    for (uint32_t i = 0; i < cells->count; i++) {
        const struct place *at = &places[cells->chosen[i]];
        cells->places[i] = (struct bd_cell_place){at->position, at->normal};
    }
    return cells;
}

static struct place *all_places(void)
{
    struct place *places = malloc(PLACES * sizeof *places);
    assert_non_null(places);
    for (uint32_t i = 0; i < PLACES; i++) places[i] = place_at(i);
    return places;
}

// The place that stands for it lies in it, and nobody else's is asked.
static void every_place_is_told_by_one_of_its_cell(void **state)
{
    (void)state;
    struct place *places = all_places();
    struct bd_irradiance_cells *cells = cells_of(places, PLACES, MOST);
    assert_in_range(cells->count, MOST / 2, MOST);
    for (uint32_t i = 0; i < cells->count; i++) {
        const struct place *of = &places[cells->chosen[i]];
        assert_int_equal(bd_irradiance_cells_of(cells, of->position, of->normal), i);
        if (i > 0) assert_true(cells->first[i - 1] < cells->first[i]);
    }
    for (uint32_t i = 0; i < PLACES; i++) {
        const uint32_t by = bd_irradiance_cells_of(cells, places[i].position, places[i].normal);
        assert_true(f3_dot(cells->places[by].normal, places[i].normal) > 0.5f);
    }
    bd_irradiance_cells_destroy(&cells);
    free(places);
}

static void more_cells_lie_where_more_rays_end(void **state)
{
    (void)state;
    struct place *places = all_places();
    struct bd_irradiance_cells *cells = cells_of(places, PLACES, MOST);
    uint32_t within = 0, on_the_floor = 0;
    for (uint32_t i = 0; i < cells->count; i++) {
        const struct place *of = &places[cells->chosen[i]];
        const bool floor = of->normal.y > 0.5f;
        on_the_floor += floor;
        within += floor && of->position.x > 0 && of->position.x < 1 && of->position.z > 0 &&
                  of->position.z < 1;
    }
    // A sixteenth of the floor, on which two thirds of its places are.
    assert_true(within > on_the_floor / 3);
    uint32_t *told = calloc(cells->count, sizeof *told), most = 0;
    assert_non_null(told);
    for (uint32_t i = 0; i < PLACES; i++) {
        const uint32_t by = bd_irradiance_cells_of(cells, places[i].position, places[i].normal);
        if (++told[by] > most) most = told[by];
    }
    // A cell is divided in four on a plane: none has more than a few times its part.
    assert_true(most < 8 * PLACES / cells->count);
    free(told);
    bd_irradiance_cells_destroy(&cells);
    free(places);
}

// Of a picture a moment later: about one place of each cell is gone. Cells keep their numbers, and
// many the place that stands for them.
static void cells_stay_while_something_moves(void **state)
{
    (void)state;
    struct place *places = all_places(), *later = all_places();
    uint32_t left = 0, as_before = 0, told_by_same = 0;
    for (uint32_t i = 0; i < PLACES; i++)
        if (bd_stirred(i) % (PLACES / MOST) > 0) later[left++] = places[i];
    struct bd_irradiance_cells *a = cells_of(places, PLACES, MOST),
                               *b = cells_of(later, left, MOST);
    for (uint32_t i = 0, k = 0; i + 1 < a->count; i++) {
        while (k + 1 < b->count && b->first[k] < a->first[i]) k++;
        if (k + 1 >= b->count || b->first[k] != a->first[i] || b->first[k + 1] != a->first[i + 1])
            continue;
        as_before++;
        assert_int_equal(a->number[i], b->number[k]);
        told_by_same += !memcmp(&places[a->chosen[i]], &later[b->chosen[k]], sizeof *places);
    }
    assert_true(as_before > a->count * 3 / 4);
    assert_true(told_by_same > as_before / 2);
    bd_irradiance_cells_destroy(&a);
    bd_irradiance_cells_destroy(&b);
    free(places);
    free(later);
}

static float distance_to(const struct bd_irradiance_cells *cells, uint32_t cell, f3 position)
{
    const f3 way = f3_sub(cells->places[cell].position, position);
    return sqrtf(f3_dot(way, way));
}

// The own one first, then all that lie about it; none that face another way.
static void cells_about_a_place_are_its_neighbours(void **state)
{
    (void)state;
    struct place *places = all_places();
    struct bd_irradiance_cells *cells = cells_of(places, PLACES, MOST);
    uint32_t few = 0;
    for (uint32_t i = 0; i < PLACES; i++) {
        const struct place *at = &places[i];
        uint32_t about[BD_CELLS_ABOUT_MOST], own;
        const uint32_t count =
            bd_irradiance_cells_about(cells, at->position, at->normal, about, BD_CELLS_ABOUT_MOST);
        assert_int_equal(bd_irradiance_cells_about(cells, at->position, at->normal, &own, 1), 1);
        assert_int_equal(own, bd_irradiance_cells_of(cells, at->position, at->normal));
        assert_true(count >= 1 && about[0] == own);
        few += count < 4;
        for (uint32_t k = 1; k < count; k++) {
            assert_true(f3_dot(cells->places[about[k]].normal, at->normal) > 0.5f);
            for (uint32_t j = 0; j < k; j++) assert_int_not_equal(about[j], about[k]);
            if (k > 1)
                assert_true(distance_to(cells, about[k - 1], at->position) <=
                            distance_to(cells, about[k], at->position));
        }
    }
    // In corners, and beside cells that are much larger.
    assert_true(few < PLACES / 50);
    // Where nobody was: of those next to it in their order.
    uint32_t one;
    const f3 off = f3_of(.5f, .05f, .5f);
    assert_int_equal(bd_irradiance_cells_find(cells, off, f3_of(0, 1, 0)), BD_NO_CELL);
    assert_int_equal(bd_irradiance_cells_about(cells, off, f3_of(0, 1, 0), &one, 1), 1);
    assert_true(distance_to(cells, one, off) < 4);
    bd_irradiance_cells_destroy(&cells);
    free(places);
}

// Irradiance that grows along x is told nearly as it is by those that lie beside each other; one
// that nobody sees has no say.
static void between_cells_light_changes_little_by_little(void **state)
{
    (void)state;
    struct place *places = all_places();
    struct bd_irradiance_cells *cells = cells_of(places, PLACES, MOST);
    double off = 0, off_alone = 0;
    uint32_t about[BD_CELLS_ABOUT_MOST];
    cells->beside = malloc(BD_CELLS_BESIDE * cells->count * sizeof *cells->beside);
    assert_non_null(cells->beside);
    for (uint32_t i = 0; i < cells->count; i++) {
        const struct bd_cell_place *at = &cells->places[i];
        uint32_t *beside = &cells->beside[BD_CELLS_BESIDE * i], kept = 0;
        const uint32_t count =
            bd_irradiance_cells_about(cells, at->position, at->normal, about, BD_CELLS_ABOUT_MOST);
        for (uint32_t k = 0; k < count && kept < BD_CELLS_BESIDE; k++)
            if (about[k] != i) beside[kept++] = about[k];
        while (kept < BD_CELLS_BESIDE) beside[kept++] = BD_NO_CELL;
        cells->irradiance[i] = f3_of(at->position.x, 1, 0);
    }
    for (uint32_t i = 0; i < PLACES; i++) {
        const f3 position = places[i].position, normal = places[i].normal;
        const uint32_t cell = bd_irradiance_cells_of(cells, position, normal);
        const f3 told = bd_irradiance_cells_between(cells, cell, position, normal);
        off += pow((double)(told.x - position.x), 2);
        off_alone += pow((double)(cells->irradiance[cell].x - position.x), 2);
        assert_true(fabs((double)told.y - 1) < 1e-5 && told.z == 0);
    }
    for (uint32_t i = 0; i < cells->count; i++) {
        const struct bd_cell_place *at = &cells->places[i];
        const f3 aside = f3_add(at->position, f3_of(0.01f, 0, 0));
        cells->beside[BD_CELLS_BESIDE * i] = BD_NO_CELL;
        const f3 told = bd_irradiance_cells_between(cells, i, aside, at->normal);
        assert_true(fabs((double)(told.x - cells->irradiance[i].x)) < 1e-5);
    }
    assert_true(sqrt(off) < 0.6 * sqrt(off_alone));
    bd_irradiance_cells_destroy(&cells);
    free(places);
}

static void order_does_not_matter(void **state)
{
    (void)state;
    struct place *places = all_places(), *turned = all_places();
    for (uint32_t i = 0; i < PLACES; i++) turned[i] = places[PLACES - 1 - i];
    struct bd_irradiance_cells *a = cells_of(places, PLACES, MOST);
    struct bd_irradiance_cells *b = cells_of(turned, PLACES, MOST);
    assert_int_equal(a->count, b->count);
    assert_memory_equal(a->first, b->first, a->count * sizeof *a->first);
    for (uint32_t i = 0; i < a->count; i++)
        assert_memory_equal(&places[a->chosen[i]], &turned[b->chosen[i]], sizeof *places);
    bd_irradiance_cells_destroy(&a);
    bd_irradiance_cells_destroy(&b);
    free(places);
    free(turned);
}

static void there_may_be_none_or_all_at_one_place(void **state)
{
    (void)state;
    struct bd_irradiance_cells *cells = cells_of(NULL, 0, MOST);
    assert_int_equal(cells->count, 0);
    uint32_t about[BD_CELLS_ABOUT_MOST];
    const f3 at = f3_of(0, 0, 0), up = f3_of(0, 1, 0);
    assert_int_equal(bd_irradiance_cells_of(cells, at, up), BD_NO_CELL);
    assert_int_equal(bd_irradiance_cells_about(cells, at, up, about, BD_CELLS_ABOUT_MOST), 0);
    bd_irradiance_cells_destroy(&cells);
    struct place same[50];
    for (int i = 0; i < 50; i++) same[i] = (struct place){f3_of(1, 1, 1), f3_of(0, 0, -1)};
    cells = cells_of(same, 50, MOST);
    assert_int_equal(cells->count, 1);
    // As large as that of one.
    assert_int_equal(bd_irradiance_cells_of(cells, f3_of(.9f, 1, 1.2f), f3_of(0, 0, -1)), 0);
    bd_irradiance_cells_destroy(&cells);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_place_is_told_by_one_of_its_cell),
        cmocka_unit_test(more_cells_lie_where_more_rays_end),
        cmocka_unit_test(cells_stay_while_something_moves),
        cmocka_unit_test(cells_about_a_place_are_its_neighbours),
        cmocka_unit_test(between_cells_light_changes_little_by_little),
        cmocka_unit_test(order_does_not_matter),
        cmocka_unit_test(there_may_be_none_or_all_at_one_place),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
