#include "net/live/view.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/clock.h"
#include "net/live/frame_encode.h"
#include "net/live/frame_job.h"
#include "net/live/view_plan.h"
#include "net/live/view_steps.h"
#include "protocol/frame_options.h"

#define RETRY_NS      50000000u
#define DEADLINES_MAX 3 // in a row without a frame
#define FPS_MAX       1000.0

struct bd_view {
    struct bd_steps steps; // first: of the frame under way
    struct bd_live *live;
    struct bd_client *client;
    const struct bd_view_events *events;
    void *user;
    struct bd_view *previous, *next; // live->views
    bool is_closed;                  // freed once its frame came back
    char scene_id[BD_SCENE_ID_BYTES];
    struct bd_frame_options options;
    uint64_t sequence;
    struct bd_view_state state;
    uint64_t wanted_ns; // when the last change came
    uint64_t wake_ns;   // 0 = does not wait
    uint64_t replaced, number;
    uint32_t deadlines;
    struct bd_view_cost cost;

    // The frame under way.
    struct bd_frame_options running;
    uint64_t running_ns, running_sequence, revision, transient;
    struct bd_encoded encoded; // written on the pool, read on the loop
    double encode_ms;
};

static void step(struct bd_view *view);

// --- its life -------------------------------------------------------------------------------

static void free_view(struct bd_view *view)
{
    if (view->previous)
        view->previous->next = view->next;
    else
        view->live->views = view->next;
    if (view->next) view->next->previous = view->previous;
    view->live->view_count--;
    bd_client_release(&view->client);
    free(view);
}

void bd_view_close(struct bd_view **address)
{
    struct bd_view *view = *address;
    *address = NULL;
    if (!view) return;
    view->is_closed = true;
    view->client->views--;
    if (view->state.is_running)
        bd_steps_cancel(&view->steps);
    else
        free_view(view);
}

// The opener closes it, now or later.
static void end(struct bd_view *view, const struct bd_err_detail *detail)
{
    view->state.wanted = view->state.shown;
    view->state.is_final = true;
    if (view->steps.job) bd_job_cancel(view->steps.job);
    view->events->end(view->user, detail);
}

// --- a frame comes back ---------------------------------------------------------------------

static void release_frame(struct bd_view *view)
{
    bd_job_release(&view->steps.job);
    bd_bytes_finish(&view->encoded.bytes);
    view->state.is_running = view->state.is_stopping = view->state.has_rendered = false;
}

static double next_step_ms(const struct bd_view *view)
{
    const struct bd_frame_request *frame = &view->options.frame;
    const uint32_t step = view->state.running_step;
    struct bd_frame_request next = *frame;
    bd_view_lay_step(frame, step + 1, &next);
    if (bd_view_step_adds_sub_frames(frame, step + 1))
        return bd_view_cost_of_sub_frames(&view->cost, view->running.frame.aa, next.aa);
    return bd_view_cost_of_rung(&view->cost, next.aa);
}

// Of beauty, by its own estimate; 0 where nothing is decided by chance. Half a step of 8 bits.
#define SETTLED_ERROR 0.002

static bool is_settled(const struct bd_view *view, const struct bd_report *report)
{
    return bd_view_step_draws_anew(&view->options.frame, view->state.running_step + 1) &&
           (!report->has_own_estimate || report->own_estimate <= SETTLED_ERROR);
}

static void say_why(enum bd_view_why why, double next_ms, uint64_t most_s, char *out, size_t size)
{
    switch (why) {
    case BD_VIEW_NOT_FINAL:
        snprintf(out, size, "%s", "");
        break;
    case BD_VIEW_TOP:
        snprintf(out, size, "top: there is no better step");
        break;
    case BD_VIEW_SETTLED:
        snprintf(out, size, "settled: by its own estimate the error is at most %g %%",
                 100 * SETTLED_ERROR);
        break;
    case BD_VIEW_UNREFINED:
        snprintf(out, size, "refine: none is asked for");
        break;
    case BD_VIEW_DEADLINE:
        snprintf(out, size, "deadline: a better one takes longer than deadline_ms");
        break;
    case BD_VIEW_TIME:
        snprintf(out, size,
                 "time: a better one would take about %.3g s, limit view_refine_seconds is %llu",
                 1e-3 * next_ms, (unsigned long long)most_s);
        break;
    }
}

