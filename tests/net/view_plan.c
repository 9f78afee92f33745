// What a view does next, state by state, and that its rules hold whatever happens.

#include "net/live/view_plan.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "net/live/view_steps.h"

#include "../protocol/cmocka_all.h"

#define MS 1000000u

static struct bd_view_state opened(void)
{
    return (struct bd_view_state){.refine = true,
                                  .credits = 2,
                                  .credit_max = 2,
                                  .has_room = true,
                                  .wanted = 1,
                                  .last_step = BD_VIEW_STEP_NONE};
}

static struct bd_view_state shown(uint32_t step)
{
    struct bd_view_state state = opened();
    state.shown = 1;
    state.shown_step = step;
    state.begun_ns = 100 * MS;
    return state;
}

static struct bd_view_state running(uint32_t step)
{
    struct bd_view_state state = opened();
    state.is_running = true;
    state.running = 1;
    state.running_step = step;
    state.begun_ns = 100 * MS;
    state.usual_ns = 100 * MS;
    return state;
}

static void assert_begins(const struct bd_view_state *state, uint64_t now_ns, uint32_t step)
{
    struct bd_view_decision decision = bd_view_decide(state, now_ns);
    assert_int_equal(decision.next, BD_VIEW_BEGIN);
    assert_int_equal(decision.step, step);
}

static void assert_next(const struct bd_view_state *state, uint64_t now_ns, enum bd_view_next next)
{
    assert_int_equal(bd_view_decide(state, now_ns).next, next);
}

static void a_frame_needs_a_credit_and_room(void **cmocka)
{
    (void)cmocka;
    struct bd_view_state state = opened();
    assert_begins(&state, 0, 0);
    state.credits = 0;
    assert_next(&state, 0, BD_VIEW_REST);
    state = opened();
    state.has_room = false;
    assert_next(&state, 0, BD_VIEW_REST);
}

static void what_is_still_is_improved_until_it_is_final(void **cmocka)
{
    (void)cmocka;
    const uint64_t now_ns = 100 * MS;
    struct bd_view_state state = shown(0);
    assert_begins(&state, now_ns, 1);
    state.shown_step = 7;
    assert_begins(&state, now_ns, 8);
    state.is_final = true;
    assert_next(&state, now_ns, BD_VIEW_REST);
    state.wanted = 2; // a change: from the first step again
    assert_begins(&state, now_ns, 0);
    state = shown(3);
    state.last_step = 3; // the fourth took too long: the third once more, as the last
    assert_begins(&state, now_ns, 3);
}

static void the_rate_is_kept(void **cmocka)
{
    (void)cmocka;
    struct bd_view_state state = shown(0);
    state.interval_ns = 50 * MS;
    struct bd_view_decision decision = bd_view_decide(&state, 120 * MS);
    assert_int_equal(decision.next, BD_VIEW_WAIT);
    assert_int_equal(decision.until_ns, 150 * MS);
    assert_begins(&state, 150 * MS, 1);
    state.retry_ns = 200 * MS;
    assert_int_equal(bd_view_decide(&state, 150 * MS).until_ns, 200 * MS);
}

static void a_frame_is_stopped_only_early_and_never_twice(void **cmocka)
{
    (void)cmocka;
    struct bd_view_state state = running(0);
    assert_next(&state, 110 * MS, BD_VIEW_REST); // nothing has changed
    state.wanted = 2;
    assert_next(&state, 110 * MS, BD_VIEW_STOP);
    assert_next(&state, 150 * MS, BD_VIEW_REST); // half is done
    state.stopped_one = true;
    assert_next(&state, 110 * MS, BD_VIEW_REST);
    state.stopped_one = false;
    state.is_stopping = true;
    assert_next(&state, 110 * MS, BD_VIEW_REST);
    state = running(0);
    state.wanted = 2;
    state.usual_ns = 0; // nothing is known of how long it takes
    assert_next(&state, 100 * MS, BD_VIEW_REST);
    state = running(2); // a better picture of what is no longer so
    state.wanted = 2;
    state.stopped_one = true;
    assert_next(&state, 900 * MS, BD_VIEW_STOP);
    state.has_rendered = true; // it is being encoded, and will be sent
    assert_next(&state, 900 * MS, BD_VIEW_REST);
}

