// The pool: every item once, stops when told, runs again.

#include <stdatomic.h>
#include <string.h>

#include "base/pool.h"
#include "tests/unit/cmocka_all.h"

#define ITEM_COUNT 5000

struct loop {
    _Atomic uint32_t seen[ITEM_COUNT];
    uint32_t asked, stop_after;
};

static void count_item(void *user, uint32_t i)
{
    struct loop *loop = user;
    atomic_fetch_add(&loop->seen[i], 1);
}

static enum bd_err stop(void *user)
{
    struct loop *loop = user;
    return ++loop->asked > loop->stop_after ? BD_ERR_CANCELLED : BD_ERR_OK;
}

static uint32_t total(struct loop *loop)
{
    uint32_t sum = 0;
    for (uint32_t i = 0; i < ITEM_COUNT; i++) {
        assert_in_range(loop->seen[i], 0, 1);
        sum += loop->seen[i];
    }
    return sum;
}

static void every_item_once(void **state)
{
    (void)state;
    for (uint32_t threads = 1; threads <= 5; threads++) {
        struct bd_pool *pool = bd_pool_create(threads);
        assert_int_equal(bd_pool_thread_count(pool), threads);
        for (uint32_t round = 0; round < 20; round++) {
            static struct loop loop;
            memset(&loop, 0, sizeof loop);
            uint32_t count = round % 2 ? ITEM_COUNT : round / 2;
            assert_int_equal(bd_pool_run(pool, count, count_item, NULL, &loop), BD_ERR_OK);
            assert_int_equal(total(&loop), count);
        }
        bd_pool_destroy(&pool);
        assert_null(pool);
    }
}

static void stops_when_told(void **state)
{
    (void)state;
    struct bd_pool *pool = bd_pool_create(3);
    static struct loop loop;
    loop.stop_after = 0;
    assert_int_equal(bd_pool_run(pool, ITEM_COUNT, count_item, stop, &loop), BD_ERR_CANCELLED);
    (void)total(&loop);
    bd_pool_destroy(&pool);
    struct bd_pool *alone = bd_pool_create(1);
    memset(&loop, 0, sizeof loop);
    loop.stop_after = 7;
    assert_int_equal(bd_pool_run(alone, ITEM_COUNT, count_item, stop, &loop), BD_ERR_CANCELLED);
    assert_int_equal(total(&loop), 7);
    bd_pool_destroy(&alone);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_item_once),
        cmocka_unit_test(stops_when_told),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
