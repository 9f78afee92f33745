// What a request wants: its route into a command, or an answer at once.

#include <stdio.h>
#include <stdlib.h>

#include "base/assert.h"
#include "net/http_edits.h"
#include "net/http_internal.h"
#include "net/http_stream.h"
#include "net/multipart.h"
#include "net/stats.h"
#include "net/websocket.h"
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
    struct bd_command_start start = {.net = http->conn.net,
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

static void start_empty(struct bd_http *http, Bounced__Envelope__BodyCase body_case,
                        const ProtobufCMessageDescriptor *descriptor)
{
    ProtobufCMessage *message = malloc(descriptor->sizeof_message);
    BD_ASSERT(message);
    protobuf_c_message_init(descriptor, message);
    start(http, bd_answer_of(body_case, message), NULL);
}

static void send_refusal(struct bd_http *http, const struct bd_fault *fault)
{
    struct bd_http_refusal refusal = {.fault = *fault};
    bd_http_send_fault(http, &refusal);
}

static enum bd_err read_scene_add(struct bd_http *http, Bounced__SceneAdd **out,
                                  struct bd_fault *fault)
{
    const ProtobufCMessageDescriptor *descriptor = &bounced__scene_add__descriptor;
    const char *type = http->head.values[BD_HTTP_CONTENT_TYPE];
    if (bd_http_media_is(type, "application/json"))
        return bd_json_text_to_message((const char *)http->body, http->body_bytes, descriptor,
                                       (ProtobufCMessage **)out, fault);
    struct bd_wire_alloc alloc;
    bd_wire_alloc_init(&alloc, bd_wire_budget(http->body_bytes));
    *out = bounced__scene_add__unpack(&alloc.allocator, http->body_bytes, http->body);
    if (*out) return BD_ERR_OK;
    return bd_fault_set(fault, BD_ERR_BAD_INPUT, "body", "the body is no SceneAdd");
}

static void add_scene(struct bd_http *http)
{
    Bounced__SceneAdd *add;
    struct bd_fault fault;
    if (read_scene_add(http, &add, &fault)) {
        send_refusal(http, &fault);
        return;
    }
    http->is_scene_add = true;
    start(http, bd_answer_of(BOUNCED__ENVELOPE__BODY_SCENE_ADD, add), NULL);
}

static void start_edit(struct bd_http *http)
{
    struct bd_answer request;
    struct bd_fault fault;
    if (bd_http_edit_read(http, &request, &fault))
        send_refusal(http, &fault);
    else
        start(http, request, NULL);
}

static void get_scene(struct bd_http *http)
{
    bool objects;
    struct bd_fault fault;
    if (bd_http_scene_query(http->target.query, &objects, &fault)) {
        send_refusal(http, &fault);
        return;
    }
    Bounced__SceneGet *get = malloc(sizeof *get);
    BD_ASSERT(get);
    bounced__scene_get__init(get);
    get->id = bd_answer_text(http->target.id);
    if (objects) BD_SET(get, objects, 1);
    start(http, bd_answer_of(BOUNCED__ENVELOPE__BODY_SCENE_GET, get), NULL);
}

static void remove_scene(struct bd_http *http)
{
    Bounced__SceneRemove *remove = malloc(sizeof *remove);
    BD_ASSERT(remove);
    bounced__scene_remove__init(remove);
    remove->id = bd_answer_text(http->target.id);
    start(http, bd_answer_of(BOUNCED__ENVELOPE__BODY_SCENE_REMOVE, remove), NULL);
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
    bd_sched_stats(http->conn.net->options.sched, &stats);
    const char *trouble = bd_disk_watch_trouble(http->conn.net);
    const bool ready = stats.device_ok && !http->conn.net->draining && !trouble;
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
    char *text = bd_net_metrics_text(http->conn.net);
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
    case BD_HTTP_ROUTE_SCENES:
        if (http->method == BD_HTTP_POST)
            add_scene(http);
        else
            start_empty(http, BOUNCED__ENVELOPE__BODY_SCENE_LIST, &bounced__scene_list__descriptor);
        break;
    case BD_HTTP_ROUTE_SCENE:
        if (http->method == BD_HTTP_DELETE)
            remove_scene(http);
        else
            get_scene(http);
        break;
    case BD_HTTP_ROUTE_EDIT:
        start_edit(http);
        break;
    case BD_HTTP_ROUTE_FRAME:
        render_scene(http);
        break;
    case BD_HTTP_ROUTE_RENDER:
        end_spool(http);
        break;
    case BD_HTTP_ROUTE_DEVICES:
        start_empty(http, BOUNCED__ENVELOPE__BODY_DEVICES, &bounced__devices__descriptor);
        break;
    case BD_HTTP_ROUTE_STATS:
        start_empty(http, BOUNCED__ENVELOPE__BODY_STATS, &bounced__stats__descriptor);
        break;
    case BD_HTTP_ROUTE_TECHNIQUES:
        start_empty(http, BOUNCED__ENVELOPE__BODY_TECHNIQUES, &bounced__techniques__descriptor);
        break;
    case BD_HTTP_ROUTE_OPTIONS:
        start_empty(http, BOUNCED__ENVELOPE__BODY_OPTIONS, &bounced__options__descriptor);
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