static void final_is_the_last_of_its_state(void **cmocka)
{
    (void)cmocka;
    struct bd_view_state state = running(1);
    assert_int_equal(bd_view_why_final(&state, true, false, MS, 100 * MS), BD_VIEW_NOT_FINAL);
    assert_int_equal(bd_view_why_final(&state, true, false, 100 * MS, 100 * MS), BD_VIEW_NOT_FINAL);
    assert_int_equal(bd_view_why_final(&state, false, false, MS, 100 * MS), BD_VIEW_TOP);
    assert_int_equal(bd_view_why_final(&state, true, false, 101 * MS, 100 * MS), BD_VIEW_TIME);
    assert_int_equal(bd_view_why_final(&state, true, true, MS, 100 * MS), BD_VIEW_SETTLED);
    state.last_step = 1;
    assert_int_equal(bd_view_why_final(&state, true, false, MS, 100 * MS), BD_VIEW_DEADLINE);
    state.refine = false;
    state.last_step = BD_VIEW_STEP_NONE;
    assert_int_equal(bd_view_why_final(&state, true, false, MS, 100 * MS), BD_VIEW_UNREFINED);
    state.wanted = 2; // another follows, whatever this was
    assert_int_equal(bd_view_why_final(&state, false, false, MS, 100 * MS), BD_VIEW_NOT_FINAL);
}

// --- what a step would cost -----------------------------------------------------------------

static void add_pass(struct bd_report *report, const char *name, double ms, uint32_t sub_frames)
{
    snprintf(report->passes[report->pass_count].name, sizeof report->passes[0].name, "%s", name);
    report->passes[report->pass_count].ms = ms;
    report->passes[report->pass_count].sub_frames = sub_frames;
    report->passes[report->pass_count].of_each_sub_frame =
        sub_frames > 0 && strcmp(name, "gather") != 0 && strcmp(name, "splat") != 0;
    report->passes[report->pass_count++].state = ms > 0 ? BD_PASS_RAN : BD_PASS_REUSED;
}

static void cost_is_what_passes_took(void **cmocka)
{
    (void)cmocka;
    struct bd_view_cost cost = {0};
    struct bd_report first = {.aa = 1, .time_ms = {.total = 60000, .compile = 50000}};
    add_pass(&first, "gbuffer", 10, 1);
    add_pass(&first, "shadow_map", 30, 0);
    add_pass(&first, "direct", 20, 1);
    add_pass(&first, "gather", 100, 1);
    bd_view_cost_learn(&cost, &first, true);
    assert_true(bd_view_cost_of_sub_frames(&cost, 1, 3) == 60);
    assert_true(bd_view_cost_of_rung(&cost, 1) == 6 * 130 + 30);
    struct bd_report more = {.aa = 4};
    add_pass(&more, "gbuffer", 30, 3);
    add_pass(&more, "shadow_map", 0, 0);
    add_pass(&more, "direct", 60, 3);
    add_pass(&more, "share", 15, 3);
    add_pass(&more, "gather", 3, 3);
    bd_view_cost_learn(&cost, &more, false);
    assert_true(bd_view_cost_of_sub_frames(&cost, 4, 8) == 140);
    assert_true(bd_view_cost_of_rung(&cost, 16) == 6 * 130 + 16 * 35);
    // Each 64 have light of their own.
    assert_true(bd_view_cost_of_sub_frames(&cost, 32, 64) == 32 * 35);
    assert_true(bd_view_cost_of_sub_frames(&cost, 64, 128) == 64 * 35 + 130);
    assert_true(bd_view_cost_of_sub_frames(&cost, 128, 256) == 128 * 35 + 2 * 130);
    // What shares nothing gathers for each.
    struct bd_report own = {.aa = 4};
    add_pass(&own, "gbuffer", 40, 4);
    add_pass(&own, "splat", 400, 4);
    bd_view_cost_learn(&cost, &own, false);
    assert_true(bd_view_cost_of_sub_frames(&cost, 4, 5) == 110);
    // Nothing ran: what was known holds.
    struct bd_report reused = {.aa = 2};
    add_pass(&reused, "gbuffer", 0, 0);
    add_pass(&reused, "gather", 0, 0);
    bd_view_cost_learn(&cost, &reused, true);
    assert_true(bd_view_cost_of_rung(&cost, 0) == 6 * 130);
}

