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
    struct bd_err_detail detail = {0};
    bd_cli_frame_finish(&options.frame);
    if (bd_cli_parse_render(words, count, &options, &detail)) fail_msg("%s", detail.message);
    return &options;
}

static void defaults_depend_on_the_output(void **state)
{
    (void)state;
    const struct bd_cli_render *o = parsed(WORDS("a.glb", "-o", "x.png"));
    assert_string_equal(o->scene, "a.glb");
    assert_int_equal(o->format, BD_CLI_PNG);
    assert_int_equal(o->frame->aa, 16);
    assert_int_equal(o->frame->n_size, 0);
    assert_null(o->frame->technique);
    o = parsed(WORDS("-o", "dir.d/x.JPeG", "a.glb"));
    assert_int_equal(o->format, BD_CLI_JPEG);
    assert_int_equal(o->frame->aa, 16);
    o = parsed(WORDS("a.glb", "-ox.exr"));
    assert_int_equal(o->format, BD_CLI_EXR);
    assert_int_equal(o->frame->aa, 1);
    o = parsed(WORDS("a.glb", "-o", "-"));
    assert_int_equal(o->format, BD_CLI_PNG);
    o = parsed(WORDS("a.glb", "--json"));
    assert_int_equal(o->format, BD_CLI_NONE);
    assert_int_equal(o->frame->aa, 1);
}

static void every_option_arrives(void **state)
{
    (void)state;
    const struct bd_cli_render *o = parsed(
        WORDS("--size=640x480", "--camera", "Cam 2", "--technique", "direct", "--set", "vpls=256",
              "--set=brdf=lambert", "--aa", "4", "--layers", "direct,normal", "--exposure=-1.5",
              "--tonemap", "agx", "--seed", "18446744073709551615", "--deadline-ms", "1500",
              "--check", "300", "--target-error", "2.5:full", "--budget-ms", "700", "--report",
              "r.json", "--jpeg-quality", "80", "--exr_half", "--pose", "1,2,3,0,0,-1e1,0,0,1,.5",
              "--region", "1,2,3,4", "--fresh", "camera", "--json", "--quiet", "--server",
              "tcp:h:1", "--token-file", "t", "-o", "x.exr", "--", "-odd.glb"));
    assert_string_equal(o->scene, "-odd.glb");
    const Bounced__FrameRequest *f = o->frame;
    assert_true(f->n_size == 2 && f->size[0] == 640 && f->size[1] == 480);
    assert_string_equal(f->camera, "Cam 2");
    assert_string_equal(f->technique, "direct");
    assert_int_equal(f->n_parameters, 2);
    assert_string_equal(f->parameters[1]->key, "brdf");
    assert_string_equal(f->parameters[1]->value, "lambert");
    assert_int_equal(f->aa, 4);
    assert_int_equal(f->n_layers, 2);
    assert_string_equal(f->layers[0], "direct");
    assert_string_equal(f->layers[1], "normal");
    assert_string_equal(f->exposure, "-1.5");
    assert_string_equal(f->tonemap, "agx");
    assert_string_equal(f->encoding, "exr");
    assert_true(f->seed == UINT64_MAX);
    assert_int_equal(f->deadline_ms, 1500);
    assert_int_equal(f->check, 300);
    assert_int_equal(f->budget_ms, 700);
    assert_true(f->target_error == 2.5);
    assert_string_equal(f->against, "full");
    assert_string_equal(f->fresh, "camera");
    assert_int_equal(f->jpeg_quality, 80);
    assert_true(f->exr_half && !f->has_plan_only);
    assert_true(f->n_region == 4 && f->region[3] == 4);
    assert_true(f->pose->n_up == 3 && f->pose->target[2] == -10 && f->pose->yfov == 0.5);
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
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_cli_parse_render(words, count, &options, &detail), BD_ERR_USAGE);
    bd_cli_frame_finish(&options.frame);
    if (strcmp(detail.field, field) != 0 || !strstr(detail.message, says))
        fail_msg("field %s, message %s; wanted %s and %s", detail.field, detail.message, field,
                 says);
}

