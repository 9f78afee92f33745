// Whose turn the reference's pool is, and which snapshots stay prepared. Needs no device.

#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

#include "base/clock.h"
#include "base/sanitizer.h"
#include "sched/reference_runner.h"
#include "world.h"

#define PATIENCE (BD_UNDER_SANITIZER ? 5 : 1)

static void sleep_ms(long ms)
{
    const struct timespec time = {ms / 1000, ms % 1000 * 1000000};
    nanosleep(&time, NULL);
}

// `id` tells snapshots apart, as a content hash does; 0 for one that has none.
static struct bd_scene *create_scene(uint8_t id)
{
    struct world builder = {.scene = bd_scene_create()};
    const double origin[3] = {0, 0, 0}, down[3] = {0, -1, 0}, eye[3] = {.5, .5, .9};
    world_add_box_room(&builder, world_add_material(&builder, 0.5f), origin, 1);
    world_add_light(&builder, BD_LIGHT_POINT, origin, down, 1);
    world_add_camera(&builder, eye, origin, 1.2);
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_scene_finish(builder.scene, &detail), BD_ERR_OK);
    builder.scene->content_sha256[0] = id;
    return builder.scene;
}

// Takes and gives back at once; says whether it was prepared already.
static bool touch(struct bd_reference_runner *runner, struct bd_scene *scene)
{
    const struct bd_reference *reference;
    struct bd_err_detail detail = {0};
    bool reused;
    assert_int_equal(
        bd_reference_runner_take(runner, scene, NULL, NULL, &reference, &reused, &detail),
        BD_ERR_OK);
    assert_non_null(reference);
    bd_reference_runner_give_back(runner, &reference);
    assert_null(reference);
    return reused;
}

static struct bd_reference_runner_stats stats_of(struct bd_reference_runner *runner)
{
    struct bd_reference_runner_stats stats;
    bd_reference_runner_stats(runner, &stats);
    return stats;
}

static void nothing_is_started_before_it_is_needed(void **state)
{
    const struct bd_reference_runner_stats stats = stats_of(*state);
    assert_int_equal(stats.thread_count, 0);
    assert_int_equal(stats.memory_bytes, 0);
}

static void a_snapshot_is_prepared_once(void **state)
{
    struct bd_reference_runner *runner = *state;
    struct bd_scene *first = create_scene(1), *same = create_scene(1), *other = create_scene(2);
    struct bd_scene *nameless = create_scene(0), *too = create_scene(0);
    assert_false(touch(runner, first));
    assert_true(touch(runner, first));
    assert_true(touch(runner, same)); // the same content, imported twice
    assert_false(touch(runner, other));
    assert_false(touch(runner, nameless));
    assert_true(touch(runner, nameless));
    assert_false(touch(runner, too));
    assert_int_equal(stats_of(runner).built_count, 4);
    assert_int_equal(stats_of(runner).reference_count, 4);
    assert_true(stats_of(runner).memory_bytes > 1000);
    struct bd_scene *scenes[] = {first, same, other, nameless, too};
    for (int i = 0; i < 5; i++) bd_scene_release(&scenes[i]);
}

static void only_the_last_used_ones_stay(void **state)
{
    struct bd_reference_runner *runner = *state;
    struct bd_scene *scenes[6];
    for (uint8_t i = 0; i < 6; i++) scenes[i] = create_scene(i + 1);
    for (int i = 0; i < 4; i++) touch(runner, scenes[i]);
    assert_true(touch(runner, scenes[0])); // used again: 1 is the oldest now
    touch(runner, scenes[4]);
    assert_int_equal(stats_of(runner).reference_count, 4);
    assert_true(touch(runner, scenes[0]));
    assert_false(touch(runner, scenes[1]));
    // What is gone holds its scene no longer.
    assert_int_equal(scenes[2]->reference_count, 1);
    for (int i = 0; i < 6; i++) bd_scene_release(&scenes[i]);
}

