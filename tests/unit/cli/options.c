// The command line: what is understood, and that each refusal names the option and its range.

#include <stdio.h>
#include <string.h>

#include "base/flags.h"
#include "clients/cli/args.h"
#include "clients/cli/options.h"
#include "tests/unit/cmocka_all.h"

#define WORDS(...)                                                                                 \
    ((const char *[]){__VA_ARGS__}),                                                               \
        (int)(sizeof((const char *[]){__VA_ARGS__}) / sizeof(const char *))

// Options hold pointers into themselves, so there is one set of them, filled anew each time.
static const struct bd_cli_render *parsed(const char *const *words, int count)
{
    static struct bd_cli_render options;
    struct bd_fault fault = {0};
    if (bd_cli_parse_render(words, count, &options, &fault)) fail_msg("%s", fault.message);
    return &options;
}

static void defaults_depend_on_the_output(void **state)
{
    (void)state;
    const struct bd_cli_render *o = parsed(WORDS("a.glb", "-o", "x.png"));
    assert_string_equal(o->scene, "a.glb");
    assert_int_equal(o->format, BD_CLI_PNG);
    assert_int_equal(o->aa, 16);
    assert_int_equal(o->width_px, 0);
    assert_null(o->technique);
    o = parsed(WORDS("-o", "dir.d/x.JPeG", "a.glb"));
    assert_int_equal(o->format, BD_CLI_JPEG);
    assert_int_equal(o->aa, 16);
    o = parsed(WORDS("a.glb", "-ox.exr"));
    assert_int_equal(o->format, BD_CLI_EXR);
    assert_int_equal(o->aa, 1);
    o = parsed(WORDS("a.glb", "-o", "-"));
    assert_int_equal(o->format, BD_CLI_PNG);
    o = parsed(WORDS("a.glb", "--json"));
    assert_int_equal(o->format, BD_CLI_NONE);
    assert_int_equal(o->aa, 1);
}

static void every_option_arrives(void **state)
{
    (void)state;
    const struct bd_cli_render *o = parsed(
        WORDS("--size=640x480", "--camera", "Cam 2", "--technique", "direct", "--set", "vpls=256",
              "--set=brdf=lambert", "--aa", "4", "--layers", "direct,normal", "--exposure=-1.5",
              "--tonemap", "agx", "--seed", "18446744073709551615", "--deadline-ms", "1500",
              "--check", "300", "--target-error", "2.5:full", "--budget-ms", "700", "--report",
              "r.json", "--fresh", "camera", "--json", "--quiet", "--server", "tcp:h:1",
              "--token-file", "t", "-o", "x.exr", "--", "-odd.glb"));
    assert_string_equal(o->scene, "-odd.glb");
    assert_int_equal(o->width_px, 640);
    assert_int_equal(o->height_px, 480);
    assert_string_equal(o->camera, "Cam 2");
    assert_string_equal(o->technique, "direct");
    assert_int_equal(o->set_count, 2);
    assert_string_equal(o->sets[1], "brdf=lambert");
    assert_int_equal(o->aa, 4);
    assert_int_equal(o->layer_count, 2);
    assert_string_equal(o->layers[0], "direct");
    assert_string_equal(o->layers[1], "normal");
    assert_string_equal(o->exposure, "-1.5");
    assert_string_equal(o->tonemap, "agx");
    assert_true(o->seed == UINT64_MAX);
    assert_int_equal(o->deadline_ms, 1500);
    assert_int_equal(o->check, 300);
    assert_int_equal(o->budget_ms, 700);
    assert_true(o->target_error == 2.5);
    assert_string_equal(o->against, "full");
    assert_string_equal(o->fresh, "camera");
    assert_string_equal(o->report, "r.json");
    assert_true(o->common.json && o->common.quiet);
    assert_string_equal(o->common.server, "tcp:h:1");
    assert_string_equal(o->common.token_file, "t");
}

