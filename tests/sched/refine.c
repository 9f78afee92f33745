// What is decided after a frame, checked or not, and how ladders are climbed: no device, no
// tracing.

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "frame/ladder.h"
#include "sched/improve.h"
#include "sched/refine.h"
#include "tests/unit/cmocka_all.h"

#define TARGET 0.02

static struct bd_refinement begin(void)
{
    struct bd_refinement refinement;
    bd_refine_init(&refinement, TARGET, 256);
    return refinement;
}

static struct bd_check_result found(double value, double high, uint32_t pixel_count)
{
    return (struct bd_check_result){.value = value, .high = high, .pixel_count = pixel_count};
}

static enum bd_refine_next decide(struct bd_refinement *refinement, double value, double high,
                                  bool has_next_rung)
{
    bool better;
    const struct bd_check_result result = found(value, high, refinement->pixel_count);
    return bd_refine_decide(refinement, &result, has_next_rung, &better);
}

static void the_upper_end_decides(void **state)
{
    (void)state;
    struct bd_refinement refinement = begin();
    assert_int_equal(decide(&refinement, 0.05, 0.06, true), BD_REFINE_CLIMB);
    assert_int_equal(decide(&refinement, 0.015, 0.0199, true), BD_REFINE_REACHED);
}

static void a_wide_interval_is_looked_at_more_closely(void **state)
{
    (void)state;
    struct bd_refinement refinement = begin();
    assert_int_equal(decide(&refinement, 0.019, 0.023, true), BD_REFINE_LOOK);
    assert_int_equal(refinement.pixel_count, 512);
    assert_int_equal(decide(&refinement, 0.03, INFINITY, true), BD_REFINE_LOOK);
    assert_int_equal(refinement.pixel_count, 1024);
    // There is a bound to it, and a picture has only so many pixels.
    while (refinement.pixel_count < 8192)
        assert_int_equal(decide(&refinement, 0.019, 0.023, true), BD_REFINE_LOOK);
    assert_int_equal(decide(&refinement, 0.019, 0.023, true), BD_REFINE_CLIMB);
    refinement = begin();
    bool better;
    const struct bd_check_result whole = found(0.019, 0.023, 100);
    assert_int_equal(bd_refine_decide(&refinement, &whole, true, &better), BD_REFINE_CLIMB);
}

static void three_that_lower_nothing_are_the_floor(void **state)
{
    (void)state;
    struct bd_refinement refinement = begin();
    assert_int_equal(decide(&refinement, 0.2, 0.22, true), BD_REFINE_CLIMB);
    assert_int_equal(decide(&refinement, 0.2, 0.22, true), BD_REFINE_CLIMB);
    assert_int_equal(decide(&refinement, 0.3, 0.33, true), BD_REFINE_CLIMB);
    // One that does begins the count anew.
    assert_int_equal(decide(&refinement, 0.18, 0.2, true), BD_REFINE_CLIMB);
    assert_int_equal(decide(&refinement, 0.18, 0.2, true), BD_REFINE_CLIMB);
    assert_int_equal(decide(&refinement, 0.18, 0.199, true), BD_REFINE_CLIMB); // half a per cent
    assert_int_equal(decide(&refinement, 0.18, 0.2, true), BD_REFINE_FLOOR);
}

static void the_last_rung_is_the_floor(void **state)
{
    (void)state;
    struct bd_refinement refinement = begin();
    assert_int_equal(decide(&refinement, 0.2, 0.22, false), BD_REFINE_FLOOR);
}

static void the_best_is_the_lowest_upper_end(void **state)
{
    (void)state;
    struct bd_refinement refinement = begin();
    static const struct {
        double high;
        bool better;
    } frames[] = {{INFINITY, true}, {0.3, true}, {0.4, false}, {0.25, true}, {INFINITY, false}};
    for (size_t i = 0; i < sizeof frames / sizeof frames[0]; i++) {
        bool better;
        const struct bd_check_result result = found(0.2, frames[i].high, 1);
        (void)bd_refine_decide(&refinement, &result, true, &better);
        assert_int_equal(better, frames[i].better);
    }
}

