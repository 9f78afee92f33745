// The command line of `bounce reference`, and of skies and regions elsewhere.

#include <stdio.h>
#include <string.h>

#include "clients/cli/options.h"
#include "clients/cli/source.h"
#include "tests/unit/cmocka_all.h"

#define WORDS(...)                                                                                 \
    ((const char *[]){__VA_ARGS__}),                                                               \
        (int)(sizeof((const char *[]){__VA_ARGS__}) / sizeof(const char *))

static struct bd_cli_reference parsed(const char *const *words, int count)
{
    struct bd_cli_reference options;
    struct bd_err_detail detail = {0};
    if (bd_cli_parse_reference(words, count, &options, &detail)) fail_msg("%s", detail.message);
    return options;
}

static void every_option_arrives(void **state)
{
    (void)state;
    struct bd_cli_reference o = parsed(WORDS(
        "a.glb", "-o", "x.exr", "--spp", "128", "--bounces", "inf", "--indirect-visibility", "off",
        "--lights", "punctual+emissive", "--filter", "box", "--alpha", "mask", "--clamp", "2.5",
        "--model-of", "rsm", "--set", "brdf=lambert", "--set", "senders=lambert", "--seed", "7",
        "--size", "64x32", "--camera", "Cam", "--region", "1,2,30,4", "--time-limit", "2.5",
        "--environment", "1,1,1", "--force", "--report", "r.json", "--json"));
    assert_string_equal(o.scene, "a.glb");
    assert_string_equal(o.output, "x.exr");
    assert_int_equal(o.spp, 128);
    static const char *const parameters[][2] = {{"bounces", "inf"},
                                                {"indirect_visibility", "off"},
                                                {"lights", "punctual+emissive"},
                                                {"filter", "box"},
                                                {"alpha", "mask"},
                                                {"clamp", "2.5"},
                                                {"model_of", "rsm"},
                                                {"brdf", "lambert"},
                                                {"senders", "lambert"}};
    const Bounced__FrameRequest *f = o.frame;
    assert_int_equal(f->n_parameters, sizeof parameters / sizeof parameters[0]);
    for (size_t i = 0; i < f->n_parameters; i++) {
        assert_string_equal(f->parameters[i]->key, parameters[i][0]);
        assert_string_equal(f->parameters[i]->value, parameters[i][1]);
    }
    assert_int_equal(f->seed, 7);
    assert_true(f->n_size == 2 && f->size[0] == 64 && f->size[1] == 32);
    assert_string_equal(f->camera, "Cam");
    const uint32_t region[4] = {1, 2, 30, 4};
    assert_memory_equal(f->region, region, sizeof region);
    assert_true(o.time_limit_s == 2.5 && o.force && o.common.json);
    assert_string_equal(o.environment, "1,1,1");
    assert_string_equal(o.report, "r.json");
    bd_cli_frame_finish(&o.frame);
}

static uint32_t spp_of(const char *const *words, int count)
{
    struct bd_cli_reference options = parsed(words, count);
    bd_cli_frame_finish(&options.frame);
    return options.spp;
}

static void samples_are_64_or_as_many_as_fit_a_time(void **state)
{
    (void)state;
    assert_int_equal(spp_of(WORDS("a.glb", "-o", "x.exr")), 64);
    assert_int_equal(spp_of(WORDS("a.glb", "-o", "x.exr", "--time-limit", "5")), 1 << 24);
    assert_int_equal(spp_of(WORDS("a.glb", "-o", "x.exr", "--time-limit", "5", "--spp", "4")), 4);
}