// Learns from the frame, and judges whether a better one is to follow.
static void judge(struct bd_view *view, const struct bd_report *report, struct bd_view_frame *out)
{
    const struct bd_frame_request *frame = &view->options.frame;
    const uint32_t step = view->state.running_step;
    const uint64_t most_s = view->live->loop->serving->limits.view_refine_seconds;
    bd_view_cost_learn(&view->cost, report, !bd_view_step_adds_sub_frames(frame, step));
    const double next_ms = next_step_ms(view);
    enum bd_view_why why =
        bd_view_why_final(&view->state, bd_view_has_step(frame, step + 1), is_settled(view, report),
                          (uint64_t)(1e6 * next_ms), most_s * 1000000000u);
    out->is_final = why != BD_VIEW_NOT_FINAL;
    say_why(why, next_ms, most_s, out->why_final, sizeof out->why_final);
}

static enum bd_err send_frame(struct bd_view *view)
{
    struct bd_view_state *state = &view->state;
    const struct bd_report *report = &bd_job_result(view->steps.job)->report;
    uint64_t now_ns = bd_clock_ns();
    uint64_t took_ns = now_ns - state->begun_ns;
    struct bd_view_frame frame = {.number = ++view->number,
                                  .replaced = view->replaced,
                                  .step = state->running_step,
                                  .age_ms = (double)(now_ns - view->running_ns) * 1e-6,
                                  .sequence = view->running_sequence,
                                  .revision = view->revision,
                                  .transient = view->transient,
                                  .report = report,
                                  .encode_ms = view->encode_ms,
                                  .exposure_stops = view->encoded.exposure_stops,
                                  .format = view->running.encode.format,
                                  .bytes = view->encoded.bytes};
    judge(view, report, &frame);
    if (state->running_step == 0) state->usual_ns = took_ns;
    state->shown = state->running;
    state->shown_step = state->running_step;
    state->is_final = frame.is_final;
    state->stopped_one = false;
    state->credits--;
    view->deadlines = 0;
    frame.credits = state->credits;
    view->encoded.bytes = (struct bd_bytes){0};
    view->replaced = 0;
    bd_counts_frame(&view->live->loop->counts, report);
    view->events->frame(view->user, &frame);
    bd_bytes_finish(&frame.bytes);
    return BD_ERR_OK;
}

// What it could not do. True: the view goes on.
static bool survive(struct bd_view *view, const struct bd_err_detail *detail)
{
    struct bd_view_state *state = &view->state;
    if (detail->err == BD_ERR_CANCELLED && state->is_stopping) {
        view->replaced++;
        state->stopped_one = state->running_step == 0;
        return true;
    }
    if (detail->err == BD_ERR_BUSY) {
        state->retry_ns = bd_clock_ns() + RETRY_NS;
        return true;
    }
    if (detail->err != BD_ERR_DEADLINE) return false;
    if (state->running_step > 0) {
        state->last_step = state->shown_step;
        return true;
    }
    view->replaced++;
    return ++view->deadlines < DEADLINES_MAX;
}

// --- a frame's way ----------------------------------------------------------------------------

static enum bd_err submit(struct bd_view *view)
{
    const struct bd_serving *serving = view->live->loop->serving;
    const struct bd_store_entry *entry;
    struct bd_err_detail *detail = &view->steps.detail;
    enum bd_err err = bd_store_get(serving->store, view->scene_id, &entry, detail);
    if (err) return err;
    struct bd_job_request request = {.scene = entry->scene,
                                     .frame = view->running.frame,
                                     .priority = view->state.running_step > 0 ? BD_PRIORITY_REFINE
                                                                              : BD_PRIORITY_VIEW,
                                     .turn = bd_client_turn(view->client),
                                     .done = bd_frame_job_done,
                                     .user = &view->steps};
    view->revision = entry->revision;
    view->transient = entry->transient;
    return bd_sched_submit(serving->sched, &request, &view->steps.job, detail);
}

