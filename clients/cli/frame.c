#include "clients/cli/frame.h"

#include <stdio.h>

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
                             struct bd_cli_answer *answer, struct bd_err_detail *detail)
{
    *answer = (struct bd_cli_answer){0};
    Bounced__Envelope envelope = BOUNCED__ENVELOPE__INIT;
    envelope.body_case = BOUNCED__ENVELOPE__BODY_RENDER;
    envelope.render = render;
    render->frame = options->frame;
    render->has_progress = 1;
    render->progress = !options->common.quiet;
    const struct bd_cli_conn_watch watch = {
        .stage = on_stage, .tick = on_tick, .share = on_share, .user = progress};
    return bd_cli_conn_call(conn, &envelope, NULL, 0, BOUNCED__ENVELOPE__BODY_RENDER_REPLY, &watch,
                            answer, detail);
}
