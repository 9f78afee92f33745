// The table of limits: names, ranges, suffixes.

#include "protocol/limits.h"

#include <string.h>

#include "cmocka_all.h"

static void every_limit_is_listed_with_its_default(void **state)
{
    (void)state;
    struct bd_limits limits = bd_limits_default;
    uint64_t value;
    uint32_t count = 0;
    int seen = 0;
    for (const char *name; (name = bd_limits_get(&limits, count, &value)); count++)
        if (strcmp(name, "message_bytes") == 0) {
            seen++;
            assert_int_equal(value, 16 * BD_MIB);
        }
    assert_int_equal(seen, 1);
    assert_int_equal(count, sizeof limits / sizeof(uint64_t));
}

static void values_are_set_with_suffixes(void **state)
{
    (void)state;
    struct bd_limits limits = bd_limits_default;
    assert_int_equal(bd_limits_set(&limits, "message_bytes=2M", NULL), BD_ERR_OK);
    assert_int_equal(limits.message_bytes, 2 * BD_MIB);
    assert_int_equal(bd_limits_set(&limits, "connections=7", NULL), BD_ERR_OK);
    assert_int_equal(limits.connections, 7);
    assert_int_equal(limits.header_bytes, bd_limits_default.header_bytes);
}

static void nonsense_is_refused_by_name(void **state)
{
    (void)state;
    static const char *const bad[] = {"message_bytes",
                                      "message_bytes=",
                                      "message_bytes=-1",
                                      "message_bytes=12X",
                                      "message_bytes=1KK",
                                      "message_bytes=0",
                                      "message_bytes=18446744073709551615G",
                                      "messagebytes=5000",
                                      "=5",
                                      "connections=99999999999999999999"};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        struct bd_limits limits = bd_limits_default;
        struct bd_err_detail detail;
        assert_int_equal(bd_limits_set(&limits, bad[i], &detail), BD_ERR_USAGE);
        assert_memory_equal(&limits, &bd_limits_default, sizeof limits);
        assert_true(detail.message[0] != 0);
    }
    struct bd_err_detail detail;
    struct bd_limits limits = bd_limits_default;
    assert_int_equal(bd_limits_set(&limits, "connections=0", &detail), BD_ERR_USAGE);
    assert_string_equal(detail.field, "connections");
    assert_non_null(strstr(detail.message, "65536"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_limit_is_listed_with_its_default),
        cmocka_unit_test(values_are_set_with_suffixes),
        cmocka_unit_test(nonsense_is_refused_by_name),
    };
    return cmocka_run_group_tests_name("limits", tests, NULL, NULL);
}