// As an edit of its light leaves a scene: what both have in common is built and counted once, and
// outlives whoever had it first.
static void light_that_moves_builds_nothing(void **state)
{
    struct bd_reference_runner *runner = *state;
    struct bd_scene *scenes[7];
    for (uint8_t i = 0; i < 7; i++) scenes[i] = create_scene(i + 1);
    struct bd_aspects *edited = &scenes[1]->aspects;
    *edited = scenes[0]->aspects;
    edited->counter[BD_ASPECT_LIGHTS]++;
    edited->counter[BD_ASPECT_COLOUR]++;
    assert_false(touch(runner, scenes[0]));
    const uint64_t alone_bytes = stats_of(runner).memory_bytes;
    assert_true(touch(runner, scenes[1]));
    assert_int_equal(stats_of(runner).built_count, 1);
    assert_int_equal(stats_of(runner).reference_count, 2);
    assert_true(stats_of(runner).memory_bytes < alone_bytes * 3 / 2);
    for (int i = 2; i < 5; i++) assert_false(touch(runner, scenes[i]));
    assert_int_equal(stats_of(runner).reference_count, 4); // the first has gone
    scenes[5]->aspects = scenes[1]->aspects;
    assert_true(touch(runner, scenes[5]));
    scenes[6]->aspects = scenes[1]->aspects;
    scenes[6]->aspects.counter[BD_ASPECT_TRANSFORMS]++;
    assert_false(touch(runner, scenes[6]));
    for (int i = 0; i < 7; i++) bd_scene_release(&scenes[i]);
}

static void what_is_in_use_stays(void **state)
{
    struct bd_reference_runner *runner = *state;
    struct bd_scene *scenes[7];
    const struct bd_reference *held;
    struct bd_err_detail detail = {0};
    bool reused;
    for (uint8_t i = 0; i < 7; i++) scenes[i] = create_scene(i + 1);
    assert_int_equal(
        bd_reference_runner_take(runner, scenes[0], NULL, NULL, &held, &reused, &detail),
        BD_ERR_OK);
    for (int i = 1; i < 7; i++) touch(runner, scenes[i]);
    assert_true(touch(runner, scenes[0]));
    bd_reference_runner_give_back(runner, &held);
    for (int i = 0; i < 7; i++) bd_scene_release(&scenes[i]);
}

// --- a build that is stopped ------------------------------------------------------------------

// One that takes about 0.3 s to prepare: 980,000 triangles.
static struct bd_scene *create_large_scene(uint8_t id)
{
    struct world builder = {.scene = bd_scene_create()};
    const double corners[4][3] = {{-1, 0, 1}, {1, 0, 1}, {1, 0, -1}, {-1, 0, -1}};
    world_add_quad(&builder, world_add_material(&builder, 0.5f), corners, 700);
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_scene_finish(builder.scene, &detail), BD_ERR_OK);
    builder.scene->content_sha256[0] = id;
    return builder.scene;
}

struct taker {
    struct bd_reference_runner *runner;
    struct bd_scene *scene;
    atomic_uint asked;
    atomic_bool stop;
    enum bd_err err;
    bool reused;
};

static enum bd_err taker_should_stop(void *user)
{
    struct taker *taker = user;
    atomic_fetch_add(&taker->asked, 1);
    return atomic_load(&taker->stop) ? BD_ERR_CANCELLED : BD_ERR_OK;
}

static void *run_taker(void *user)
{
    struct taker *taker = user;
    const struct bd_reference *reference;
    struct bd_err_detail detail = {0};
    taker->err = bd_reference_runner_take(taker->runner, taker->scene, taker_should_stop, taker,
                                          &reference, &taker->reused, &detail);
    bd_reference_runner_give_back(taker->runner, &reference);
    return NULL;
}

// Asked so often, it is in the middle of building.
static void wait_until_it_builds(struct taker *taker)
{
    for (int ms = 0; atomic_load(&taker->asked) < 20; ms++) {
        assert_true(ms < 20000);
        sleep_ms(1);
    }
}

static void a_build_that_is_stopped_leaves_nothing(void **state)
{
    struct taker taker = {.runner = *state, .scene = create_large_scene(1)};
    pthread_t thread;
    assert_int_equal(pthread_create(&thread, NULL, run_taker, &taker), 0);
    wait_until_it_builds(&taker);
    atomic_store(&taker.stop, true);
    pthread_join(thread, NULL);
    assert_int_equal(taker.err, BD_ERR_CANCELLED);
    assert_int_equal(stats_of(*state).reference_count, 0);
    assert_int_equal(stats_of(*state).memory_bytes, 0);
    assert_int_equal(stats_of(*state).built_count, 0);
    assert_int_equal(taker.scene->reference_count, 1);
    assert_false(touch(*state, taker.scene));
    bd_scene_release(&taker.scene);
}

