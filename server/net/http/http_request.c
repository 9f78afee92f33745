// From a request's head to what it asks for: who may ask, its body, and what is started.

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "base/assert.h"
#include "net/access/auth.h"
#include "net/access/cookie.h"
#include "net/command/stats.h"
#include "net/http/http_guard.h"
#include "net/http/http_internal.h"
#include "net/http/http_route.h"
#include "net/http/http_stream.h"
#include "net/http/websocket.h"
#include "net/http/ws_accept.h"
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

static void send_refusal(struct bd_http *http, const struct bd_err_detail *detail)
{
    struct bd_http_refusal refusal = {.detail = *detail};
    bd_http_send_error(http, &refusal);
}

static void start_by_row(struct bd_http *http)
{
    const struct bd_command_row *row = bd_http_command_by(http->target.command, http->method);
    struct bd_answer request;
    struct bd_err_detail detail;
    BD_ASSERT(row); // or refused with its head
    http->is_scene_add = row->body == BOUNCED__ENVELOPE__BODY_SCENE_ADD;
    if (bd_http_command_read(http, row, &request, &detail))
        send_refusal(http, &detail);
    else
        start(http, request, NULL);
}

// NULL, and the request is answered, if the query makes no sense.
static Bounced__Render *new_render(struct bd_http *http)
{
    Bounced__Render *render;
    struct bd_err_detail detail;
    if (!bd_http_query_read(http->target.query, http->target.extension, &render, &detail))
        return render;
    send_refusal(http, &detail);
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
        bd_http_send_error(http, &http->refusal);
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

// --- who asks ------------------------------------------------------------------------------------

bool bd_http_has_long_body(const struct bd_http *http)
{
    return http->target.route == BD_HTTP_ROUTE_RENDER ||
           (http->target.route == BD_HTTP_ROUTE_BLOB && http->method == BD_HTTP_PUT);
}

static enum bd_err check_blob_name(struct bd_http *http)
{
    if (http->target.route != BD_HTTP_ROUTE_BLOB || bd_blob_name_is_valid(http->target.id))
        return BD_ERR_OK;
    return bd_err_set(&http->refusal.detail, BD_ERR_USAGE, "path",
                      "a blob's name is sha256: and 64 lower-case hexadecimal digits");
}

static enum bd_err check_body_size(struct bd_http *http)
{
    const struct bd_limits *limits = &http->conn.loop->serving->limits;
    bool is_long = bd_http_has_long_body(http);
    uint64_t most = is_long ? limits->blob_bytes : limits->message_bytes;
    uint64_t size = http->parser.content_length;
    const char *name = is_long ? "blob_bytes" : "message_bytes";
    if (size <= most) return BD_ERR_OK;
    return bd_err_set(&http->refusal.detail, BD_ERR_LIMIT, name,
                      "a body of %llu bytes is above the limit %s of %llu",
                      (unsigned long long)size, name, (unsigned long long)most);
}

// The client, by its grant and address, and its bucket of requests.
static enum bd_err check_rate(struct bd_http *http, const struct bd_http_guard *guard)
{
    struct bd_loop *loop = http->conn.loop;
    bool has_token;
    const struct bd_grant *grant = bd_http_guard_grant(guard, &http->head, &has_token);
    enum bd_err err =
        bd_conn_identify(&http->conn, grant, bd_grant_token(grant), &http->refusal.detail);
    if (err) return err;
    if (!grant && has_token)
        return bd_client_take_failed_login(loop->clients, http->conn.origin, &http->refusal.detail);
    if (http->target.route == BD_HTTP_ROUTE_HEALTH || http->target.route == BD_HTTP_ROUTE_READY)
        return BD_ERR_OK;
    return bd_client_take_request(loop->clients, http->conn.client, &http->refusal.detail);
}

static enum bd_err check_version(struct bd_http *http)
{
    if (http->parser.http_major == 1 && http->parser.http_minor <= 1) return BD_ERR_OK;
    http->refusal.status = 505;
    http->keep_alive = false;
    return bd_err_set(&http->refusal.detail, BD_ERR_UNSUPPORTED, "", "HTTP 1.1 is spoken here");
}

static bool is_login(const struct bd_http *http)
{
    return http->target.route == BD_HTTP_ROUTE_SESSION && http->method == BD_HTTP_POST;
}

// A socket may change anything once it is open.
static bool changes_something(const struct bd_http *http)
{
    return http->target.route == BD_HTTP_ROUTE_SOCKET ||
           (http->method != BD_HTTP_GET && http->method != BD_HTTP_HEAD);
}

// The viewer's files are the same for everyone; its page brings the token, and cannot before it is
// loaded.
static bool needs_token(enum bd_http_route route)
{
    return route != BD_HTTP_ROUTE_HEALTH && route != BD_HTTP_ROUTE_VIEWER;
}

// What is no command says here whom it is for; an upload is refused before its body is kept.
static enum bd_role role_for(const struct bd_http *http)
{
    if (bd_http_has_long_body(http)) return BD_ROLE_EDIT;
    return http->target.route == BD_HTTP_ROUTE_METRICS ? BD_ROLE_ADMIN : BD_ROLE_READ;
}

enum bd_err bd_http_check_head(struct bd_http *http)
{
    const struct bd_access *access = http->web->sessions->access;
    struct bd_http_guard guard = {.public_names = http->web->public_names,
                                  .local_host = http->local_host,
                                  .tokens = access->tokens,
                                  .cookies = access->cookies,
                                  .needs_token = needs_token(http->target.route),
                                  .wants_bearer = is_login(http),
                                  .changes = changes_something(http)};
    http->refusal = (struct bd_http_refusal){0};
    // Before all that may be wrong with it: a flood of nonsense empties the bucket like any other.
    enum bd_err err = check_rate(http, &guard);
    if (!err) err = check_version(http);
    if (!err) err = bd_http_guard_check(&guard, &http->head, &http->grant, &http->refusal);
    if (!err) err = bd_http_route_check(&http->target, http->method, &http->refusal);
    if (!err && (http->method == BD_HTTP_POST || http->method == BD_HTTP_PUT))
        err = bd_http_guard_content_type(&http->head, http->target.route == BD_HTTP_ROUTE_RENDER,
                                         &http->refusal);
    if (!err && http->target.route == BD_HTTP_ROUTE_SOCKET)
        err = bd_ws_check_handshake(&http->head, &http->refusal);
    http->refusal.status = err ? http->refusal.status : 0;
    if (!err) err = bd_grant_check_role(http->grant, role_for(http), &http->refusal.detail);
    if (!err) err = check_blob_name(http);
    if (!err) err = check_body_size(http);
    http->conn.is_known |= !err && guard.needs_token;
    return err;
}

// --- the body ------------------------------------------------------------------------------------

static void on_spool_drained(void *user)
{
    bd_conn_read(&((struct bd_http *)user)->conn, true);
}

static void on_spool_ended(void *user, enum bd_err err, const struct bd_err_detail *detail)
{
    struct bd_http *http = user;
    if (err) {
        struct bd_http_refusal refusal = {.detail = *detail};
        // The disk may fail in mid-body: what still comes is not ours to read.
        if (http->phase == BD_HTTP_PHASE_BODY) http->keep_alive = false;
        bd_http_send_error(http, &refusal);
    } else if (http->target.route == BD_HTTP_ROUTE_RENDER) {
        bd_http_render_body(http);
    } else {
        bd_http_send_text(http, 201, NULL, NULL);
    }
}

static const struct bd_spool_events spool_events = {on_spool_drained, on_spool_ended};

static bool has_body(const struct bd_http *http)
{
    return http->parser.content_length > 0;
}

static void send_continue(struct bd_http *http)
{
    static const char line[] = "HTTP/1.1 100 Continue\r\n\r\n";
    bd_conn_write(&http->conn, (uint8_t *)bd_answer_text(line), sizeof line - 1, NULL, 0);
}

// A file that is rendered once is not kept.
static uint64_t most_bytes_of(const struct bd_http *http)
{
    return http->target.route == BD_HTTP_ROUTE_BLOB ? http->grant->bytes_max : UINT64_MAX;
}

void bd_http_begin_body(struct bd_http *http)
{
    http->conn.loop->counts.requests++;
    if (bd_http_check_head(http)) {
        http->has_refusal = true;
        return;
    }
    if (http->head.values[BD_HTTP_EXPECT] && has_body(http)) send_continue(http);
    if (bd_http_has_long_body(http))
        http->spool = bd_spool_create(http->conn.loop,
                                      bd_grant_blobs(http->conn.loop->serving->blobs, http->grant),
                                      most_bytes_of(http), &spool_events, http);
}

void bd_http_take_body(struct bd_http *http, const uint8_t *bytes, size_t size)
{
    if (http->spool) {
        bd_spool_append(http->spool, bytes, size);
        if (bd_spool_is_full(http->spool)) bd_conn_read(&http->conn, false);
        return;
    }
    // Grows with what arrives; the whole was checked against message_bytes.
    http->body = realloc(http->body, http->body_bytes + size);
    BD_ASSERT(http->body);
    memcpy(http->body + http->body_bytes, bytes, size);
    http->body_bytes += size;
}

// --- browser sessions ----------------------------------------------------------------------------

// Nothing is asked for but the session itself: a name in the body would be passed over.
static bool has_good_body(struct bd_http *http)
{
    const char *type = http->head.values[BD_HTTP_CONTENT_TYPE];
    struct bd_http_refusal refusal = {0};
    ProtobufCMessage *message;
    if (http->body_bytes == 0 || !bd_http_media_is(type, "application/json")) return true;
    if (bd_json_text_to_message((const char *)http->body, http->body_bytes,
                                &bounced__done__descriptor, &message, &refusal.detail)) {
        bd_http_send_error(http, &refusal);
        return false;
    }
    protobuf_c_message_free_unpacked(message, NULL);
    return true;
}

void bd_http_begin_session(struct bd_http *http)
{
    if (!has_good_body(http)) return;
    char value[BD_COOKIE_BYTES];
    const char *origin = http->head.values[BD_HTTP_ORIGIN];
    bool is_secure = origin && strncasecmp(origin, "https://", 8) == 0;
    bd_cookies_issue(http->web->sessions->access->cookies, http->grant, value);
    snprintf(http->set_cookie, sizeof http->set_cookie,
             BD_COOKIE_NAME "=%s; Path=/; HttpOnly; SameSite=Strict; Max-Age=%llu%s", value,
             (unsigned long long)http->conn.loop->serving->limits.cookie_seconds,
             is_secure ? "; Secure" : "");
    bd_http_send_text(http, 204, NULL, NULL);
}

void bd_http_end_session(struct bd_http *http)
{
    bd_cookies_end(http->web->sessions->access->cookies, http->head.values[BD_HTTP_COOKIE]);
    snprintf(http->set_cookie, sizeof http->set_cookie,
             BD_COOKIE_NAME "=; Path=/; HttpOnly; SameSite=Strict; Max-Age=0");
    bd_http_send_text(http, 204, NULL, NULL);
}