static const char *rays_of(const struct bd_frame_request *request)
{
    for (uint32_t i = 0; i < request->params.count; i++)
        if (strcmp(request->params.pairs[i].key, "rays") == 0)
            return request->params.pairs[i].value;
    return "as they are";
}

static void auto_begins_with_less(void **cmocka)
{
    (void)cmocka;
    struct bd_frame_request request = bd_frame_request_default, step;
    static const struct {
        uint32_t sub_frames;
        const char *rays;
    } steps[] = {{1, "2"},           {1, "as they are"},  {2, "as they are"}, {4, "as they are"},
                 {8, "as they are"}, {16, "as they are"}, {16, "16"},         {16, "64"},
                 {32, "64"},         {64, "64"},          {128, "64"},        {256, "64"},
                 {512, "64"},        {1024, "64"},        {2048, "64"},       {4096, "64"}};
    assert_int_equal(bd_view_steps_before(&request), 1);
    for (uint32_t i = 0; i < sizeof steps / sizeof *steps; i++) {
        step = request;
        assert_true(bd_view_has_step(&request, i));
        bd_view_lay_step(&request, i, &step);
        assert_int_equal(step.aa, steps[i].sub_frames);
        assert_string_equal(rays_of(&step), steps[i].rays);
        assert_int_equal(bd_view_step_adds_sub_frames(&request, i), (i > 1 && i < 6) || i > 7);
        assert_int_equal(bd_view_step_draws_anew(&request, i), i > 9);
    }
    assert_false(bd_view_has_step(&request, sizeof steps / sizeof *steps));
    // From between, as far as to the last rung but one step.
    static const char *const third[] = {"vpls=2048",      "rays=8",           "far_rays=8",
                                        "walk_vpls=4096", "cache_cells=4096", "photons=262144"};
    for (int i = 0; i < 6; i++)
        assert_int_equal(bd_param_list_add(&request.params, third[i], NULL), BD_ERR_OK);
    static const char *const rays[] = {"32", "128", "128", "128", "128"};
    for (uint32_t i = 0; i < 5; i++) {
        assert_true(bd_view_has_step(&request, 6 + i));
        bd_view_lay_step(&request, 6 + i, &step);
        assert_string_equal(rays_of(&step), rays[i]);
    }
    assert_false(bd_view_has_step(&request, 16));
    request.params.count = 0;
    // What is given stands as low as it goes already.
    static const char *const least[] = {"vpls=16",      "rays=2",         "far_rays=2",
                                        "walk_vpls=16", "cache_cells=16", "light_rays=2",
                                        "photons=1024"};
    for (int i = 0; i < 7; i++)
        assert_int_equal(bd_param_list_add(&request.params, least[i], NULL), BD_ERR_OK);
    assert_int_equal(bd_view_steps_before(&request), 0);
}

