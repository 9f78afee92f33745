// Who is next: by priority, owner after owner, in order of arrival.

#include "sched/queue.h"

#include "sched/job.h"

#include "../protocol/cmocka_all.h"

#define CAPACITY 512

static struct bd_job jobs[CAPACITY];
static uint32_t job_count;

static struct bd_job *push(struct bd_job_queue *queue, int priority, uint64_t turn)
{
    struct bd_job *job = &jobs[job_count++];
    job->request.priority = priority;
    job->request.turn = turn;
    assert_true(bd_job_queue_push(queue, job));
    return job;
}

static int setup(void **state)
{
    static struct bd_job_queue queue;
    job_count = 0;
    bd_job_queue_init(&queue, CAPACITY);
    *state = &queue;
    return 0;
}

static int teardown(void **state)
{
    bd_job_queue_finish(*state);
    return 0;
}

static void higher_priority_first_then_arrival(void **state)
{
    struct bd_job_queue *queue = *state;
    struct bd_job *low = push(queue, 0, 1), *first = push(queue, 10, 1);
    struct bd_job *second = push(queue, 10, 1), *high = push(queue, 20, 1);
    assert_ptr_equal(bd_job_queue_pop(queue), high);
    assert_ptr_equal(bd_job_queue_pop(queue), first);
    assert_ptr_equal(bd_job_queue_pop(queue), second);
    assert_ptr_equal(bd_job_queue_pop(queue), low);
    assert_null(bd_job_queue_pop(queue));
}

static void only_others_come_between(void **state)
{
    struct bd_job_queue *queue = *state;
    struct bd_job running = {.request = {.priority = 10, .turn = 1}};
    push(queue, 0, 2);
    push(queue, 10, 1);
    assert_null(bd_job_queue_pop_between(queue, &running, true));
    struct bd_job *equal = push(queue, 10, 2), *above = push(queue, 20, 1);
    assert_ptr_equal(bd_job_queue_pop_between(queue, &running, true), above);
    assert_null(bd_job_queue_pop_between(queue, &running, false));
    assert_ptr_equal(bd_job_queue_pop_between(queue, &running, true), equal);
    assert_null(bd_job_queue_pop_between(queue, &running, true));
    assert_int_equal(queue->count, 2);
}

static void owners_take_turns(void **state)
{
    struct bd_job_queue *queue = *state;
    for (int i = 0; i < 100; i++) push(queue, 10, 1);
    assert_int_equal(bd_job_queue_pop(queue)->request.turn, 1);
    push(queue, 10, 2);
    push(queue, 10, 3);
    push(queue, 10, 2);
    const uint64_t turns[] = {2, 3, 1, 2, 1, 1};
    for (size_t i = 0; i < sizeof turns / sizeof turns[0]; i++)
        assert_int_equal(bd_job_queue_pop(queue)->request.turn, turns[i]);
}

// A batch of one client, and a view's frames that come one at a time: none waits for more than the
// frame that runs, and among views none is served twice before another once.
static void a_batch_keeps_no_view_waiting(void **state)
{
    struct bd_job_queue *queue = *state;
    for (int i = 0; i < 200; i++) push(queue, 10, 9);
    for (int i = 0; i < 50; i++) {
        struct bd_job *view = push(queue, 20, 1);
        struct bd_job *other = push(queue, 20, 2);
        struct bd_job *one = bd_job_queue_pop(queue), *two = bd_job_queue_pop(queue);
        assert_true((one == view && two == other) || (one == other && two == view));
        assert_int_equal(bd_job_queue_pop(queue)->request.turn, 9);
    }
}

static void the_turn_of_the_lower_is_the_longest_waiting_ones(void **state)
{
    struct bd_job_queue *queue = *state;
    assert_null(bd_job_queue_pop_lower(queue));
    push(queue, 20, 1);
    push(queue, 20, 2);
    assert_null(bd_job_queue_pop_lower(queue)); // all are of one priority
    struct bd_job *first = push(queue, 5, 3), *second = push(queue, 10, 3);
    assert_true(bd_job_queue_has_below(queue, 6) && bd_job_queue_has_above(queue, 19));
    assert_false(bd_job_queue_has_below(queue, 5) || bd_job_queue_has_above(queue, 20));
    assert_ptr_equal(bd_job_queue_pop_lower(queue), first);
    assert_ptr_equal(bd_job_queue_pop_lower(queue), second);
    assert_null(bd_job_queue_pop_lower(queue));
}

static void full_is_full_but_for_what_comes_back(void **state)
{
    struct bd_job_queue *queue = *state;
    struct bd_job extra = {.request = {.turn = 4}};
    for (int i = 0; i < CAPACITY; i++) push(queue, 10, (uint64_t)i);
    assert_false(bd_job_queue_push(queue, &extra));
    bd_job_queue_return(queue, &extra);
    for (int i = 0; i < CAPACITY + 1; i++) assert_non_null(bd_job_queue_pop(queue));
    assert_null(bd_job_queue_pop(queue));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(higher_priority_first_then_arrival, setup, teardown),
        cmocka_unit_test_setup_teardown(only_others_come_between, setup, teardown),
        cmocka_unit_test_setup_teardown(owners_take_turns, setup, teardown),
        cmocka_unit_test_setup_teardown(a_batch_keeps_no_view_waiting, setup, teardown),
        cmocka_unit_test_setup_teardown(the_turn_of_the_lower_is_the_longest_waiting_ones, setup,
                                        teardown),
        cmocka_unit_test_setup_teardown(full_is_full_but_for_what_comes_back, setup, teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
