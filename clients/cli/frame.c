#include "clients/cli/frame.h"

#include <stdio.h>

#include "clients/cli/sets.h"

// A frame request on the wire, with what it points at.
struct frame {
    Bounced__FrameRequest request;
    struct bd_cli_sets sets;
    uint32_t size[2];
};

static enum bd_err fill_frame(struct frame *frame, const struct bd_cli_render *options,
                              struct bd_fault *fault)
{
    *frame = (struct frame){.request = BOUNCED__FRAME_REQUEST__INIT};
    Bounced__FrameRequest *request = &frame->request;
    request->technique = (char *)options->technique;
    request->camera = (char *)options->camera;
    request->exposure = (char *)options->exposure;
    request->tonemap = (char *)options->tonemap;
    request->fresh = (char *)options->fresh;
    request->encoding = (char *)bd_cli_format_name(options->format);
    if (options->width_px) {
        frame->size[0] = options->width_px;
        frame->size[1] = options->height_px;
        request->n_size = 2;
        request->size = frame->size;
    }
    request->n_layers = options->layer_count;
    request->layers = (char **)(void *)options->layers;
    request->has_aa = request->has_seed = request->has_plan_only = 1;
    request->aa = options->aa;
    request->seed = options->seed;
    request->plan_only = options->plan;
    if (options->region[2]) {
        request->n_region = 4;
        request->region = (uint32_t *)options->region;
    }
    request->has_deadline_ms = options->deadline_ms != 0;
    request->deadline_ms = options->deadline_ms;
    request->has_budget_ms = options->budget_ms != 0;
    request->budget_ms = options->budget_ms;
    request->has_check = options->check != 0;
    request->check = options->check;
    request->has_target_error = options->target_error > 0;
    request->target_error = options->target_error;
    request->against = (char *)options->against;
    enum bd_err err = BD_ERR_OK;
    for (uint32_t i = 0; !err && i < options->set_count; i++)
        err = bd_cli_sets_add(&frame->sets, options->sets[i], fault);
    bd_cli_sets_fill(&frame->sets, request);
    return err;
}

static void on_stage(void *user, const char *stage)
{
    bd_cli_progress_stage(user, stage);
}

static void on_share(void *user, double share)
{
    char text[32];
    snprintf(text, sizeof text, "%.0f %%", 100 * share);
    bd_cli_progress_share(user, share, text);
}

static void on_tick(void *user)
{
    bd_cli_progress_tick(user);
}

enum bd_err bd_cli_frame_ask(struct bd_cli_conn *conn, Bounced__Render *render,
                             const struct bd_cli_render *options, struct bd_cli_progress *progress,
                             struct bd_cli_answer *answer, struct bd_fault *fault)
{
    *answer = (struct bd_cli_answer){0};
    struct frame frame;
    enum bd_err err = fill_frame(&frame, options, fault);
    if (!err) {
        Bounced__Envelope envelope = BOUNCED__ENVELOPE__INIT;
        envelope.body_case = BOUNCED__ENVELOPE__BODY_RENDER;
        envelope.render = render;
        render->frame = &frame.request;
        render->has_progress = 1;
        render->progress = !options->common.quiet;
        const struct bd_cli_conn_watch watch = {
            .stage = on_stage, .tick = on_tick, .share = on_share, .user = progress};
        err = bd_cli_conn_call(conn, &envelope, NULL, 0, BOUNCED__ENVELOPE__BODY_RENDER_REPLY,
                               &watch, answer, fault);
    }
    bd_cli_sets_finish(&frame.sets);
    return err;
}