// Nothing is a part of black, however small the figure is.
static void against_black_only_no_error_is_below(void **state)
{
    (void)state;
    struct bd_refinement refinement = begin();
    struct bd_check_result result = found(1e-6, 2e-6, 256);
    bool better;
    result.black = true;
    assert_int_equal(bd_refine_decide(&refinement, &result, true, &better), BD_REFINE_CLIMB);
    assert_true(better);
    result.high = INFINITY; // no number of pixels makes it relative
    assert_int_equal(bd_refine_decide(&refinement, &result, true, &better), BD_REFINE_CLIMB);
    result.value = result.high = 0;
    assert_int_equal(bd_refine_decide(&refinement, &result, true, &better), BD_REFINE_REACHED);
}

// --- ladders --------------------------------------------------------------------------------

static const char *const two_keys[] = {"vpls=16 rsm_size=32", "vpls=64 rsm_size=64",
                                       "vpls=256 rsm_size=64", NULL};
static const struct bd_technique technique = {.name = "made_up", .ladder = two_keys};

static struct bd_param_list list_of(const char *first, const char *second)
{
    struct bd_param_list list = {0};
    if (first) assert_int_equal(bd_param_list_add(&list, first, NULL), BD_ERR_OK);
    if (second) assert_int_equal(bd_param_list_add(&list, second, NULL), BD_ERR_OK);
    return list;
}

static const char *value_of(const struct bd_param_list *list, const char *key)
{
    const char *value = "none";
    for (uint32_t i = 0; i < list->count; i++)
        if (strcmp(list->pairs[i].key, key) == 0) value = list->pairs[i].value;
    return value;
}

static void a_ladder_begins_at_its_foot(void **state)
{
    (void)state;
    struct bd_param_list given = list_of("brdf=lambert", NULL), now;
    uint32_t rung = bd_ladder_begin(&technique, &given, &now);
    assert_string_equal(value_of(&now, "vpls"), "16");
    assert_string_equal(value_of(&now, "rsm_size"), "32");
    assert_string_equal(value_of(&now, "brdf"), "lambert");
    assert_true(bd_ladder_climb(&technique, &given, &rung, &now));
    assert_string_equal(value_of(&now, "vpls"), "64");
    assert_true(bd_ladder_climb(&technique, &given, &rung, &now));
    assert_string_equal(value_of(&now, "vpls"), "256");
    assert_false(bd_ladder_climb(&technique, &given, &rung, &now));
}

static void a_ladder_begins_above_what_was_given(void **state)
{
    (void)state;
    struct bd_param_list given = list_of("vpls=100", NULL), now;
    uint32_t rung = bd_ladder_begin(&technique, &given, &now);
    assert_string_equal(value_of(&now, "vpls"), "100");
    assert_string_equal(value_of(&now, "rsm_size"), "none");
    assert_true(bd_ladder_climb(&technique, &given, &rung, &now));
    assert_string_equal(value_of(&now, "vpls"), "256");
    assert_int_equal(now.count, 2);
    assert_false(bd_ladder_climb(&technique, &given, &rung, &now));
    // Nothing is lowered to climb.
    given = list_of("vpls=16", "rsm_size=512");
    rung = bd_ladder_begin(&technique, &given, &now);
    assert_false(bd_ladder_climb(&technique, &given, &rung, &now));
}

