// What the memo keeps, by a budget of a few bytes: outputs that are made of one another, and those
// that are looked for by what they are.

#include <stdbool.h>

#include "frame/memo.h"
#include "tests/unit/cmocka_all.h"

static uint32_t alive; // a bit for each output

static void destroy(void *owner, void *output)
{
    (void)owner;
    alive &= ~(1u << *(int *)output);
}

static void destroy_other(void *owner, void *output)
{
    destroy(owner, output);
}

static int outputs[8] = {0, 1, 2, 3, 4, 5, 6, 7};

// In a frame of its own; its key is its number plus 100.
static void make(struct bd_memo *memo, int output, bd_memo_destroy_fn by)
{
    bd_memo_begin_frame(memo);
    alive |= 1u << output;
    bd_memo_store(memo, 100 + (uint64_t)output, &outputs[output], 10, by);
    bd_memo_end_frame(memo);
}

static bool is_there(int output)
{
    return alive >> output & 1;
}

static bool fits(const void *output, void *user)
{
    return *(const int *)output != *(const int *)user;
}

static void what_others_rest_on_is_as_young_as_they(void **unused)
{
    (void)unused;
    struct bd_memo *memo = bd_memo_create(NULL, 40);
    make(memo, 0, destroy);
    make(memo, 1, destroy);
    make(memo, 2, destroy);
    make(memo, 3, destroy);
    bd_memo_rest_on(memo, 101, 100);
    bd_memo_rest_on(memo, 102, 101); // on 0, as 1 does
    bd_memo_begin_frame(memo);
    assert_ptr_equal(bd_memo_find(memo, 102), &outputs[2]);
    bd_memo_end_frame(memo);
    make(memo, 4, destroy);
    make(memo, 5, destroy);
    assert_true(is_there(0) && is_there(2));
    assert_false(is_there(1) || is_there(3));
    bd_memo_destroy(&memo);
    assert_int_equal(alive, 0);
}

static void the_youngest_that_fits_is_found_and_kept_through_the_frame(void **unused)
{
    (void)unused;
    uint64_t key = 0;
    struct bd_memo *memo = bd_memo_create(NULL, 40);
    make(memo, 0, destroy);
    make(memo, 1, destroy);
    make(memo, 2, destroy);
    make(memo, 3, destroy_other);
    bd_memo_begin_frame(memo);
    bd_memo_find(memo, 100);
    bd_memo_end_frame(memo);
    bd_memo_begin_frame(memo);
    assert_ptr_equal(bd_memo_find_fitting(memo, destroy, fits, &outputs[7], &key), &outputs[0]);
    assert_ptr_equal(bd_memo_find_fitting(memo, destroy, fits, &outputs[0], &key), &outputs[2]);
    assert_int_equal(key, 102);
    assert_null(bd_memo_find_fitting(memo, destroy_other, fits, &outputs[3], &key));
    bd_memo_evict_unused(memo);
    assert_true(is_there(0) && is_there(2));
    assert_false(is_there(1) || is_there(3));
    bd_memo_end_frame(memo);
    bd_memo_destroy(&memo);
}

static void make_together(struct bd_memo *memo, const int *made, int count)
{
    bd_memo_begin_frame(memo);
    for (int i = 0; i < count; i++) {
        alive |= 1u << made[i];
        bd_memo_store(memo, 100 + (uint64_t)made[i], &outputs[made[i]], 10, destroy);
    }
    bd_memo_end_frame(memo);
}

static void what_the_last_frame_used_stays_up_to_a_limit(void **unused)
{
    (void)unused;
    struct bd_memo *memo = bd_memo_create(NULL, 20);
    make(memo, 0, destroy);
    bd_memo_keep_last_frame(memo, 40);
    make_together(memo, (const int[]){1, 2, 3}, 3);
    assert_true(is_there(1) && is_there(2) && is_there(3));
    assert_false(is_there(0)); // beyond the budget it is older
    bd_memo_begin_frame(memo);
    assert_non_null(bd_memo_find(memo, 101));
    bd_memo_end_frame(memo);
    assert_true(is_there(1) && !(is_there(2) && is_there(3)));
    make_together(memo, (const int[]){4, 5, 6, 7, 0}, 5);
    int left = 0;
    for (int i = 0; i < 8; i++) left += is_there(i);
    assert_int_equal(left, 4); // more than the limit did not stay
    bd_memo_destroy(&memo);
    assert_int_equal(alive, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_others_rest_on_is_as_young_as_they),
        cmocka_unit_test(the_youngest_that_fits_is_found_and_kept_through_the_frame),
        cmocka_unit_test(what_the_last_frame_used_stays_up_to_a_limit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
