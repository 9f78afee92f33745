// The runner of steps: what is looked at between two steps, whichever executors they run on.

#include "net/loop/steps.h"

#include <stdlib.h>
#include <string.h>

#include "net/loop/loop.h"
#include "tests/unit/cmocka_all.h"

#define TRACE_MAX 32

// Work of the test's own.
struct bd_upkeep {
    struct bd_steps steps; // first
    char trace[TRACE_MAX]; // a letter for each step that ran
    uint32_t ended, rounds;
    bool is_past_cancel;
    char told[TRACE_MAX];
};

struct world {
    struct bd_serving serving;
    struct bd_loop loop;
    struct bd_upkeep work;
};

static void trace(struct bd_upkeep *work, char letter)
{
    const size_t used = strlen(work->trace);
    assert_true(used + 1 < sizeof work->trace);
    work->trace[used] = letter;
}

static enum bd_err a(struct bd_upkeep *work)
{
    trace(work, 'a');
    return BD_ERR_OK;
}

static enum bd_err b(struct bd_upkeep *work)
{
    trace(work, 'b');
    return BD_ERR_OK;
}

static enum bd_err run_out_of_disk(struct bd_upkeep *work)
{
    trace(work, 'f');
    return bd_err_set(&work->steps.detail, BD_ERR_IO, "disk", "no space left");
}

// Says no more than that.
static enum bd_err fail_silently(struct bd_upkeep *work)
{
    bd_err_set(&work->steps.detail, BD_ERR_BUSY, "name", "of something else");
    return BD_ERR_IO;
}

static enum bd_err cancel(struct bd_upkeep *work)
{
    trace(work, 'c');
    bd_steps_cancel(&work->steps);
    return BD_ERR_OK;
}

static enum bd_err drain(struct bd_upkeep *work)
{
    trace(work, 'd');
    work->steps.loop->draining = true;
    return BD_ERR_OK;
}

static enum bd_err repeat_twice(struct bd_upkeep *work)
{
    trace(work, 'r');
    if (work->rounds++ < 2) bd_steps_branch(&work->steps, work->steps.step);
    return BD_ERR_OK;
}

static enum bd_err finish(struct bd_upkeep *work)
{
    trace(work, 'x');
    bd_steps_finish(&work->steps);
    return BD_ERR_OK;
}

static enum bd_err wait_once(struct bd_upkeep *work)
{
    trace(work, 'w');
    work->steps.waits = work->rounds++ == 0;
    return BD_ERR_OK;
}

#define STEP(where, function)                                                                      \
    {                                                                                              \
        .on = &bd_on_##where, .run.upkeep = function                                               \
    }

static enum bd_err run_step(struct bd_steps *steps)
{
    return steps->step->run.upkeep((struct bd_upkeep *)steps);
}

static void end(struct bd_steps *steps)
{
    ((struct bd_upkeep *)steps)->ended++;
}

static void tell(struct bd_steps *steps, const char *stage)
{
    strcat(((struct bd_upkeep *)steps)->told, stage);
}

static bool is_past_cancel(const struct bd_steps *steps)
{
    return ((const struct bd_upkeep *)steps)->is_past_cancel;
}

static const struct bd_steps_kind kind = {
    .run = run_step, .end = end, .tell = tell, .is_past_cancel = is_past_cancel};
static const struct bd_steps_kind upkeep_kind = {
    .run = run_step, .end = end, .stops_with_daemon = true};

// --- a loop ---------------------------------------------------------------------------------

static int open_world(void **state)
{
    struct world *world = calloc(1, sizeof *world);
    assert_non_null(world);
    world->serving.limits.imports_at_once = 1;
    world->loop.serving = &world->serving;
    assert_int_equal(uv_loop_init(&world->loop.uv), 0);
    bd_background_begin(&world->loop);
    world->work.steps = (struct bd_steps){.kind = &kind, .loop = &world->loop};
    *state = world;
    return 0;
}

static int close_world(void **state)
{
    struct world *world = *state;
    bd_background_close(&world->loop);
    uv_run(&world->loop.uv, UV_RUN_DEFAULT);
    bd_background_finish(&world->loop);
    assert_int_equal(uv_loop_close(&world->loop.uv), 0);
    free(world);
    return 0;
}

static void run(struct world *world, const struct bd_step *list)
{
    bd_steps_begin(&world->work.steps, list);
    while (!world->work.ended) uv_run(&world->loop.uv, UV_RUN_ONCE);
    assert_int_equal(world->work.ended, 1);
}

// --- what is looked at ------------------------------------------------------------------------

static void steps_run_in_order_wherever_they_run(void **state)
{
    struct world *world = *state;
    const struct bd_step list[] = {
        STEP(loop, a), STEP(pool, b), STEP(background, a), STEP(loop, b), {0}};
    run(world, list);
    assert_string_equal(world->work.trace, "abab");
    assert_int_equal(world->work.steps.detail.err, BD_ERR_OK);
}