// Thresholds: less is better.
static void a_ladder_may_fall(void **state)
{
    (void)state;
    static const char *const falling[] = {"vpls=16 threshold=1", "vpls=64 threshold=0.5",
                                          "vpls=256 threshold=0", NULL};
    static const struct bd_technique made_up = {.name = "made_up", .ladder = falling};
    struct bd_param_list given = list_of("threshold=0.7", NULL), now;
    uint32_t rung = bd_ladder_begin(&made_up, &given, &now);
    assert_true(bd_ladder_climb(&made_up, &given, &rung, &now));
    assert_string_equal(value_of(&now, "threshold"), "0.5");
    given = list_of("threshold=0", NULL);
    rung = bd_ladder_begin(&made_up, &given, &now);
    assert_false(bd_ladder_climb(&made_up, &given, &rung, &now));
}

// What is better is what comes later, whether a key's values grow, fall, or end in a word for none.
static void rungs_are_ordered_by_their_place(void **state)
{
    (void)state;
    static const char *const turning[] = {"vpls=16 threshold=0.2",   "vpls=64 threshold=0.1",
                                          "vpls=256 threshold=0.05", "vpls=1024 threshold=0.1",
                                          "vpls=4096 threshold=inf", NULL};
    static const struct bd_technique made_up = {.name = "made_up", .ladder = turning};
    static const struct {
        const char *first, *second, *next; // vpls of the rung climbed to
    } steps[] = {
        {"vpls=16", "threshold=0.2", "64"},     {"vpls=64", "threshold=0.1", "256"},
        {"vpls=256", "threshold=0.05", "1024"}, {"vpls=16", "threshold=0.15", "64"},
        {"vpls=1024", "threshold=0.1", "4096"}, {"vpls=1024", "threshold=0.07", "1024"},
        {"vpls=100000", "threshold=0.2", NULL}, {"vpls=16", "threshold=inf", "4096"},
    };
    for (size_t i = 0; i < sizeof steps / sizeof *steps; i++) {
        struct bd_param_list given = list_of(steps[i].first, steps[i].second), now;
        uint32_t rung = bd_ladder_begin(&made_up, &given, &now);
        bool climbed = bd_ladder_climb(&made_up, &given, &rung, &now);
        assert_int_equal(climbed, steps[i].next != NULL);
        if (climbed) assert_string_equal(value_of(&now, "vpls"), steps[i].next);
    }
}

static bool is_on(const struct bd_param_list *list, const struct bd_param_list *rung)
{
    for (uint32_t i = 0; i < rung->count; i++)
        if (strtod(value_of(list, rung->pairs[i].key), NULL) != strtod(rung->pairs[i].value, NULL))
            return false;
    return true;
}

// Of every technique: the defaults are a rung, and who asks for no more than those climbs to the
// next.
static void defaults_sit_on_their_own_ladder(void **state)
{
    (void)state;
    const struct bd_technique *of;
    for (uint32_t i = 0; (of = bd_technique_at(i)) != NULL; i++) {
        const struct bd_param_list none = {0};
        struct bd_params params;
        struct bd_param_list defaults, rung, next, climbed;
        assert_int_equal(bd_params_read(&none, of, &params, NULL), BD_ERR_OK);
        bd_params_write(&params, of, &defaults);
        uint32_t place = bd_ladder_begin(of, &none, &rung);
        while (!is_on(&defaults, &rung))
            if (!bd_ladder_climb(of, &none, &place, &rung))
                fail_msg("%s: the defaults are on no rung", of->name);
        uint32_t above = bd_ladder_begin(of, &defaults, &climbed);
        assert_int_equal(above, place);
        assert_true(bd_ladder_climb(of, &none, &place, &next));
        assert_true(bd_ladder_climb(of, &none, &above, &climbed));
        for (uint32_t k = 0; k < next.count; k++)
            assert_string_equal(next.pairs[k].value, value_of(&climbed, next.pairs[k].key));
        // No two rungs are the same.
        struct bd_param_list before = rung;
        for (place = bd_ladder_begin(of, &none, &before); bd_ladder_climb(of, &none, &place, &next);
             before = next)
            assert_false(is_on(&before, &next));
    }
}