static void steps_add_sub_frames_and_then_climb(void **cmocka)
{
    (void)cmocka;
    struct bd_frame_request request = bd_frame_request_default, step;
    strcpy(request.technique, "many_light");
    assert_int_equal(bd_view_steps_before(&request), 0);
    static const uint32_t sub_frames[] = {1, 2, 4, 8, 16, 16, 16};
    for (uint32_t i = 0; i < sizeof sub_frames / sizeof *sub_frames; i++) {
        step = request;
        assert_true(bd_view_has_step(&request, i));
        bd_view_lay_step(&request, i, &step);
        assert_int_equal(step.aa, sub_frames[i]);
        assert_int_equal(step.params.count > 0, i > 4);
        assert_int_equal(bd_view_step_adds_sub_frames(&request, i), i > 0 && i < 5);
    }
    static const struct {
        uint32_t asked, second;
    } odd[] = {{3, 6}, {5, 10}, {9, 16}, {15, 16}, {16, 16}, {40, 40}};
    for (size_t i = 0; i < sizeof odd / sizeof *odd; i++) {
        request.aa = odd[i].asked;
        step = request;
        bd_view_lay_step(&request, 0, &step);
        assert_int_equal(step.aa, odd[i].asked);
        bd_view_lay_step(&request, 1, &step);
        assert_int_equal(step.aa, odd[i].second);
        bd_view_lay_step(&request, 40, &step);
        assert_int_equal(step.aa, 4096);
    }
    // What decides nothing by chance ends with the ladder.
    strcpy(request.technique, "rsm");
    request.aa = 1;
    step = request;
    bd_view_lay_step(&request, 40, &step);
    assert_int_equal(step.aa, 64);
    for (uint32_t i = 0; i < 40; i++) assert_false(bd_view_step_draws_anew(&request, i));
    strcpy(request.technique, "reference");
    step = request;
    bd_view_lay_step(&request, 1, &step);
    assert_int_equal(step.aa, 1);
    assert_int_equal(step.params.count, 1);
}

static void a_frame_is_made_for_when_it_will_be_taken(void **cmocka)
{
    (void)cmocka;
    struct bd_view_state state = shown(0);
    state.wanted = 2;
    state.credits = 1;
    state.usual_ns = 5 * MS;
    state.credit_ns = 110 * MS;
    state.pace_ns = 50 * MS;
    struct bd_view_decision decision = bd_view_decide(&state, 120 * MS);
    assert_int_equal(decision.next, BD_VIEW_WAIT);
    assert_int_equal(decision.until_ns, 145 * MS);
    assert_begins(&state, 145 * MS, 0);
    state.credits = 2; // it shows nothing: whatever comes, it waits for it
    assert_begins(&state, 120 * MS, 0);
    state.credits = 1;
    state.usual_ns = 25 * MS; // frames take as long as it shows them
    assert_begins(&state, 120 * MS, 0);
    state.usual_ns = 5 * MS;
    state.pace_ns = 0;
    assert_begins(&state, 120 * MS, 0);
    state.pace_ns = 50 * MS;
    state.shown = 2; // a better picture of the same is in no hurry, and nothing can overtake it
    assert_begins(&state, 120 * MS, 1);
}

static void a_client_s_pace_is_learnt_and_forgotten(void **cmocka)
{
    (void)cmocka;
    struct bd_view_state state = opened();
    bd_view_take_credits(&state, 1, 50 * MS); // which it had: no more than it began with
    assert_true(state.credits == 2 && state.credit_ns == 0 && state.pace_ns == 0);
    state.credits = 0;
    bd_view_take_credits(&state, 1, 100 * MS);
    assert_true(state.credits == 1 && state.pace_ns == 0);
    bd_view_take_credits(&state, 7, 150 * MS);
    assert_true(state.credits == 2 && state.pace_ns == 50 * MS);
    state.credits = 1;
    bd_view_take_credits(&state, 1, 180 * MS);
    assert_true(state.pace_ns == 45 * MS);
    state.credits = 1;
    bd_view_take_credits(&state, 1, 900 * MS); // it rested
    assert_true(state.pace_ns == 0);
}

// --- a view run by the rules ----------------------------------------------------------------

struct run {
    struct bd_view_state state;
    uint64_t now_ns, ends_ns;
    uint32_t firsts_begun, firsts_sent;
};

static void obey(struct run *run, uint64_t frame_ns)
{
    struct bd_view_state *s = &run->state;
    struct bd_view_decision decision = bd_view_decide(s, run->now_ns);
    if (decision.next == BD_VIEW_STOP) {
        s->is_running = false;
        s->stopped_one = s->running_step == 0;
        obey(run, frame_ns);
    } else if (decision.next == BD_VIEW_BEGIN) {
        assert_int_not_equal(s->credits, 0);
        s->is_running = true;
        s->running = s->wanted;
        s->running_step = decision.step;
        s->begun_ns = run->now_ns;
        run->ends_ns = run->now_ns + frame_ns;
        run->firsts_begun += decision.step == 0;
    }
}