static void nothing_runs_behind_a_failure(void **state)
{
    struct world *world = *state;
    const struct bd_step list[] = {STEP(loop, a), STEP(pool, run_out_of_disk), STEP(loop, b), {0}};
    run(world, list);
    assert_string_equal(world->work.trace, "af");
    assert_int_equal(world->work.steps.detail.err, BD_ERR_IO);
    assert_string_equal(world->work.steps.detail.message, "no space left");
}

static void a_failure_has_its_own_words(void **state)
{
    struct world *world = *state;
    const struct bd_step list[] = {STEP(pool, fail_silently), {0}};
    run(world, list);
    assert_int_equal(world->work.steps.detail.err, BD_ERR_IO);
    assert_null(strstr(world->work.steps.detail.message, "of something else"));
}

static void a_cancel_ends_it_before_the_next_step(void **state)
{
    struct world *world = *state;
    const struct bd_step list[] = {STEP(loop, cancel), STEP(loop, b), {0}};
    run(world, list);
    assert_string_equal(world->work.trace, "c");
    assert_int_equal(world->work.steps.detail.err, BD_ERR_CANCELLED);
}

static void a_cancel_that_comes_too_late_ends_nothing(void **state)
{
    struct world *world = *state;
    const struct bd_step list[] = {STEP(loop, cancel), STEP(loop, b), {0}};
    world->work.is_past_cancel = true;
    run(world, list);
    assert_string_equal(world->work.trace, "cb");
    assert_int_equal(world->work.steps.detail.err, BD_ERR_OK);
}

// The lane is full: what has not begun is dropped at once.
static void what_waits_for_the_background_is_dropped(void **state)
{
    struct world *world = *state;
    struct bd_upkeep first = {.steps = {.kind = &kind, .loop = &world->loop}};
    const struct bd_step list[] = {STEP(background, a), {0}};
    bd_steps_begin(&first.steps, list);
    bd_steps_begin(&world->work.steps, list);
    assert_int_equal(world->work.ended, 0);
    bd_steps_cancel(&world->work.steps);
    assert_int_equal(world->work.ended, 1);
    assert_string_equal(world->work.trace, "");
    while (!first.ended) uv_run(&world->loop.uv, UV_RUN_ONCE);
    assert_string_equal(first.trace, "a");
}

static void only_some_kinds_stop_with_the_daemon(void **state)
{
    struct world *world = *state;
    const struct bd_step list[] = {STEP(loop, drain), STEP(loop, b), {0}};
    run(world, list);
    assert_string_equal(world->work.trace, "db");
    world->work = (struct bd_upkeep){.steps = {.kind = &upkeep_kind, .loop = &world->loop}};
    run(world, list);
    assert_string_equal(world->work.trace, "");
    world->loop.draining = false;
    world->work = (struct bd_upkeep){.steps = {.kind = &upkeep_kind, .loop = &world->loop}};
    run(world, list);
    assert_string_equal(world->work.trace, "d");
    assert_int_equal(world->work.steps.detail.err, BD_ERR_CANCELLED);
}

static void steps_branch_repeat_and_finish(void **state)
{
    struct world *world = *state;
    const struct bd_step list[] = {
        STEP(loop, repeat_twice), STEP(pool, finish), STEP(loop, b), {0}};
    run(world, list);
    assert_string_equal(world->work.trace, "rrrx");
}

static void what_waits_is_begun_again(void **state)
{
    struct world *world = *state;
    const struct bd_step list[] = {STEP(loop, wait_once), STEP(loop, b), {0}};
    bd_steps_begin(&world->work.steps, list);
    assert_string_equal(world->work.trace, "w");
    assert_int_equal(world->work.ended, 0);
    bd_steps_go_on(&world->work.steps);
    assert_string_equal(world->work.trace, "wwb");
    assert_int_equal(world->work.ended, 1);
}

static void a_stage_is_told_once(void **state)
{
    struct world *world = *state;
    const struct bd_step list[] = {
        {.on = &bd_on_loop, .run.upkeep = a, .stage = "one "},
        {.on = &bd_on_background, .run.upkeep = b, .stage = "two "},
        {.on = &bd_on_pool, .run.upkeep = b, .stage = "three "},
        {0},
    };
    run(world, list);
    assert_string_equal(world->work.told, "one two three ");
}

int main(void)
{
#define WITH_WORLD(test) cmocka_unit_test_setup_teardown(test, open_world, close_world)
    const struct CMUnitTest tests[] = {
        WITH_WORLD(steps_run_in_order_wherever_they_run),
        WITH_WORLD(nothing_runs_behind_a_failure),
        WITH_WORLD(a_failure_has_its_own_words),
        WITH_WORLD(a_cancel_ends_it_before_the_next_step),
        WITH_WORLD(a_cancel_that_comes_too_late_ends_nothing),
        WITH_WORLD(what_waits_for_the_background_is_dropped),
        WITH_WORLD(only_some_kinds_stop_with_the_daemon),
        WITH_WORLD(steps_branch_repeat_and_finish),
        WITH_WORLD(what_waits_is_begun_again),
        WITH_WORLD(a_stage_is_told_once),
    };
    return cmocka_run_group_tests_name("steps", tests, NULL, NULL);
}