static void flags_that_fail(void **state)
{
    (void)state;
    const uint64_t blank = UINT64_C(1) << BD_FLAG_blank_frame;
    const uint64_t tail = UINT64_C(1) << BD_FLAG_error_tail;
    const uint64_t walls = UINT64_C(1) << BD_FLAG_no_indirect_visibility;
    const struct bd_cli_render *o = parsed(WORDS("a.glb", "-o", "x.png"));
    assert_true(o->fail_on == blank && !o->strict);
    o = parsed(WORDS("a.glb", "-o", "x.png", "--fail-on", "error_tail", "--strict", "--fail-on",
                     "no_indirect_visibility,error_tail"));
    assert_true(o->fail_on == (blank | tail | walls) && o->strict);
    o = parsed(WORDS("a.glb", "-o", "x.png", "--fail-on", "none"));
    assert_true(o->fail_on == 0);
    o = parsed(WORDS("a.glb", "-o", "x.png", "--fail-on=none,error_tail"));
    assert_true(o->fail_on == tail);
}

// `says` must stand in the message: the range or the choice.
static void assert_refused(const char *const *words, int count, const char *field, const char *says)
{
    struct bd_cli_render options;
    struct bd_fault fault = {0};
    assert_int_equal(bd_cli_parse_render(words, count, &options, &fault), BD_ERR_USAGE);
    if (strcmp(fault.field, field) != 0 || !strstr(fault.message, says))
        fail_msg("field %s, message %s; wanted %s and %s", fault.field, fault.message, field, says);
}

static void refusals_name_the_option_and_its_range(void **state)
{
    (void)state;
    static const char *const sizes[] = {"640",   "0x1",           "1x0",   "x1",
                                        "1x",    "-1x1",          "1x1x1", "32769x1",
                                        "1e3x1", "99999999999x1", " 1x1",  ""};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++)
        assert_refused(WORDS("a.glb", "-o", "x.png", "--size", sizes[i]), "size",
                       "from 1 to 32768");
    static const char *const counts[] = {"0", "65", "-1", "four", "", "4.0", " 4", "4 ", "0x4"};
    for (size_t i = 0; i < sizeof counts / sizeof counts[0]; i++)
        assert_refused(WORDS("a.glb", "-o", "x.png", "--aa", counts[i]), "aa", "from 1 to 64");
    assert_refused(WORDS("a.glb", "-o", "x.png", "--seed", "18446744073709551616"), "seed",
                   "from 0 to 18446744073709551615");
    assert_refused(WORDS("a.glb", "-o", "x.png", "--deadline-ms", "4294967296"), "deadline-ms",
                   "from 1 to 4294967295");
    static const char *const exposures[] = {"bright", "101", "-101", "nan", "inf", "1 ", ""};
    for (size_t i = 0; i < sizeof exposures / sizeof exposures[0]; i++)
        assert_refused(WORDS("a.glb", "-o", "x.png", "--exposure", exposures[i]), "exposure",
                       "-100 to 100");
    assert_refused(WORDS("a.glb", "-o", "x.png", "--tonemap", "filmic"), "tonemap",
                   "neutral, agx or linear");
    static const char *const flags[] = {
        "",      "blank_fram",          "blank_frames", "error_tail,",
        "error", "error_tail,nonsense", "None",         "blank frame"};
    for (size_t i = 0; i < sizeof flags / sizeof flags[0]; i++)
        for (int f = 0; f < BD_FLAG_COUNT; f++) // with the whole list
            assert_refused(WORDS("a.glb", "-o", "x.png", "--fail-on", flags[i]), "fail-on",
                           bd_flag_name((enum bd_flag)f));
    assert_refused(WORDS("a.glb", "-o", "x.png", "--set", "vpls"), "set", "KEY=VALUE");
    assert_refused(WORDS("a.glb", "-o", "x.png", "--set", "=1"), "set", "KEY=VALUE");
    assert_refused(WORDS("a.glb", "-o", "x.exr", "--layers", "direct,,normal"), "layers", "commas");
    static const char *const targets[] = {"0", "-1", "nan", "inf", "20000", "", "3x", ":full"};
    for (size_t i = 0; i < sizeof targets / sizeof targets[0]; i++)
        assert_refused(WORDS("a.glb", "-o", "x.png", "--target-error", targets[i]), "target-error",
                       "1e-06 to 10000");
    assert_refused(WORDS("a.glb", "-o", "x.png", "--target-error", "3:half"), "target-error",
                   "full or model");
    assert_refused(WORDS("a.glb", "-o", "x.png", "--check", "15"), "check", "from 16 to 65536");
    assert_refused(WORDS("a.glb", "-o", "x.png", "--check", "64:truth"), "check", "full or model");
    assert_refused(WORDS("a.glb", "-o", "x.png", "--check", "64:full", "--target-error", "3:model"),
                   "target-error", "one thing");
}