// It does not take with it those that wait for the same snapshot.
static void who_waits_for_a_stopped_build_builds_anew(void **state)
{
    struct taker first = {.runner = *state, .scene = create_large_scene(1)}, second = first;
    pthread_t threads[2];
    assert_int_equal(pthread_create(&threads[0], NULL, run_taker, &first), 0);
    wait_until_it_builds(&first);
    assert_int_equal(pthread_create(&threads[1], NULL, run_taker, &second), 0);
    while (atomic_load(&second.asked) < 1) sleep_ms(1);
    atomic_store(&first.stop, true);
    for (int i = 0; i < 2; i++) pthread_join(threads[i], NULL);
    assert_int_equal(first.err, BD_ERR_CANCELLED);
    assert_int_equal(second.err, BD_ERR_OK);
    assert_false(second.reused);
    assert_int_equal(stats_of(*state).built_count, 1);
    bd_scene_release(&first.scene);
}

// --- loops ----------------------------------------------------------------------------------

struct loop {
    struct bd_reference_runner *runner;
    struct bd_runner_caller caller;
    uint32_t count;
    long item_ms;
    atomic_uint *seen;
    atomic_uint done;
    atomic_bool stop;
    enum bd_err err;
    uint64_t first_ns, last_ns; // of items
};

static void loop_item(void *user, uint32_t i)
{
    struct loop *loop = user;
    if (atomic_fetch_add(&loop->done, 1) == 0) loop->first_ns = bd_clock_ns();
    atomic_fetch_add(&loop->seen[i], 1);
    if (loop->item_ms) sleep_ms(loop->item_ms);
}

static enum bd_err loop_should_stop(void *user)
{
    struct loop *loop = user;
    return atomic_load(&loop->stop) ? BD_ERR_CANCELLED : BD_ERR_OK;
}

static void *run_loop(void *user)
{
    struct loop *loop = user;
    loop->err = bd_reference_runner_loop(loop->runner, &loop->caller, loop->count, loop_item,
                                         loop_should_stop, loop);
    loop->last_ns = bd_clock_ns();
    return NULL;
}

static struct loop loop_of(struct bd_reference_runner *runner, uint32_t count, long item_ms)
{
    struct loop loop = {.runner = runner, .count = count, .item_ms = item_ms};
    loop.seen = calloc(count, sizeof *loop.seen);
    assert_non_null(loop.seen);
    return loop;
}

static void every_item_once(void **state)
{
    const uint32_t counts[] = {1, 63, 64, 65, 100000};
    for (size_t c = 0; c < sizeof counts / sizeof counts[0]; c++) {
        struct loop loop = loop_of(*state, counts[c], 0);
        run_loop(&loop);
        assert_int_equal(loop.err, BD_ERR_OK);
        for (uint32_t i = 0; i < loop.count; i++) assert_int_equal(loop.seen[i], 1);
        free(loop.seen);
    }
    assert_int_equal(stats_of(*state).thread_count, 2);
}

static void a_loop_of_nothing_ends(void **state)
{
    struct loop loop = loop_of(*state, 1, 0);
    loop.count = 0;
    run_loop(&loop);
    assert_int_equal(loop.err, BD_ERR_OK);
    assert_int_equal(loop.done, 0);
    free(loop.seen);
}

static bool say(void *of)
{
    return *(const bool *)of;
}

// Late at each turn, but not for ever; and it stops where it is told to meanwhile.
static void what_is_urgent_elsewhere_goes_first(void **state)
{
    bool is_urgent = false;
    double ms[2];
    for (int i = 0; i < 2; i++) {
        struct loop loop = loop_of(*state, 8, 1);
        is_urgent = i == 1;
        loop.caller = (struct bd_runner_caller){BD_RUNNER_ASKED, say, &is_urgent};
        const uint64_t start_ns = bd_clock_ns();
        run_loop(&loop);
        ms[i] = bd_ms_since(start_ns);
        assert_int_equal(loop.err, BD_ERR_OK);
        assert_int_equal(loop.done, 8);
        free(loop.seen);
    }
    print_message("    8 items of 1 ms: %.0f ms, beside what is urgent %.0f ms\n", ms[0], ms[1]);
    assert_true(ms[1] >= 200 && ms[0] < PATIENCE * 150);
    struct loop stopped = loop_of(*state, 8, 1);
    stopped.caller = (struct bd_runner_caller){BD_RUNNER_ASKED, say, &is_urgent};
    atomic_store(&stopped.stop, true);
    run_loop(&stopped);
    assert_int_equal(stopped.err, BD_ERR_CANCELLED);
    assert_int_equal(stopped.done, 0);
    free(stopped.seen);
}

