// What a request wants: its route into a command, or an answer at once.

#include <stdio.h>
#include <stdlib.h>

#include "base/assert.h"
#include "net/command/stats.h"
#include "net/http/http_commands.h"
#include "net/http/http_internal.h"
#include "net/http/http_stream.h"
#include "net/http/websocket.h"
#include "net/wire/multipart.h"
#include "protocol/json.h"
#include "protocol/wire.h"

// --- commands -------------------------------------------------------------------------------

static void on_answer(void *user, struct bd_answer *answer)
{
    struct bd_http *http = user;
    http->command = NULL;
    bd_http_send_answer(http, answer);
}

static const struct bd_command_events command_events = {on_answer, NULL};

static void start(struct bd_http *http, struct bd_answer request, struct bd_command_body *body)
{
    struct bd_command_start start = {.commands = http->web->sessions->commands,
                                     .client = http->conn.client,
                                     .grant = http->grant,
                                     .envelope = request.envelope,
                                     .body = body,
                                     .may_remember = http->target.route == BD_HTTP_ROUTE_FRAME,
                                     .events = &command_events,
                                     .user = http};
    // One that is answered at once may have been followed by the next request's by now.
    struct bd_command *command = bd_command_start(&start);
    if (command) http->command = command;
}

static void send_refusal(struct bd_http *http, const struct bd_fault *fault)
{
    struct bd_http_refusal refusal = {.fault = *fault};
    bd_http_send_fault(http, &refusal);
}

static void start_by_row(struct bd_http *http)
{
    const struct bd_command_row *row = bd_http_command_by(http->target.command, http->method);
    struct bd_answer request;
    struct bd_fault fault;
    BD_ASSERT(row); // or refused with its head
    http->is_scene_add = row->body == BOUNCED__ENVELOPE__BODY_SCENE_ADD;
    if (bd_http_command_read(http, row, &request, &fault))
        send_refusal(http, &fault);
    else
        start(http, request, NULL);
}

// NULL, and the request is answered, if the query makes no sense.
static Bounced__Render *new_render(struct bd_http *http)
{
    Bounced__Render *render;
    struct bd_fault fault;
    if (!bd_http_query_read(http->target.query, http->target.extension, &render, &fault))
        return render;
    send_refusal(http, &fault);
    return NULL;
}

static void render_scene(struct bd_http *http)
{
    Bounced__Render *render = new_render(http);
    if (!render) return;
    render->scene = bd_answer_text(http->target.id);
    start(http, bd_answer_of(BOUNCED__ENVELOPE__BODY_RENDER, render), NULL);
}

void bd_http_render_body(struct bd_http *http)
{
    Bounced__Render *render = new_render(http);
    if (!render) return;
    const char *type = http->head.values[BD_HTTP_CONTENT_TYPE];
    struct bd_command_body body = {.upload = bd_spool_take_upload(http->spool), .name = "body"};
    bd_spool_abandon(&http->spool);
    bd_multipart_boundary(type, body.boundary, sizeof body.boundary);
    start(http, bd_answer_of(BOUNCED__ENVELOPE__BODY_RENDER, render), &body);
}

static void look_for_blob(struct bd_http *http)
{
    Bounced__BlobHave *have = malloc(sizeof *have);
    char name[8 + BD_SHA256_HEX];
    BD_ASSERT(have);
    bounced__blob_have__init(have);
    snprintf(name, sizeof name, "sha256:%.64s", http->target.id);
    have->blobs = malloc(sizeof *have->blobs);
    BD_ASSERT(have->blobs);
    have->blobs[0] = bd_answer_text(name);
    have->n_blobs = 1;
    start(http, bd_answer_of(BOUNCED__ENVELOPE__BODY_BLOB_HAVE, have), NULL);
}

// --- the daemon itself ----------------------------------------------------------------------

static void send_ready(struct bd_http *http)
{
    struct bd_sched_stats stats;
    bd_sched_stats(http->conn.loop->serving->sched, &stats);
    const char *trouble = bd_disk_watch_trouble(http->web->sessions->commands->commits);
    const bool ready = stats.device_ok && !http->conn.loop->draining && !trouble;
    json_t *json = json_pack("{s:b, s:{s:s, s:s, s:b}, s:{s:b, s:s*}}", "ready", ready, "device",
                             "name", stats.device_name, "class", stats.device_class, "software",
                             stats.software, "journal", "ok", !trouble, "reason", trouble);
    char *text = json ? json_dumps(json, JSON_COMPACT) : NULL;
    bd_http_send_text(http, ready ? 200 : 503, "application/json", text ? text : "{}");
    free(text);
    json_decref(json);
}

static void send_metrics(struct bd_http *http)
{
    char *text = bd_net_metrics_text(http->conn.loop);
    bd_http_send_text(http, 200, "text/plain; version=0.0.4; charset=utf-8", text);
    free(text);
}

// Content may only be had whole: an upload without a byte still has to be opened and hashed.
static void end_spool(struct bd_http *http)
{
    if (http->target.route == BD_HTTP_ROUTE_BLOB)
        bd_spool_commit(http->spool, http->target.id);
    else
        bd_spool_close(http->spool);
}

void bd_http_run(struct bd_http *http)
{
    if (http->has_refusal) {
        bd_http_send_fault(http, &http->refusal);
        return;
    }
    switch (http->target.route) {
    case BD_HTTP_ROUTE_HEALTH:
        bd_http_send_text(http, 200, "application/json", "{\"ok\":true}");
        break;
    case BD_HTTP_ROUTE_READY:
        send_ready(http);
        break;
    case BD_HTTP_ROUTE_METRICS:
        send_metrics(http);
        break;
    case BD_HTTP_ROUTE_BLOB:
        if (http->method == BD_HTTP_HEAD)
            look_for_blob(http);
        else
            end_spool(http);
        break;
    case BD_HTTP_ROUTE_COMMAND:
        start_by_row(http);
        break;
    case BD_HTTP_ROUTE_FRAME:
        render_scene(http);
        break;
    case BD_HTTP_ROUTE_RENDER:
        end_spool(http);
        break;
    case BD_HTTP_ROUTE_SESSION:
        if (http->method == BD_HTTP_POST)
            bd_http_begin_session(http);
        else
            bd_http_end_session(http);
        break;
    case BD_HTTP_ROUTE_SOCKET:
        bd_websocket_begin(http);
        break;
    case BD_HTTP_ROUTE_MJPEG:
        bd_http_begin_mjpeg(http);
        break;
    case BD_HTTP_ROUTE_EVENTS:
        bd_http_begin_events(http);
        break;
    case BD_HTTP_ROUTE_VIEWER:
        bd_http_send_file(http, http->target.file);
        break;
    case BD_HTTP_ROUTE_NONE:
        BD_ASSERT(!"refused with its head");
        break;
    }
}