static void a_key_given_twice_is_replaced(void **state)
{
    (void)state;
    struct bd_param_list given = list_of("vpls=100", "vpls=20"), now;
    uint32_t rung = bd_ladder_begin(&technique, &given, &now);
    assert_true(bd_ladder_climb(&technique, &given, &rung, &now));
    assert_string_equal(value_of(&now, "vpls"), "64");
    for (uint32_t i = 0; i < now.count; i++)
        if (strcmp(now.pairs[i].key, "vpls") == 0) assert_string_equal(now.pairs[i].value, "64");
}

// What stands below the cheapest rung already stays there; what nobody gave is the technique's own.
static void the_cheapest_is_never_dearer(void **state)
{
    (void)state;
    struct bd_param_list given = list_of("vpls=16", "brdf=lambert"), now;
    assert_true(bd_ladder_cheapest(&bd_technique_multires_gather, &given, &now));
    assert_string_equal(value_of(&now, "vpls"), "16");
    assert_string_equal(value_of(&now, "brdf"), "lambert");
    assert_string_equal(value_of(&now, "finest"), "4");
    assert_string_equal(value_of(&now, "coarsest"), "none");
    given = list_of("vpls=16", NULL);
    assert_false(bd_ladder_cheapest(&bd_technique_rsm, &given, &now));
    given = list_of("vpls=5", NULL);
    assert_false(bd_ladder_cheapest(&bd_technique_rsm, &given, &now));
    given = list_of("vpls=17", NULL);
    assert_true(bd_ladder_cheapest(&bd_technique_rsm, &given, &now));
    assert_string_equal(value_of(&now, "vpls"), "16");
    given = list_of("vpls=some", NULL);
    assert_false(bd_ladder_cheapest(&bd_technique_rsm, &given, &now));
}

// 0 leaves something out, or is the best there is.
static void what_was_left_out_stays_out(void **state)
{
    (void)state;
    struct bd_param_list given = list_of("light_rays=0", NULL), now;
    assert_int_equal(bd_ladder_above(&bd_technique_many_light, &given, 2, &now), 2);
    assert_string_equal(value_of(&now, "light_rays"), "0");
    assert_string_equal(value_of(&now, "rays"), "16");
    given = list_of("light_rays=2", NULL);
    assert_int_equal(bd_ladder_above(&bd_technique_many_light, &given, 2, &now), 2);
    assert_string_equal(value_of(&now, "light_rays"), "16");
    // As many as there are.
    assert_int_equal(bd_ladder_above(&bd_technique_many_light, &given, 99, &now), 7);
    assert_string_equal(value_of(&now, "far_rays"), "256");
    assert_int_equal(bd_ladder_above(&bd_technique_many_light, &given, 0, &now), 0);
    assert_int_equal(now.count, 1);
}

// Half of the noise is three quarters of its variance less: each rung has about twice the rays.
static void an_estimate_asks_for_rungs(void **state)
{
    (void)state;
    assert_int_equal(bd_improve_rungs_for_estimate(0), 0);
    assert_int_equal(bd_improve_rungs_for_estimate(BD_IMPROVE_ESTIMATE), 0);
    assert_int_equal(bd_improve_rungs_for_estimate(NAN), 0);
    assert_int_equal(bd_improve_rungs_for_estimate(0.051), 1);
    assert_int_equal(bd_improve_rungs_for_estimate(0.1), 2);
    assert_int_equal(bd_improve_rungs_for_estimate(0.2), 4);
}

static struct bd_report cheapest_frame(void)
{
    struct bd_report report = {.pass_count = 2};
    snprintf(report.passes[0].name, sizeof report.passes[0].name, "gbuffer");
    snprintf(report.passes[1].name, sizeof report.passes[1].name, "far");
    report.passes[0].state = report.passes[1].state = BD_PASS_RAN;
    report.passes[0].ms = 40;
    report.passes[1].ms = 60;
    return report;
}