// What judges frames, in the middle of an item of a second, is nothing that a reference waits for.
static void lanes_do_not_wait_for_each_other(void **state)
{
    struct loop judging = loop_of(*state, 2, 1000), asked = loop_of(*state, 2, 1);
    judging.caller.lane = BD_RUNNER_CHECK;
    pthread_t thread;
    assert_int_equal(pthread_create(&thread, NULL, run_loop, &judging), 0);
    while (atomic_load(&judging.done) < 1) sleep_ms(1);
    const uint64_t start_ns = bd_clock_ns();
    run_loop(&asked);
    const double ms = bd_ms_since(start_ns);
    pthread_join(thread, NULL);
    print_message("    beside an item of a second: %.0f ms\n", ms);
    assert_true(ms < 500);
    free(judging.seen), free(asked.seen);
}

// A short loop that comes in the middle of a long one does not wait for its end.
static void callers_take_turns(void **state)
{
    struct loop large = loop_of(*state, 100000, 1), small = loop_of(*state, 20, 1);
    pthread_t thread;
    assert_int_equal(pthread_create(&thread, NULL, run_loop, &large), 0);
    sleep_ms(200);
    uint64_t start_ns = bd_clock_ns();
    run_loop(&small);
    double small_ms = bd_ms_since(start_ns);
    uint32_t before = atomic_load(&large.done);
    sleep_ms(100);
    uint32_t after = atomic_load(&large.done);
    atomic_store(&large.stop, true);
    start_ns = bd_clock_ns();
    pthread_join(thread, NULL);
    double stop_ms = bd_ms_since(start_ns);
    print_message("    20 items of 1 ms: %.0f ms; stopped after %.0f ms\n", small_ms, stop_ms);
    assert_int_equal(small.err, BD_ERR_OK);
    assert_int_equal(large.err, BD_ERR_CANCELLED);
    assert_int_equal(small.done, 20);
    assert_true(after > before); // and the long one went on
    assert_true(before > 20 && after < large.count);
    assert_true(small_ms < PATIENCE * 500);
    assert_true(stop_ms < PATIENCE * 200);
    free(large.seen);
    free(small.seen);
}

// Also one that waits for its turn.
static void a_waiting_caller_can_stop(void **state)
{
    struct loop large = loop_of(*state, 100000, 1), small = loop_of(*state, 20, 1);
    pthread_t threads[2];
    assert_int_equal(pthread_create(&threads[0], NULL, run_loop, &large), 0);
    sleep_ms(100);
    atomic_store(&small.stop, true);
    uint64_t start_ns = bd_clock_ns();
    assert_int_equal(pthread_create(&threads[1], NULL, run_loop, &small), 0);
    pthread_join(threads[1], NULL);
    assert_true(bd_ms_since(start_ns) < PATIENCE * 300);
    assert_int_equal(small.err, BD_ERR_CANCELLED);
    assert_int_equal(small.done, 0);
    atomic_store(&large.stop, true);
    pthread_join(threads[0], NULL);
    free(large.seen);
    free(small.seen);
}

static int open_runner(void **state)
{
    *state = bd_reference_runner_create(2);
    return 0;
}

static int close_runner(void **state)
{
    bd_reference_runner_destroy((struct bd_reference_runner **)state);
    return *state != NULL;
}

#define WITH_RUNNER(test) cmocka_unit_test_setup_teardown(test, open_runner, close_runner)

int main(void)
{
    const struct CMUnitTest tests[] = {
        WITH_RUNNER(nothing_is_started_before_it_is_needed),
        WITH_RUNNER(a_snapshot_is_prepared_once),
        WITH_RUNNER(only_the_last_used_ones_stay),
        WITH_RUNNER(light_that_moves_builds_nothing),
        WITH_RUNNER(what_is_in_use_stays),
        WITH_RUNNER(a_build_that_is_stopped_leaves_nothing),
        WITH_RUNNER(who_waits_for_a_stopped_build_builds_anew),
        WITH_RUNNER(every_item_once),
        WITH_RUNNER(a_loop_of_nothing_ends),
        WITH_RUNNER(what_is_urgent_elsewhere_goes_first),
        WITH_RUNNER(lanes_do_not_wait_for_each_other),
        WITH_RUNNER(callers_take_turns),
        WITH_RUNNER(a_waiting_caller_can_stop),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
