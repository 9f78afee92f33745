// The table of a frame's options: that rows and schema agree, and what each takes and refuses.

#include "protocol/frame_options.h"

#include <stdlib.h>
#include <string.h>

#include "cmocka_all.h"

static Bounced__FrameRequest *new_request(void)
{
    Bounced__FrameRequest *request = calloc(1, sizeof *request);
    assert_non_null(request);
    bounced__frame_request__init(request);
    return request;
}

static void every_field_has_a_row_and_every_row_a_field(void **state)
{
    (void)state;
    const ProtobufCMessageDescriptor *schema = &bounced__frame_request__descriptor;
    assert_int_equal(schema->n_fields, bd_frame_option_count);
    for (unsigned i = 0; i < schema->n_fields; i++) {
        const struct bd_frame_option *option = bd_frame_option_named(schema->fields[i].name, NULL);
        assert_non_null(option);
        assert_string_equal(option->name, schema->fields[i].name);
        assert_int_equal(bd_frame_option_is_flag(option),
                         schema->fields[i].type == PROTOBUF_C_TYPE_BOOL);
        assert_true(strlen(option->help) > 5);
    }
}

static void names_are_as_on_a_command_line(void **state)
{
    (void)state;
    struct bd_err_detail detail = {0};
    assert_string_equal(bd_frame_option_named("deadline-ms", &detail)->name, "deadline_ms");
    assert_string_equal(bd_frame_option_named("set", &detail)->name, "parameters");
    assert_string_equal(bd_frame_option_named("plan", &detail)->name, "plan_only");
    static const char *const wrong[] = {"",      "-",         "siz",  "sizes",
                                        "size ", "deadline_", "Size", "aa=1"};
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++)
        assert_null(bd_frame_option_named(wrong[i], &detail));
    assert_null(bd_frame_option_named("expsure", &detail));
    assert_non_null(strstr(detail.message, "did you mean \"exposure\"?"));
}

// What is refused says what would be taken, and leaves no value behind that is not allowed.
static void values(void **state)
{
    (void)state;
    static const struct {
        const char *name, *good[4], *bad[12], *takes;
    } cases[] = {
        {"aa",
         {"1", "64", "4096"},
         {"0", "4097", "-1", "four", "", "4.0", " 4", "4 ", "0x4", "4294967300"},
         "a whole number from 1 to 4096"},
        {"size",
         {"1x1", "0x7", "4294967295x1"},
         {"", "x", "1x", "x1", "1x1x1", "-1x1", "1e3x1", "4294967296x1"},
         "WxH"},
        {"region",
         {"0,0,1,1"},
         {"", "1,2,3", "1,2,3,4,5", "a,0,1,1", "1,,2,3"},
         "X,Y,WIDTH,HEIGHT"},
        {"seed",
         {"0", "18446744073709551615"},
         {"18446744073709551616", "-1", ""},
         "a whole number"},
        {"exposure",
         {"auto", "-1.5", "100", "0"},
         {"101", "-100.1", "nan", "inf", "1 ", " 1", ""},
         "auto, or stops from -100 to 100"},
        {"tonemap", {"neutral", "AgX", "linear"}, {"filmic", "", "agx "}, "neutral, agx or linear"},
        {"check",
         {"0", "16", "65536:model", "64:full"},
         {"15", "65537", "64:", "1e2"},
         "a whole number from 16 to 65536, or 0"},
        {"target_error",
         {"2.5", "1e-6", "10000"},
         {"0", "-1", "nan", "inf", "20000", "", "3x", ":full"},
         "a number from 1e-06 to 10000"},
        {"exr_half", {"0", "1"}, {"", "2", "yes", "01"}, "0 or 1"},
        {"parameters", {"a=", "a=b=c"}, {"", "a", "=1"}, "KEY=VALUE"},
        {"layers", {"a", "a,b"}, {"", ",", "a,", ",a", "a,,b"}, "A,B,C"},
        {"pose",
         {"0,0,1,0,0,0", "0,0,1,0,0,0,1", "0,0,1,0,0,0,0,1,0", "0,0,1,0,0,0,0,1,0,1e-1"},
         {"", "0,0,1,0,0", "0,0,1,0,0,0,0,1", "0,0,1,0,0,x", "0,0,1,0,0,0,",
          "0,0,1,0,0,0,0,1,0,1,1", "0 0 1 0 0 0"},
         "EYE,TARGET[,UP][,YFOV]"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const struct bd_frame_option *option = bd_frame_option_named(cases[i].name, NULL);
        struct bd_err_detail detail;
        for (int k = 0; k < 4 && cases[i].good[k]; k++) {
            Bounced__FrameRequest *request = new_request();
            if (bd_frame_option_set(option, cases[i].good[k], request, &detail))
                fail_msg("%s", detail.message);
            assert_int_equal(bd_frame_options_check(request, &detail), BD_ERR_OK);
            bounced__frame_request__free_unpacked(request, NULL);
        }
        for (int k = 0; k < 12 && cases[i].bad[k]; k++) {
            Bounced__FrameRequest *request = new_request();
            if (bd_frame_option_set(option, cases[i].bad[k], request, &detail) != BD_ERR_USAGE)
                fail_msg("%s=%s was taken", cases[i].name, cases[i].bad[k]);
            if (!strchr(cases[i].bad[k], ':') && !strstr(detail.message, cases[i].takes))
                fail_msg("%s; wanted %s", detail.message, cases[i].takes);
            bounced__frame_request__free_unpacked(request, NULL);
        }
    }
}

// As a message that was sent holds them.
static void checks_name_the_field_and_its_range(void **state)
{
    (void)state;
    struct bd_err_detail detail;
    Bounced__FrameRequest *request = new_request();
    assert_int_equal(bd_frame_options_check(request, &detail), BD_ERR_OK);
    request->has_aa = 1;
    request->aa = 4097;
    assert_int_equal(bd_frame_options_check(request, &detail), BD_ERR_USAGE);
    assert_string_equal(detail.field, "aa");
    assert_string_equal(detail.message, "aa is a whole number from 1 to 4096, not \"4097\"");
    request->aa = 64;
    request->fresh = (char *)"never";
    assert_int_equal(bd_frame_options_check(request, &detail), BD_ERR_USAGE);
    assert_string_equal(detail.message, "fresh is none, camera or all, not \"never\"");
    free(request);
}

static void both_errors_are_against_one_thing(void **state)
{
    (void)state;
    struct bd_err_detail detail;
    Bounced__FrameRequest *request = new_request();
    const struct bd_frame_option *check = bd_frame_option_named("check", NULL);
    const struct bd_frame_option *target = bd_frame_option_named("target_error", NULL);
    assert_int_equal(bd_frame_option_set(check, "64:model", request, &detail), BD_ERR_OK);
    assert_string_equal(request->against, "model");
    assert_int_equal(bd_frame_option_set(target, "3", request, &detail), BD_ERR_OK);
    assert_string_equal(request->against, "model");
    assert_int_equal(bd_frame_option_set(target, "3:full", request, &detail), BD_ERR_USAGE);
    assert_non_null(strstr(detail.message, "one thing"));
    assert_int_equal(bd_frame_option_set(target, "3:half", request, &detail), BD_ERR_USAGE);
    assert_string_equal(detail.field, "against");
    bounced__frame_request__free_unpacked(request, NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_field_has_a_row_and_every_row_a_field),
        cmocka_unit_test(names_are_as_on_a_command_line),
        cmocka_unit_test(values),
        cmocka_unit_test(checks_name_the_field_and_its_range),
        cmocka_unit_test(both_errors_are_against_one_thing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