static void combinations_that_make_no_sense(void **state)
{
    (void)state;
    assert_refused(WORDS("-o", "x.png"), "scene", "no SCENE");
    assert_refused(WORDS("a.glb", "b.glb", "-o", "x.png"), "scene", "b.glb");
    assert_refused(WORDS("a.glb"), "output", "-o FILE");
    assert_refused(WORDS("a.glb", "-o", "x.tiff"), "output", ".png");
    assert_refused(WORDS("a.glb", "-o", "dir.png/x"), "output", ".png");
    assert_refused(WORDS("a.glb", "-o", "x.png", "--plan"), "plan", "nothing to write");
    assert_refused(WORDS("a.glb", "-o", "-", "--json"), "json", "standard output");
    assert_refused(WORDS("a.glb", "-o", "x.png", "--layers", "direct,normal"), "layers",
                   "hold one layer");
    assert_refused(WORDS("a.glb", "-o", "x.png", "--server", "unix:/x", "--device", "egl:0"),
                   "device", "--server");
    assert_refused(WORDS("a.glb", "-o", "x.png", "--sise", "1x1"), "sise", "no option --sise");
    assert_refused(WORDS("a.glb", "-o", "x.png", "-z"), "z", "no option -z");
    assert_refused(WORDS("a.glb", "-o"), "output", "needs a value");
    assert_refused(WORDS("a.glb", "--plan=yes"), "plan", "takes no value");
}

static void help_wins_over_what_is_missing(void **state)
{
    (void)state;
    assert_true(parsed(WORDS("--help"))->help);
    assert_true(parsed(WORDS("-h", "a.glb"))->help);
}

static void too_many_sets_are_refused(void **state)
{
    (void)state;
    const char *words[2 * (BD_CLI_SET_MAX + 1) + 1];
    int count = 0;
    words[count++] = "a.glb";
    for (int i = 0; i <= BD_CLI_SET_MAX; i++) {
        words[count++] = "--set";
        words[count++] = "vpls=1";
    }
    assert_refused(words, count, "set", "at most 32");
}

static void plain_commands_count_their_operands(void **state)
{
    (void)state;
    struct bd_cli_common common;
    struct bd_fault fault;
    const char *operands[2];
    int operand_count;
    bool help;
    assert_int_equal(bd_cli_parse_plain(WORDS("rm", "--json", "abc"), &common, operands, 2,
                                        &operand_count, &help, &fault),
                     BD_ERR_OK);
    assert_int_equal(operand_count, 2);
    assert_string_equal(operands[1], "abc");
    assert_true(common.json && !help);
    assert_int_equal(bd_cli_parse_plain(WORDS("a", "b", "c"), &common, operands, 2, &operand_count,
                                        &help, &fault),
                     BD_ERR_USAGE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(defaults_depend_on_the_output),
        cmocka_unit_test(every_option_arrives),
        cmocka_unit_test(flags_that_fail),
        cmocka_unit_test(refusals_name_the_option_and_its_range),
        cmocka_unit_test(combinations_that_make_no_sense),
        cmocka_unit_test(help_wins_over_what_is_missing),
        cmocka_unit_test(too_many_sets_are_refused),
        cmocka_unit_test(plain_commands_count_their_operands),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