static void refusals_name_the_option_and_its_range(void **state)
{
    (void)state;
    static const char *const sizes[] = {"640",           "x1",   "1x", "-1x1", "1x1x1", "1e3x1",
                                        "99999999999x1", " 1x1", ""};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++)
        assert_refused(WORDS("a.glb", "-o", "x.png", "--size", sizes[i]), "size", "WxH");
    static const char *const counts[] = {"0", "4097", "-1", "four", "", "4.0", " 4", "4 ", "0x4"};
    for (size_t i = 0; i < sizeof counts / sizeof counts[0]; i++)
        assert_refused(WORDS("a.glb", "-o", "x.png", "--aa", counts[i]), "aa", "from 1 to 4096");
    assert_refused(WORDS("a.glb", "-o", "x.png", "--seed", "18446744073709551616"), "seed",
                   "a whole number");
    assert_refused(WORDS("a.glb", "-o", "x.png", "--deadline-ms", "4294967296"), "deadline_ms",
                   "a whole number");
    static const char *const poses[] = {"0,0,1,0,0,0,1,1", "0,0,1,0,0", "0,0,1,0,0,x", "",
                                        "0 0 1 0 0 0"};
    for (size_t i = 0; i < sizeof poses / sizeof poses[0]; i++)
        assert_refused(WORDS("a.glb", "-o", "x.png", "--pose", poses[i]), "pose", "EYE,TARGET");
    assert_refused(WORDS("a.glb", "-o", "x.png", "--jpeg-quality", "101"), "jpeg_quality",
                   "from 1 to 100");
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
    assert_refused(WORDS("a.glb", "-o", "x.png", "--set", "vpls"), "parameters", "KEY=VALUE");
    assert_refused(WORDS("a.glb", "-o", "x.png", "--set", "=1"), "parameters", "KEY=VALUE");
    assert_refused(WORDS("a.glb", "-o", "x.exr", "--layers", "direct,,normal"), "layers", "A,B,C");
    static const char *const targets[] = {"0", "-1", "nan", "inf", "20000", "", "3x", ":full"};
    for (size_t i = 0; i < sizeof targets / sizeof targets[0]; i++)
        assert_refused(WORDS("a.glb", "-o", "x.png", "--target-error", targets[i]), "target_error",
                       "1e-06 to 10000");
    assert_refused(WORDS("a.glb", "-o", "x.png", "--target-error", "3:half"), "against",
                   "full or model");
    assert_refused(WORDS("a.glb", "-o", "x.png", "--check", "15"), "check", "from 16 to 65536");
    assert_refused(WORDS("a.glb", "-o", "x.png", "--check", "64:truth"), "against",
                   "full or model");
    assert_refused(WORDS("a.glb", "-o", "x.png", "--check", "64:full", "--target-error", "3:model"),
                   "target_error", "one thing");
}

static void combinations_that_make_no_sense(void **state)
{
    (void)state;
    assert_refused(WORDS("-o", "x.png"), "scene", "no SCENE");
    assert_refused(WORDS("a.glb", "b.glb", "-o", "x.png"), "scene", "b.glb");
    assert_refused(WORDS("a.glb"), "output", "-o FILE");
    assert_refused(WORDS("a.glb", "-o", "x.tiff"), "output", ".png");
    assert_refused(WORDS("a.glb", "-o", "dir.png/x"), "output", ".png");
    assert_refused(WORDS("a.glb", "-o", "x.png", "--plan"), "plan_only", "nothing to write");
    assert_refused(WORDS("a.glb", "-o", "-", "--json"), "json", "standard output");
    assert_refused(WORDS("a.glb", "-o", "x.png", "--layers", "direct,normal"), "layers",
                   "hold one layer");
    assert_refused(WORDS("a.glb", "-o", "x.png", "--server", "unix:/x", "--device", "egl:0"),
                   "device", "--server");
    assert_refused(WORDS("a.glb", "-o", "x.png", "--sise", "1x1"), "sise",
                   "no option --sise; did you mean \"size\"?");
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

static void plain_commands_count_their_operands(void **state)
{
    (void)state;
    struct bd_cli_common common;
    struct bd_err_detail detail;
    const char *operands[2];
    int operand_count;
    bool help;
    assert_int_equal(bd_cli_parse_plain(WORDS("rm", "--json", "abc"), &common, operands, 2,
                                        &operand_count, &help, &detail),
                     BD_ERR_OK);
    assert_int_equal(operand_count, 2);
    assert_string_equal(operands[1], "abc");
    assert_true(common.json && !help);
    assert_int_equal(bd_cli_parse_plain(WORDS("a", "b", "c"), &common, operands, 2, &operand_count,
                                        &help, &detail),
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
        cmocka_unit_test(plain_commands_count_their_operands),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
