// Parameters as text: read, refused by name, written back, and preset from a technique's model.

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "pass/discontinuity.h"
#include "technique/technique.h"
#include "tests/unit/cmocka_all.h"

static const struct bd_technique *const reference = &bd_technique_reference;

// `settings` with spaces between.
static enum bd_err read(const char *settings, struct bd_params *out, struct bd_err_detail *detail)
{
    struct bd_param_list list = {0};
    char copy[400];
    snprintf(copy, sizeof copy, "%s", settings);
    char *rest = NULL;
    for (char *pair = strtok_r(copy, " ", &rest); pair; pair = strtok_r(NULL, " ", &rest))
        assert_int_equal(bd_param_list_add(&list, pair, detail), BD_ERR_OK);
    *detail = (struct bd_err_detail){0};
    return bd_params_read(&list, reference, out, detail);
}

static struct bd_params good(const char *settings)
{
    struct bd_params params;
    struct bd_err_detail detail;
    if (read(settings, &params, &detail)) fail_msg("%s: %s", settings, detail.message);
    return params;
}

static void assert_written(const char *settings, const char *key, const char *expected)
{
    struct bd_params params = good(settings);
    struct bd_param_list list;
    bd_params_write(&params, reference, &list);
    for (uint32_t i = 0; i < list.count; i++)
        if (strcmp(list.pairs[i].key, key) == 0) {
            assert_string_equal(list.pairs[i].value, expected);
            return;
        }
    fail_msg("%s is not written", key);
}

static void the_defaults_are_the_whole_equation(void **state)
{
    (void)state;
    struct bd_params params = good("");
    assert_int_equal(params.spp, 64);
    assert_int_equal(params.first_sample, 0);
    assert_int_equal(params.bounces, UINT32_MAX);
    assert_int_equal(params.lights, 7);
    assert_true(params.indirect_visibility && params.alpha_coverage && params.transmission);
    assert_true(params.light_vertices && !params.senders_lambert && !params.lambert);
    assert_true(isinf(params.clamp_per_m2) && params.filter == 0 && params.model_of == 0);
}

static void what_is_read_is_written_and_read_again(void **state)
{
    (void)state;
    static const char *const pairs[][2] = {
        {"bounces", "inf"},
        {"bounces", "0"},
        {"bounces", "64"},
        {"clamp", "inf"},
        {"clamp", "0.125"},
        {"lights", "all"},
        {"lights", "emissive"},
        {"filter", "box"},
        {"lights", "punctual+environment"},
        {"alpha", "mask"},
        {"senders", "lambert"},
        {"transmission", "off"},
        {"light_vertices", "off"},
        {"indirect_visibility", "none"},
        {"spp", "16777216"},
        {"first_sample", "2"},
        {"model_of", "rsm"},
        {"model_of", "none"},
        {"brdf", "lambert"},
    };
    for (size_t i = 0; i < sizeof pairs / sizeof pairs[0]; i++) {
        char setting[80];
        snprintf(setting, sizeof setting, "%s=%s", pairs[i][0], pairs[i][1]);
        assert_written(setting, pairs[i][0], pairs[i][1]);
    }
    assert_written("lights=environment+punctual+emissive", "lights", "all");
    assert_written("indirect_visibility=off", "indirect_visibility", "none");
    assert_written("indirect_visibility=on", "indirect_visibility", "rays");
}

static void what_makes_no_sense_is_refused_by_name(void **state)
{
    (void)state;
    static const char *const bad[] = {
        "spp=0", "spp=3", "spp=-2", "spp=2.5", "spp=33554432", "spp=inf", "first_sample=1",
        "bounces=65", "bounces=-1", "bounces=1.5", "bounces=infinity", "bounces=-inf",
        "bounces=nan", "clamp=-1", "clamp=nan", "clamp=", "lights=sun", "lights=",
        "lights=punctual+", "lights=punctual,emissive", "filter=gauss", "alpha=blend",
        "indirect_visibility=1", "indirect_visibility=ism", "model_of=radiosity",
        "model_of=", "vpls=4", "samples=4",
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        struct bd_params params;
        struct bd_err_detail detail;
        if (read(bad[i], &params, &detail) != BD_ERR_USAGE) fail_msg("%s was read", bad[i]);
        assert_memory_equal(detail.field, bad[i], strlen(detail.field));
        assert_int_equal(bad[i][strlen(detail.field)], '=');
    }
}

static void a_models_limit_is_preset_and_can_be_moved(void **state)
{
    (void)state;
    struct bd_params params = good("model_of=rsm");
    assert_int_equal(params.bounces, 1);
    assert_int_equal(params.lights, BD_LIGHTS_ALL);
    assert_int_equal(params.indirect_lights, BD_LIGHTS_ALL);
    assert_true(params.senders_lambert && !params.indirect_visibility);
    assert_true(params.transmission && params.alpha_coverage);
    params = good("model_of=rsm_splat");
    assert_true(!params.transmission && !params.alpha_coverage);
    assert_int_equal(good("model_of=direct").bounces, 0);
    // In either order: what stands beside it is what differs.
    params = good("bounces=3 model_of=rsm lights=all");
    assert_int_equal(params.bounces, 3);
    assert_int_equal(params.lights, 7);
    assert_false(params.indirect_visibility);
    params = good("model_of=reference");
    assert_int_equal(params.bounces, UINT32_MAX);
    assert_true(params.alpha_coverage && !params.senders_lambert);
}

