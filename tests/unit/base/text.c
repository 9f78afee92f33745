// What others wrote, in a line for people: no command to a terminal, and always UTF-8.

#include <stdio.h>
#include <string.h>

#include "base/err.h"
#include "base/text.h"
#include "tests/unit/cmocka_all.h"

static void expect(const char *text, const char *want)
{
    char plain[64];
    snprintf(plain, sizeof plain, "%s", text);
    bd_text_make_plain(plain);
    assert_string_equal(plain, want);
}

static void what_is_plain_stays(void **state)
{
    (void)state;
    expect("", "");
    expect("K\xc3\xbc"
           "che \xc2\xa0\xe2\x82\xac \xf0\x9f\x92\xa1 \xed\x9f\xbf\xf4\x8f\xbf\xbf",
           "K\xc3\xbc"
           "che \xc2\xa0\xe2\x82\xac \xf0\x9f\x92\xa1 \xed\x9f\xbf\xf4\x8f\xbf\xbf");
}

static void control_characters_go(void **state)
{
    (void)state;
    expect("\x1b[2J\r\n\t\x7f", "?[2J????");
    expect("a\xc2\x9b"
           "2Jb\xc2\x80",
           "a??2Jb??");
}

static void what_is_no_utf8_goes(void **state)
{
    (void)state;
    expect("a\x80\xff", "a??");
    expect("\xc3", "?");
    expect("\xe2\x82", "??");
    expect("\xf0\x9f\x92", "???");
    expect("\xe2\x82 b", "?? b");
    expect("\xc0\xaf\xe0\x80\x80\xed\xa0\x80\xf0\x80\x80\x80\xf4\x90\x80\x80", "????????????????");
}

static void a_fault_is_utf8_wherever_it_was_cut(void **state)
{
    (void)state;
    char euros[3 * 200 + 1] = "";
    for (int i = 0; i < 200; i++) memcpy(euros + (size_t)i * 3, "\xe2\x82\xac", 4);
    struct bd_fault fault;
    bd_fault_set(&fault, BD_ERR_USAGE, euros, "%.4s for %s", euros, euros);
    assert_memory_equal(fault.message, "\xe2\x82\xac? for \xe2\x82\xac", 12);
    assert_string_equal(fault.message + sizeof fault.message - 3, "\xac?");
    assert_string_equal(fault.field + sizeof fault.field - 3, "\xac?");
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(what_is_plain_stays),
                                       cmocka_unit_test(control_characters_go),
                                       cmocka_unit_test(what_is_no_utf8_goes),
                                       cmocka_unit_test(a_fault_is_utf8_wherever_it_was_cut)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
