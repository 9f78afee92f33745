// What others wrote, in a line for people: no command to a terminal, and always UTF-8.

#include <stdio.h>
#include <stdlib.h>
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

// U+202E writes "gnp.exe" as "exe.png"; a zero-width space makes two names look the same.
static void what_turns_or_hides_goes(void **state)
{
    (void)state;
    expect("a\xe2\x80\xae"
           "b",
           "a???b");
    expect("\xe2\x81\xa6\xe2\x81\xa9\xe2\x80\x8f\xd8\x9c\xc2\xad", "?????????????");
    expect("\xe2\x80\x8b\xe2\x80\x8d\xef\xbb\xbf\xe2\x81\xa0\xe3\x85\xa4", "???????????????");
    expect("\xe2\x80\xa8\xe2\x80\xa9\xf3\xa0\x81\x81\xf3\xa0\x84\x80", "??????????????");
    // Their neighbours: a thin space, a hyphen, a dash, a prime; Arabic; an emoji with its look.
    const char *seen = "\xe2\x80\x8a\xe2\x80\x90\xe2\x80\xa7\xe2\x80\xb2 \xd8\xa7\xd9\x84 "
                       "\xe2\x9d\xa4\xef\xb8\x8f";
    expect(seen, seen);
}

static void expect_json(const char *json, const char *want)
{
    char *text = bd_text_escape_json(strdup(json));
    assert_string_equal(text, want);
    free(text);
}

static void json_says_the_same_in_escapes(void **state)
{
    (void)state;
    expect_json("{\n\t\"a\": \"K\xc3\xbc\"}", "{\n\t\"a\": \"K\xc3\xbc\"}");
    expect_json("{\"\xe2\x80\xae\":\"\x7f\xc2\x9b\xf3\xa0\x81\x81z\"}",
                "{\"\\u202e\":\"\\u007f\\u009b\\udb40\\udc41z\"}");
    assert_null(bd_text_escape_json(NULL));
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

static void an_error_is_utf8_wherever_it_was_cut(void **state)
{
    (void)state;
    char euros[3 * 500 + 1] = "";
    for (int i = 0; i < 500; i++) memcpy(euros + (size_t)i * 3, "\xe2\x82\xac", 4);
    struct bd_err_detail detail;
    bd_err_set(&detail, BD_ERR_USAGE, euros, "%.4s is %s", euros, euros);
    assert_memory_equal(detail.message, "\xe2\x82\xac? is \xe2\x82\xac", 11);
    assert_string_equal(detail.message + sizeof detail.message - 3, "\xac?");
    assert_string_equal(detail.field + sizeof detail.field - 3, "\xac?");
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(what_is_plain_stays),
                                       cmocka_unit_test(control_characters_go),
                                       cmocka_unit_test(what_turns_or_hides_goes),
                                       cmocka_unit_test(json_says_the_same_in_escapes),
                                       cmocka_unit_test(what_is_no_utf8_goes),
                                       cmocka_unit_test(an_error_is_utf8_wherever_it_was_cut)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