static enum bd_err note_rendered(struct bd_view *view)
{
    view->state.has_rendered = true;
    return BD_ERR_OK;
}

static enum bd_err encode(struct bd_view *view)
{
    const struct bd_frame_encode frame = {.options = &view->running,
                                          .result = bd_job_result(view->steps.job),
                                          .revision = view->revision,
                                          .bytes_max =
                                              view->live->loop->serving->limits.reply_bytes};
    return bd_frame_encode(&frame, &view->encoded, &view->encode_ms, &view->steps.detail);
}

#define STEP(where, function)                                                                      \
    {                                                                                              \
        .on = &bd_on_##where, .run.view = function                                                 \
    }
static const struct bd_step frame_steps[] = {STEP(render, submit),
                                             STEP(loop, note_rendered),
                                             STEP(pool, encode),
                                             STEP(loop, send_frame),
                                             {0}};

static enum bd_err run_step(struct bd_steps *steps)
{
    return steps->step->run.view((struct bd_view *)steps);
}

static void frame_over(struct bd_steps *steps)
{
    struct bd_view *view = (struct bd_view *)steps;
    struct bd_err_detail why = steps->detail;
    const bool goes_on = !why.err || view->is_closed || survive(view, &why);
    release_frame(view);
    if (view->is_closed)
        free_view(view);
    else if (goes_on)
        step(view);
    else
        end(view, &why);
}

static const struct bd_steps_kind frame_kind = {.run = run_step, .end = frame_over};

// --- a frame begins -------------------------------------------------------------------------

static void begin(struct bd_view *view, uint32_t step_index)
{
    struct bd_view_state *state = &view->state;
    state->is_running = true;
    state->running = state->wanted;
    state->running_step = step_index;
    state->begun_ns = bd_clock_ns();
    view->running = view->options;
    bd_view_lay_step(&view->options.frame,
                     step_index + (state->refine ? 0 : bd_view_steps_before(&view->options.frame)),
                     &view->running.frame);
    view->running_ns = view->wanted_ns;
    view->running_sequence = view->sequence;
    view->steps.detail.err = BD_ERR_OK;
    bd_steps_begin(&view->steps, frame_steps);
}

static void stop(struct bd_view *view)
{
    view->state.is_stopping = true;
    bd_job_cancel(view->steps.job);
}

// --- time -----------------------------------------------------------------------------------

static void on_timer(uv_timer_t *timer);

static void arm(struct bd_live *live)
{
    uint64_t soonest_ns = 0;
    for (const struct bd_view *view = live->views; view; view = view->next)
        if (view->wake_ns && (!soonest_ns || view->wake_ns < soonest_ns))
            soonest_ns = view->wake_ns;
    if (!soonest_ns) return;
    uint64_t now_ns = bd_clock_ns();
    uint64_t wait_ms = soonest_ns > now_ns ? (soonest_ns - now_ns + 999999) / 1000000 : 0;
    uv_update_time(&live->loop->uv);
    uv_timer_start(&live->view_timer, on_timer, wait_ms, 0);
}

// A view's step may end it, and with it whatever its opener closes: walked anew after each.
static struct bd_view *find_due(const struct bd_live *live, uint64_t now_ns)
{
    struct bd_view *view = live->views;
    while (view && !(view->wake_ns && view->wake_ns <= now_ns)) view = view->next;
    return view;
}

static void on_timer(uv_timer_t *timer)
{
    struct bd_live *live = timer->data;
    uint64_t now_ns = bd_clock_ns();
    struct bd_view *view;
    while ((view = find_due(live, now_ns)) != NULL) {
        view->wake_ns = 0;
        step(view);
    }
    arm(live);
}