static void refusals_name_the_option(void **state)
{
    (void)state;
    static const struct {
        const char *words[5], *field;
    } cases[] = {
        {{"-o", "x.exr"}, "scene"},
        {{"a.glb"}, "output"},
        {{"a.glb", "-o", "x.png"}, "output"},
        {{"a.glb", "-o", "-"}, "output"},
        {{"a.glb", "b.glb", "-o", "x.exr"}, "scene"},
        {{"a.glb", "-ox.exr", "--spp", "5"}, "spp"},
        {{"a.glb", "-ox.exr", "--spp", "0"}, "spp"},
        {{"a.glb", "-ox.exr", "--spp", "16777218"}, "spp"},
        {{"a.glb", "-ox.exr", "--set", "spp=4"}, "parameters"},
        {{"a.glb", "-ox.exr", "--set", "first_sample=4"}, "parameters"},
        {{"a.glb", "-ox.exr", "--set", "noise_filter=on"}, "parameters"},
        {{"a.glb", "-ox.exr", "--set", "brdf"}, "parameters"},
        {{"a.glb", "-ox.exr", "--region", "1,2,3"}, "region"},
        {{"a.glb", "-ox.exr", "--region", "1,2,3,4,5"}, "region"},
        {{"a.glb", "-ox.exr", "--region", "-1,2,3,4"}, "region"},
        {{"a.glb", "-ox.exr", "--time-limit", "0"}, "time-limit"},
        {{"a.glb", "-ox.exr", "--time-limit", "nan"}, "time-limit"},
        {{"a.glb", "-ox.exr", "--size", "64"}, "size"},
        {{"a.glb", "-ox.exr", "--aa", "4"}, "aa"},
        {{"a.glb", "-ox.exr", "--technique", "rsm"}, "technique"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct bd_cli_reference options;
        struct bd_err_detail detail = {0};
        int count = 0;
        while (count < 5 && cases[i].words[count]) count++;
        if (bd_cli_parse_reference(cases[i].words, count, &options, &detail) != BD_ERR_USAGE)
            fail_msg("case %zu was taken", i);
        bd_cli_frame_finish(&options.frame);
        assert_string_equal(detail.field, cases[i].field);
    }
}

static void a_reference_is_not_supersampled(void **state)
{
    (void)state;
    static struct bd_cli_render options;
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_cli_parse_render(WORDS("a.glb", "-ox.png", "--technique", "reference"),
                                         &options, &detail),
                     BD_ERR_OK);
    assert_int_equal(options.frame->aa, 1);
    bd_cli_frame_finish(&options.frame);
}

static void skies_are_three_numbers_or_a_map(void **state)
{
    (void)state;
    static const char *const bad[] = {"",      "1",          "1,2",    "1,2,3,4", "1,-1,1", "1,x,1",
                                      "1,2,3 ", "1,2,1e39",   "nan,1,1", "1;1;1",  "sky.png"};
    struct bd_err_detail detail = {0};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        if (bd_cli_source_check("/dev/null/none", NULL, &detail) == BD_ERR_OK) fail();
        if (bd_cli_source_check("scene:x", bad[i], &detail) == BD_ERR_OK) fail();
        assert_string_equal(detail.field, "environment"); // a held scene has its own
    }
    char self[] = "/proc/self/exe"; // some regular file
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        if (bd_cli_source_check(self, bad[i], &detail) != BD_ERR_USAGE) fail_msg("%s", bad[i]);
        assert_string_equal(detail.field, "environment");
    }
    assert_int_equal(bd_cli_source_check(self, "0,0.5,1e3", &detail), BD_ERR_OK);
    assert_int_equal(bd_cli_source_check(self, "/nowhere/sky.exr", &detail), BD_ERR_IO);
    assert_int_equal(bd_cli_source_check(self, "/nowhere/sky.HDR", &detail), BD_ERR_IO);
}

static void a_sky_goes_with_scene_add_alone(void **state)
{
    (void)state;
    struct bd_cli_scene options;
    struct bd_err_detail detail = {0};
    assert_int_equal(
        bd_cli_parse_scene(WORDS("add", "a.glb", "--environment", "1,1,1"), &options, &detail),
        BD_ERR_OK);
    assert_string_equal(options.environment, "1,1,1");
    assert_string_equal(options.operands[1], "a.glb");
    assert_int_equal(
        bd_cli_parse_scene(WORDS("rm", "id", "--environment", "1,1,1"), &options, &detail),
        BD_ERR_USAGE);
    assert_string_equal(detail.field, "environment");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_option_arrives),
        cmocka_unit_test(samples_are_64_or_as_many_as_fit_a_time),
        cmocka_unit_test(refusals_name_the_option),
        cmocka_unit_test(a_reference_is_not_supersampled),
        cmocka_unit_test(skies_are_three_numbers_or_a_map),
        cmocka_unit_test(a_sky_goes_with_scene_add_alone),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