static void clients_are_told_choices_and_defaults(void **state)
{
    (void)state;
    struct bd_param_info info;
    bd_param_describe(reference, BD_PARAM_MODEL_OF, &info);
    assert_string_equal(info.standard, "none");
    assert_true(info.choice_count >= 3);
    assert_string_equal(info.choices[0], "direct");
    bd_param_describe(reference, BD_PARAM_BOUNCES, &info);
    assert_string_equal(info.standard, "inf");
    bd_param_describe(reference, BD_PARAM_LIGHTS, &info);
    assert_int_equal(info.choice_count, 4);
    assert_string_equal(info.standard, "all");
}

// A technique whose default is not the table's: where nothing is said, and as clients are told.
static void a_technique_may_have_a_default_of_its_own(void **state)
{
    (void)state;
    const struct bd_param_list empty = {0};
    struct bd_params params;
    struct bd_err_detail detail;
    struct bd_param_info info;
    const struct bd_technique *trees = &bd_technique_hisr, *grid = &bd_technique_rsm;
    assert_int_equal(bd_params_read(&empty, trees, &params, &detail), BD_ERR_OK);
    assert_int_equal(params.vpls, 65536);
    bd_param_describe(trees, BD_PARAM_VPLS, &info);
    assert_string_equal(info.standard, "65536");
    assert_int_equal(bd_params_read(&empty, grid, &params, &detail), BD_ERR_OK);
    assert_int_equal(params.vpls, 1024);
    bd_param_describe(grid, BD_PARAM_VPLS, &info);
    assert_string_equal(info.standard, "1024");
    struct bd_param_list list = {0};
    assert_int_equal(bd_param_list_add(&list, "vpls=64", &detail), BD_ERR_OK);
    assert_int_equal(bd_params_read(&list, trees, &params, &detail), BD_ERR_OK);
    assert_int_equal(params.vpls, 64);
}

// The papers' blocks come with it; what is given beside it holds.
static void paper_mode_has_the_papers_blocks(void **state)
{
    (void)state;
    const struct bd_technique *const blocks = &bd_technique_multires_gather;
    struct bd_param_list list = {0};
    struct bd_params params;
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_params_read(&list, blocks, &params, &detail), BD_ERR_OK);
    assert_int_equal(params.depth_test, BD_DEPTH_TEST_STEP);
    assert_int_equal(bd_param_list_add(&list, "finest=4", &detail), BD_ERR_OK);
    assert_int_equal(bd_param_list_add(&list, "paper_mode=1", &detail), BD_ERR_OK);
    assert_int_equal(bd_params_read(&list, blocks, &params, &detail), BD_ERR_OK);
    assert_int_equal(params.depth_test, BD_DEPTH_TEST_MINMAX);
    assert_true(params.depth_threshold == 0.05 && isinf(params.light_threshold));
    assert_int_equal(params.finest_level, 2);
    list = (struct bd_param_list){0};
    assert_int_equal(bd_param_list_add(&list, "paper_mode=1", &detail), BD_ERR_OK);
    assert_int_equal(bd_params_read(&list, &bd_technique_hisr, &params, &detail), BD_ERR_OK);
    assert_int_equal(params.vpls, 65536); // no block
}

static const struct bd_technique *chosen(const char *name, const char *pair)
{
    struct bd_param_list list = {0};
    struct bd_err_detail detail = {0};
    if (pair) assert_int_equal(bd_param_list_add(&list, pair, &detail), BD_ERR_OK);
    return bd_technique_for(name, &list, &detail);
}

// `auto` is the first it likes of those that read what was given.
static void what_is_given_chooses(void **state)
{
    (void)state;
    assert_ptr_equal(chosen("", NULL), &bd_technique_many_light);
    assert_ptr_equal(chosen("auto", NULL), bd_technique_default);
    assert_ptr_equal(chosen("auto", "vpls=64"), &bd_technique_many_light);
    assert_ptr_equal(chosen("auto", "rsm_size=64"), &bd_technique_multires_gather);
    assert_ptr_equal(chosen("auto", "tree_roots=64"), &bd_technique_hisr);
    assert_ptr_equal(chosen("auto", "spp=4"), &bd_technique_reference);
    assert_ptr_equal(chosen("auto", "spp=none"), &bd_technique_reference); // who refuses it
    assert_ptr_equal(chosen("rsm", "spp=4"), &bd_technique_rsm);
    // Nobody reads it: the default says so.
    assert_ptr_equal(chosen("", "vlps=64"), bd_technique_default);
    assert_null(chosen("automatic", NULL));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_given_chooses),
        cmocka_unit_test(the_defaults_are_the_whole_equation),
        cmocka_unit_test(what_is_read_is_written_and_read_again),
        cmocka_unit_test(what_makes_no_sense_is_refused_by_name),
        cmocka_unit_test(a_models_limit_is_preset_and_can_be_moved),
        cmocka_unit_test(clients_are_told_choices_and_defaults),
        cmocka_unit_test(a_technique_may_have_a_default_of_its_own),
        cmocka_unit_test(paper_mode_has_the_papers_blocks),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
