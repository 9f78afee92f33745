// Building the acceleration structure of many triangles: it asks whether to go on all along, stops
// when told, and leaves nothing behind.

#include <math.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/sanitizer.h"
#include "stage.h"
#include "tests/unit/cmocka_all.h"

#define PATIENCE (BD_UNDER_SANITIZER ? 5 : 1)
#define SIDE     700u // 980,000 triangles: about 0.3 s on two threads

// A wavy sheet of side x side x 2 triangles over the unit square, seen from above.
static struct stage *create_sheet(uint32_t side)
{
    struct stage *stage = stage_create();
    float *positions = malloc(3 * ((size_t)side + 1) * (side + 1) * sizeof *positions);
    uint32_t *indices = malloc(6 * (size_t)side * side * sizeof *indices), *next = indices;
    for (uint32_t i = 0; i < (side + 1) * (side + 1); i++) {
        uint32_t x = i % (side + 1), z = i / (side + 1);
        positions[3 * i] = (float)x / (float)side;
        positions[3 * i + 1] = 0.01f * (float)((x * 7 + z * 13) % 11);
        positions[3 * i + 2] = (float)z / (float)side;
    }
    for (uint32_t i = 0; i < side * side; i++, next += 6) {
        uint32_t a = i / side * (side + 1) + i % side, b = a + side + 1;
        const uint32_t corners[6] = {a, b, a + 1, a + 1, b, b + 1};
        for (int c = 0; c < 6; c++) next[c] = corners[c];
    }
    stage_triangles(stage, stage_material(stage, 0.5f), positions, NULL, indices, 6 * side * side);
    stage_camera(stage, (const double[3]){.5, 1, .5}, (const double[3]){.5, 0, .5}, 0.5);
    struct bd_err_detail detail = {0};
    if (bd_scene_finish(stage->scene, &detail)) fail_msg("finish: %s", detail.message);
    free(positions);
    free(indices);
    return stage;
}

// Says no from the `until`th question on.
struct patience {
    atomic_uint asked;
    uint32_t until;
    enum bd_err answer;
    uint64_t answered_ns; // of the first no
};

static enum bd_err should_stop(void *user)
{
    struct patience *patience = user;
    uint32_t asked = atomic_fetch_add(&patience->asked, 1) + 1;
    if (asked < patience->until) return BD_ERR_OK;
    if (asked == patience->until) patience->answered_ns = bd_clock_ns();
    return patience->answer;
}

static void assert_stops(struct stage *stage, struct patience *patience)
{
    struct bd_reference *reference = NULL;
    struct bd_err_detail detail = {0};
    enum bd_err err =
        bd_reference_create(stage->scene, 2, should_stop, patience, &reference, &detail);
    if (!err) bd_reference_destroy(&reference);
    assert_int_equal(err, patience->answer);
    assert_null(reference);
    assert_string_equal(detail.message, ""); // who stopped it knows why
    assert_int_equal(stage->scene->reference_count, 1);
}

static void build(struct stage *stage)
{
    struct bd_err_detail detail = {0};
    if (bd_reference_create(stage->scene, 2, NULL, NULL, &stage->reference, &detail))
        fail_msg("reference: %s", detail.message);
}

static void assert_traces(struct stage *stage)
{
    const struct bd_reference_view view = {.width_px = 4, .height_px = 4};
    struct bd_reference_pixel pixel = {0};
    build(stage);
    for (uint32_t p = 0; p < 16; p++)
        bd_reference_trace(stage->reference, &bd_integrand_full, &view, 0, p % 4, p / 4, 0, 1,
                           &pixel);
    assert_true(pixel.coverage == 32); // both halves of every pixel met the sheet
}

static void it_stops_wherever_it_is_told_to(void **state)
{
    (void)state;
    static const uint32_t untils[] = {1, 2, 3, 10, 100, 500};
    static const enum bd_err answers[] = {BD_ERR_CANCELLED, BD_ERR_DEADLINE};
    struct stage *stage = create_sheet(SIDE / 2);
    for (size_t i = 0; i < sizeof untils / sizeof untils[0]; i++) {
        struct patience patience = {.until = untils[i], .answer = answers[i % 2]};
        assert_stops(stage, &patience);
    }
    assert_traces(stage);
    stage_destroy(&stage);
}

// The best of five: what other processes take of the machine is not ours.
static void it_stops_soon(void **state)
{
    (void)state;
    struct stage *stage = create_sheet(SIDE);
    double best_ms = 1e9;
    for (int k = 0; k < 5; k++) {
        struct patience patience = {.until = 50, .answer = BD_ERR_CANCELLED};
        assert_stops(stage, &patience);
        best_ms = fmin(best_ms, bd_ms_since(patience.answered_ns));
    }
    print_message("    ended %.1f ms after the answer\n", best_ms);
    assert_true(best_ms < PATIENCE * 50);
    stage_destroy(&stage);
}

static double resident_mib(void)
{
    long pages = 0;
    FILE *file = fopen("/proc/self/statm", "r");
    assert_non_null(file);
    assert_int_equal(fscanf(file, "%*d %ld", &pages), 1);
    fclose(file);
    return (double)pages * (double)sysconf(_SC_PAGESIZE) / (1 << 20);
}

// Embree maps large blocks itself, where no sanitizer sees them.
static void what_was_begun_is_given_back(void **state)
{
    (void)state;
    struct stage *stage = create_sheet(SIDE);
    double before_mib = 0;
    for (int k = 0; k < 10; k++) {
        struct patience patience = {.until = 3000, .answer = BD_ERR_CANCELLED};
        assert_stops(stage, &patience);
        if (k == 1) before_mib = resident_mib();
    }
    double grown_mib = resident_mib() - before_mib;
    build(stage);
    double whole_mib = (double)bd_reference_memory(stage->reference).shape_bytes / (1 << 20);
    print_message("    %.0f MiB more after eight of %.0f MiB\n", grown_mib, whole_mib);
    assert_true(grown_mib < whole_mib);
    stage_destroy(&stage);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(it_stops_wherever_it_is_told_to),
        cmocka_unit_test(it_stops_soon),
        cmocka_unit_test(what_was_begun_is_given_back),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