static void step(struct bd_view *view)
{
    if (view->is_closed) return;
    view->state.has_room = view->events->has_room(view->user);
    const struct bd_view_decision decision = bd_view_decide(&view->state, bd_clock_ns());
    view->wake_ns = decision.next == BD_VIEW_WAIT ? decision.until_ns : 0;
    switch (decision.next) {
    case BD_VIEW_REST:
        break;
    case BD_VIEW_WAIT:
        arm(view->live);
        break;
    case BD_VIEW_BEGIN:
        begin(view, decision.step);
        break;
    case BD_VIEW_STOP:
        stop(view);
        break;
    }
}

void bd_views_begin(struct bd_live *live)
{
    uv_timer_init(&live->loop->uv, &live->view_timer);
    live->view_timer.data = live;
}

void bd_views_finish(struct bd_live *live)
{
    uv_close((uv_handle_t *)&live->view_timer, NULL);
}

// --- what changes ---------------------------------------------------------------------------

static void change(struct bd_view *view)
{
    struct bd_view_state *state = &view->state;
    // The change before was never shown, nor is it being rendered.
    bool waits = state->shown != state->wanted;
    if (waits && !(state->is_running && state->running == state->wanted)) view->replaced++;
    state->wanted++;
    state->is_final = false;
    state->last_step = BD_VIEW_STEP_NONE;
    view->wanted_ns = bd_clock_ns();
    step(view);
}

void bd_views_scene_changed(struct bd_live *live, const char *scene_id, bool is_removed)
{
    struct bd_err_detail detail;
    bd_err_set(&detail, BD_ERR_NOT_FOUND, "scene", "the scene was removed");
    for (struct bd_view *view = live->views; view;) {
        struct bd_view *next = view->next;
        bool is_ours = !view->is_closed && strcmp(view->scene_id, scene_id) == 0;
        if (is_ours && is_removed)
            end(view, &detail);
        else if (is_ours)
            change(view);
        view = next;
    }
}

void bd_view_credit(struct bd_view *view, uint32_t count)
{
    bd_view_take_credits(&view->state, count, bd_clock_ns());
    step(view);
}

void bd_view_restart(struct bd_view *view)
{
    view->state.credits = view->state.credit_max;
    view->state.pace_ns = view->state.credit_ns = 0;
    change(view);
}

void bd_view_wake(struct bd_view *view)
{
    step(view);
}

// --- what is asked for ----------------------------------------------------------------------

static enum bd_err refuse_what_no_view_has(const Bounced__FrameRequest *request,
                                           struct bd_err_detail *detail)
{
    for (uint32_t i = 0; i < bd_frame_option_count; i++) {
        const struct bd_frame_option *option = &bd_frame_options[i];
        if (option->of_one && bd_frame_option_is_set(option, request))
            return bd_err_set(detail, BD_ERR_USAGE, option->name, "%s: a view has none",
                              option->name);
    }
    return BD_ERR_OK;
}

static enum bd_err check_options(const struct bd_live *live, const struct bd_store_entry *entry,
                                 const struct bd_frame_options *options,
                                 struct bd_err_detail *detail)
{
    const struct bd_limits *limits = &live->loop->serving->limits;
    const struct bd_frame_limits frame_limits = {.side_px_max = (uint32_t)limits->image_side_px,
                                                 .pixel_count_max = limits->image_pixels,
                                                 .reply_bytes_max = limits->reply_bytes};
    const struct bd_frame_request *frame = &options->frame;
    if (!options->wants_image)
        return bd_err_set(detail, BD_ERR_USAGE, "encoding", "a view's encoding is not none");
    enum bd_err err = bd_frame_request_check(frame, &frame_limits, detail);
    if (err || frame->pose.is_set) return err;
    if (bd_scene_find_camera(entry->scene, frame->camera) != BD_NONE) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_USAGE, "camera", "%.63s: no such camera", frame->camera);
}

static enum bd_err read_frame(const struct bd_live *live, const struct bd_store_entry *entry,
                              const Bounced__FrameRequest *frame, struct bd_frame_options *out,
                              struct bd_err_detail *detail)
{
    enum bd_err err = bd_frame_options_read(frame, out, detail);
    if (!err && frame) err = refuse_what_no_view_has(frame, detail);
    if (err) return err;
    if (!frame || !frame->encoding) out->encode.format = BD_ENCODE_JPEG;
    if ((!frame || !frame->encoding) && frame && frame->n_layers > 1)
        return bd_err_set(detail, BD_ERR_USAGE, "layers", "jpg holds one layer, exr all of them");
    return check_options(live, entry, out, detail);
}

