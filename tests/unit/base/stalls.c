// Stalls: buckets, and the longest of late.

#include "base/stalls.h"

#include "../../protocol/cmocka_all.h"

#define S_NS  1000000000ull
#define MS_NS 1000000ull

static void each_falls_into_its_bucket(void **state)
{
    (void)state;
    struct bd_stalls stalls = {0};
    bd_stalls_add(&stalls, S_NS, 0);
    bd_stalls_add(&stalls, S_NS, MS_NS); // an upper end belongs to its bucket
    bd_stalls_add(&stalls, S_NS, MS_NS + 1);
    bd_stalls_add(&stalls, S_NS, 60 * MS_NS);
    bd_stalls_add(&stalls, S_NS, 5 * S_NS);
    assert_int_equal(stalls.counts[0], 2);
    assert_int_equal(stalls.counts[1], 1);
    assert_int_equal(stalls.counts[6], 1);
    assert_int_equal(stalls.counts[BD_STALLS_BUCKET_COUNT], 1);
    assert_true(stalls.total_s > 5.06 && stalls.total_s < 5.07);
}

static void the_longest_is_forgotten_after_two_windows(void **state)
{
    (void)state;
    struct bd_stalls stalls = {0};
    const uint64_t window_ns = BD_STALLS_WINDOW_S * S_NS, start_ns = 7 * window_ns;
    assert_true(bd_stalls_longest_s(&stalls, start_ns) == 0);
    bd_stalls_add(&stalls, start_ns, 3 * S_NS);
    bd_stalls_add(&stalls, start_ns + 1, S_NS);
    assert_true(bd_stalls_longest_s(&stalls, start_ns) == 3);
    // With or without new ones: in the next window it is still told, in the one after not.
    assert_true(bd_stalls_longest_s(&stalls, start_ns + window_ns) == 3);
    assert_true(bd_stalls_longest_s(&stalls, start_ns + 2 * window_ns) == 0);
    bd_stalls_add(&stalls, start_ns + window_ns, 2 * S_NS);
    assert_true(bd_stalls_longest_s(&stalls, start_ns + window_ns) == 3);
    assert_true(bd_stalls_longest_s(&stalls, start_ns + 2 * window_ns) == 2);
    bd_stalls_add(&stalls, start_ns + 5 * window_ns, S_NS);
    assert_true(bd_stalls_longest_s(&stalls, start_ns + 5 * window_ns) == 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_falls_into_its_bucket),
        cmocka_unit_test(the_longest_is_forgotten_after_two_windows),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