static void a_budget_is_not_overdrawn(void **state)
{
    (void)state;
    struct bd_frame_request request = bd_frame_request_default;
    struct bd_report report = cheapest_frame();
    snprintf(request.technique, sizeof request.technique, "many_light");
    assert_true(bd_ladder_cheapest(&bd_technique_many_light, &request.params, &request.params));
    // 40 ms of what is the same on every rung, 60 that nearly double with each.
    assert_int_equal(bd_improve_rungs_for_ms(&request, &report, 100, -5), 0);
    assert_int_equal(bd_improve_rungs_for_ms(&request, &report, 100, 160), 0);
    assert_int_equal(bd_improve_rungs_for_ms(&request, &report, 100, 190), 1);
    assert_int_equal(bd_improve_rungs_for_ms(&request, &report, 100, 300), 1);
    assert_int_equal(bd_improve_rungs_for_ms(&request, &report, 100, 310), 2);
    assert_int_equal(bd_improve_rungs_for_ms(&request, &report, 100, 6000), 6);
    assert_int_equal(bd_improve_rungs_for_ms(&request, &report, 100, 1e6), 7);
    assert_int_equal(bd_improve_rungs_for_ms(&request, &report, 0, 850), 0);
    // One that fitted when it was begun ends, unless it takes far longer.
    assert_true(bd_improve_patience_ms(1000, 100) == 1400);
    assert_true(bd_improve_patience_ms(1000, 1600) == 0);
    // Beyond eight rays a large picture has no blocks of four pixels any more: four times as much.
    report.width_px = 1024;
    report.height_px = 768;
    report.aa = 1;
    assert_int_equal(bd_improve_rungs_for_ms(&request, &report, 100, 800), 2);
    assert_int_equal(bd_improve_rungs_for_ms(&request, &report, 100, 2200), 3);
    report.width_px = 100;
    assert_int_equal(bd_improve_rungs_for_ms(&request, &report, 100, 800), 3);
    // Nobody knows what takes how long.
    report.passes[1].state = BD_PASS_REUSED;
    report.passes[1].ms = 0;
    assert_int_equal(bd_improve_rungs_for_ms(&request, &report, 3, 4), 0);
    assert_int_equal(bd_improve_rungs_for_ms(&request, &report, 3, 5), 1);
    assert_int_equal(bd_improve_rungs_for_ms(&request, &report, 3, 1e6), 2);
}

static void a_technique_without_ladder_stays(void **state)
{
    (void)state;
    static const struct bd_technique bare = {.name = "bare"};
    struct bd_param_list given = list_of("brdf=full", NULL), now;
    uint32_t rung = bd_ladder_begin(&bare, &given, &now);
    assert_int_equal(now.count, 1);
    assert_false(bd_ladder_climb(&bare, &given, &rung, &now));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_upper_end_decides),
        cmocka_unit_test(a_wide_interval_is_looked_at_more_closely),
        cmocka_unit_test(three_that_lower_nothing_are_the_floor),
        cmocka_unit_test(the_last_rung_is_the_floor),
        cmocka_unit_test(the_best_is_the_lowest_upper_end),
        cmocka_unit_test(against_black_only_no_error_is_below),
        cmocka_unit_test(a_ladder_begins_at_its_foot),
        cmocka_unit_test(a_ladder_begins_above_what_was_given),
        cmocka_unit_test(a_ladder_may_fall),
        cmocka_unit_test(rungs_are_ordered_by_their_place),
        cmocka_unit_test(defaults_sit_on_their_own_ladder),
        cmocka_unit_test(a_key_given_twice_is_replaced),
        cmocka_unit_test(the_cheapest_is_never_dearer),
        cmocka_unit_test(what_was_left_out_stays_out),
        cmocka_unit_test(an_estimate_asks_for_rungs),
        cmocka_unit_test(a_budget_is_not_overdrawn),
        cmocka_unit_test(a_technique_without_ladder_stays),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
