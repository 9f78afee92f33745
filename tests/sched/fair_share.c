// What lower priorities are owed, on a made-up clock: jobs of slices, in the order that the
// scheduler would run them in.

#include "sched/fair_share.h"

#include "../protocol/cmocka_all.h"

#define SLICE_MS 6.0

struct day {
    struct bd_fair_share share;
    double now_ms, batch_ms, view_waited_ms_max;
};

// The batch's slices, one after the other, while a view waits from `since_ms` on.
static void run_batch_until_it_gives_way(struct day *day, double since_ms)
{
    do {
        day->now_ms += SLICE_MS;
        day->batch_ms += SLICE_MS;
        bd_fair_share_note(&day->share, SLICE_MS, false, true);
    } while (bd_fair_share_keeps_lower(&day->share));
    double waited_ms = day->now_ms - since_ms;
    if (waited_ms > day->view_waited_ms_max) day->view_waited_ms_max = waited_ms;
}

// A view whose next frame is asked for as soon as one has ended, and a batch without an end.
static void a_busy_view_leaves_a_batch_a_tenth(void **state)
{
    (void)state;
    const double frames_ms[] = {2, 20, 90, 400};
    for (int i = 0; i < 4; i++) {
        struct day day = {0};
        for (int frame = 0; frame < 1000; frame++) {
            day.now_ms += frames_ms[i];
            bd_fair_share_note(&day.share, frames_ms[i], true, false);
            if (bd_fair_share_begins_lower(&day.share)) run_batch_until_it_gives_way(&day, day.now_ms);
        }
        double part = day.batch_ms / day.now_ms;
        print_message("    frames of %.0f ms: %.1f %% are the batch's, a view waits %.0f ms\n",
                      frames_ms[i], 100 * part, day.view_waited_ms_max);
        assert_true(part > 0.1 && part < 0.2);
        assert_true(day.view_waited_ms_max <= BD_SHARE_OWED_MAX_MS + SLICE_MS);
        assert_true(day.view_waited_ms_max <=
                    BD_SHARE_TURN_MS + BD_SHARE_OF_TIME * frames_ms[i] + SLICE_MS);
    }
}

// A batch that has had its time between the frames is owed nothing when the next frame comes.
static void a_batch_that_ran_is_owed_nothing(void **state)
{
    (void)state;
    struct bd_fair_share share = {0};
    for (int frame = 0; frame < 100; frame++) {
        bd_fair_share_note(&share, 40, true, false);
        for (int slice = 0; slice < 10; slice++) bd_fair_share_note(&share, SLICE_MS, false, false);
        assert_false(bd_fair_share_keeps_lower(&share));
    }
}

static void nobody_waits_nobody_is_owed(void **state)
{
    (void)state;
    struct bd_fair_share share = {0};
    bd_fair_share_note(&share, 1e9, false, false);
    assert_false(bd_fair_share_keeps_lower(&share));
    bd_fair_share_note(&share, 1e9, true, true); // between the two it is the higher one's turn
    assert_false(bd_fair_share_keeps_lower(&share));
    bd_fair_share_note(&share, 1e9, true, false);
    assert_true(share.owed_ms == BD_SHARE_OWED_MAX_MS);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_busy_view_leaves_a_batch_a_tenth),
        cmocka_unit_test(a_batch_that_ran_is_owed_nothing),
        cmocka_unit_test(nobody_waits_nobody_is_owed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