static void send(struct run *run, uint32_t top)
{
    struct bd_view_state *s = &run->state;
    s->is_final = bd_view_why_final(s, s->running_step < top, false, 0, 1) != BD_VIEW_NOT_FINAL;
    s->is_running = s->stopped_one = false;
    s->shown = s->running;
    s->shown_step = s->running_step;
    if (s->running_step == 0) s->usual_ns = run->now_ns - s->begun_ns;
    s->credits--;
    run->firsts_sent += s->running_step == 0;
}

// Changes at random times, credits that come back late: at least every second frame that was begun
// for a first picture is shown, none is sent without a credit, and rest ends in a final frame.
static void whatever_happens_it_is_seen_and_ends_final(void **cmocka)
{
    (void)cmocka;
    for (unsigned round = 1; round <= 200; round++) {
        unsigned seed = round;
        struct run run = {.state = opened()};
        uint64_t frame_ns = (1 + (uint64_t)(rand_r(&seed) % 50)) * MS;
        for (int tick = 0; tick < 4000; tick++, run.now_ns += MS) {
            if (run.state.is_running && run.now_ns >= run.ends_ns) send(&run, 2);
            if (tick < 3000 && rand_r(&seed) % 10 == 0) {
                run.state.wanted++;
                run.state.is_final = false;
            }
            if (run.state.credits < 2 && rand_r(&seed) % 10 == 0)
                bd_view_take_credits(&run.state, 1, run.now_ns);
            obey(&run, frame_ns);
        }
        assert_true(run.firsts_begun <= 2 * run.firsts_sent + 2 && run.firsts_sent > 10);
        assert_true(run.state.is_final && run.state.shown == run.state.wanted);
        assert_int_equal(run.state.shown_step, 2);
    }
}

// A viewer takes a frame every 50 ms of a scene that changes every 16; frames take 5. How old what
// it shows is, at most, once its pace is known.
static uint64_t oldest_shown_ns(uint32_t credits)
{
    struct run run = {.state = opened()};
    struct bd_view_state *s = &run.state;
    uint64_t changed_ns[4000] = {0}, queue[4], oldest_ns = 0;
    uint32_t queued = 0;
    s->credits = s->credit_max = credits;
    bool is_showing = false;
    for (uint64_t ms = 1; ms < 2000; ms++) {
        run.now_ns = ms * MS;
        if (ms % 16 == 0) changed_ns[++s->wanted] = run.now_ns;
        if (s->is_running && run.now_ns >= run.ends_ns) {
            queue[queued++] = s->running;
            send(&run, 0);
        }
        if (ms % 50 == 0 && queued > 0) {
            if (is_showing) bd_view_take_credits(s, 1, run.now_ns);
            is_showing = true;
            uint64_t age_ns = run.now_ns - changed_ns[queue[0]];
            if (ms > 500 && age_ns > oldest_ns) oldest_ns = age_ns;
            for (uint32_t i = 1; i < queued; i++) queue[i - 1] = queue[i];
            queued--;
        }
        obey(&run, 5 * MS);
    }
    return oldest_ns;
}

static void what_a_slow_viewer_shows_is_new(void **cmocka)
{
    (void)cmocka;
    // 15 ms before the moment it is begun, and what it shows is up to 16 ms old then.
    assert_in_range(oldest_shown_ns(2), 15 * MS, 32 * MS);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_frame_needs_a_credit_and_room),
        cmocka_unit_test(what_is_still_is_improved_until_it_is_final),
        cmocka_unit_test(the_rate_is_kept),
        cmocka_unit_test(a_frame_is_stopped_only_early_and_never_twice),
        cmocka_unit_test(final_is_the_last_of_its_state),
        cmocka_unit_test(cost_is_what_passes_took),
        cmocka_unit_test(auto_begins_with_less),
        cmocka_unit_test(steps_add_sub_frames_and_then_climb),
        cmocka_unit_test(a_frame_is_made_for_when_it_will_be_taken),
        cmocka_unit_test(a_client_s_pace_is_learnt_and_forgotten),
        cmocka_unit_test(what_a_slow_viewer_shows_is_new),
        cmocka_unit_test(whatever_happens_it_is_seen_and_ends_final),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