static enum bd_err read_rate(double frames_per_second, uint64_t *interval_ns,
                             struct bd_err_detail *detail)
{
    if (!(frames_per_second >= 0 && frames_per_second <= FPS_MAX))
        return bd_err_set(detail, BD_ERR_USAGE, "frames_per_second",
                          "%g: must be from 0 (no limit) to %g", frames_per_second, FPS_MAX);
    *interval_ns = frames_per_second > 0 ? (uint64_t)fmin(1e9 / frames_per_second, 1e18) : 0;
    return BD_ERR_OK;
}

static enum bd_err check_client(const struct bd_view_start *start, struct bd_err_detail *detail)
{
    uint64_t most = start->live->loop->serving->limits.views_per_client;
    if (start->client->views < most) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_BUSY, "views_per_client",
                      "%u views of this client are open (limit views_per_client)",
                      start->client->views);
}

enum bd_err bd_view_open(const struct bd_view_start *start, struct bd_view **out,
                         struct bd_err_detail *detail)
{
    struct bd_live *live = start->live;
    const struct bd_store_entry *entry = NULL;
    struct bd_frame_options options;
    uint64_t interval_ns = 0;
    enum bd_err err = check_client(start, detail);
    if (!err) err = bd_store_get(live->loop->serving->store, start->scene, &entry, detail);
    if (!err) err = read_frame(live, entry, start->frame, &options, detail);
    if (!err) err = read_rate(start->frames_per_second, &interval_ns, detail);
    if (err) return err;
    struct bd_view *view = calloc(1, sizeof *view);
    BD_ASSERT(view);
    *view = (struct bd_view){.steps = {.kind = &frame_kind, .loop = live->loop, .live = live},
                             .live = live,
                             .client = start->client,
                             .events = start->events,
                             .user = start->user,
                             .next = live->views,
                             .options = options,
                             .wanted_ns = bd_clock_ns(),
                             .state = {.refine = start->refine,
                                       .interval_ns = interval_ns,
                                       .credits = start->credits,
                                       .credit_max = start->credits,
                                       .wanted = 1,
                                       .last_step = BD_VIEW_STEP_NONE}};
    snprintf(view->scene_id, sizeof view->scene_id, "%s", entry->id);
    bd_client_retain(view->client);
    view->client->views++;
    if (view->next) view->next->previous = view;
    live->views = view;
    live->view_count++;
    // With the timer, and not from here: the opener has not answered yet.
    view->wake_ns = bd_clock_ns();
    arm(live);
    *out = view;
    return BD_ERR_OK;
}

enum bd_err bd_view_update(struct bd_view *view, const Bounced__ViewUpdate *update,
                           struct bd_err_detail *detail)
{
    struct bd_frame_options options = view->options;
    uint64_t interval_ns = view->state.interval_ns;
    const struct bd_store_entry *entry = NULL;
    enum bd_err err =
        bd_store_get(view->live->loop->serving->store, view->scene_id, &entry, detail);
    if (!err && update->frame) err = read_frame(view->live, entry, update->frame, &options, detail);
    if (!err && update->pose) {
        options.frame.camera[0] = 0;
        err = bd_pose_read(update->pose, &options.frame.pose, detail);
    }
    if (!err && update->pose) err = check_options(view->live, entry, &options, detail);
    if (!err && update->has_frames_per_second)
        err = read_rate(update->frames_per_second, &interval_ns, detail);
    if (err) return err;
    view->options = options;
    if (update->frame) view->cost = (struct bd_view_cost){0};
    view->state.interval_ns = interval_ns;
    if (update->has_refine) view->state.refine = update->refine;
    if (update->has_sequence) view->sequence = update->sequence;
    change(view);
    return BD_ERR_OK;
}
