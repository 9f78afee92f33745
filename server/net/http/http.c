#include "net/http/http.h"

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/log.h"
#include "net/http/http_internal.h"
#include "net/http/http_stream.h"
#include "net/http/websocket.h"
#include "net/loop/address.h"

// What a peer may send ahead of the answer that it waits for.
#define STASH_BYTES_MAX (256u << 10)
// Until a peer has read this far, its next request waits.
#define UNSENT_BYTES_MAX (8u << 20)

static struct bd_http *http_of(llhttp_t *parser)
{
    return parser->data;
}

// --- the parser's events --------------------------------------------------------------------

static int on_url(llhttp_t *parser, const char *bytes, size_t size)
{
    return bd_http_head_url(&http_of(parser)->head, bytes, size) ? 0 : -1;
}

static int on_name(llhttp_t *parser, const char *bytes, size_t size)
{
    return bd_http_head_name(&http_of(parser)->head, bytes, size) ? 0 : -1;
}

static int on_value(llhttp_t *parser, const char *bytes, size_t size)
{
    return bd_http_head_value(&http_of(parser)->head, bytes, size) ? 0 : -1;
}

static int method_of(uint8_t method)
{
    switch (method) {
    case HTTP_GET:
        return BD_HTTP_GET;
    case HTTP_HEAD:
        return BD_HTTP_HEAD;
    case HTTP_POST:
        return BD_HTTP_POST;
    case HTTP_PUT:
        return BD_HTTP_PUT;
    case HTTP_DELETE:
        return BD_HTTP_DELETE;
    default:
        return -1;
    }
}

static int on_head(llhttp_t *parser)
{
    struct bd_http *http = http_of(parser);
    http->method = method_of(parser->method);
    http->keep_alive = llhttp_should_keep_alive(parser) && !parser->upgrade;
    http->phase = BD_HTTP_PHASE_BODY;
    http->conn.clock_runs = false;
    bd_conn_touch(&http->conn);
    bd_http_head_resolve(&http->head);
    bd_http_route_find(http->head.url ? http->head.url : "", &http->target);
    bd_http_begin_body(http);
    if (!http->has_refusal) return 0;
    // Refused: what comes as body is not read, so nothing that follows can be told from it.
    if (http->head.seen[BD_HTTP_CONTENT_LENGTH] || http->head.seen[BD_HTTP_TRANSFER_ENCODING])
        http->keep_alive = false;
    return 1;
}

static int on_body(llhttp_t *parser, const char *bytes, size_t size)
{
    bd_http_take_body(http_of(parser), (const uint8_t *)bytes, size);
    return 0;
}

static int on_complete(llhttp_t *parser)
{
    http_of(parser)->is_complete = true;
    return HPE_PAUSED; // what follows is the next request's
}

// llhttp pauses only from within a callback: what is left of a buffer behind a message is stashed
// and fed again.
static const llhttp_settings_t parser_settings = {
    .on_url = on_url,
    .on_header_field = on_name,
    .on_header_value = on_value,
    .on_headers_complete = on_head,
    .on_body = on_body,
    .on_message_complete = on_complete,
};

// --- requests one after the other -----------------------------------------------------------

static void begin_request(struct bd_http *http)
{
    bd_http_head_begin(&http->head, http->conn.loop->serving->limits.head_bytes);
    free(http->body);
    http->body = NULL;
    http->body_bytes = 0;
    bd_spool_abandon(&http->spool);
    http->phase = BD_HTTP_PHASE_HEAD;
    http->has_refusal = http->is_complete = http->is_scene_add = false;
    http->set_cookie[0] = 0;
    http->conn.clock_runs = true;
    bd_conn_touch(&http->conn);
    http->lines = (struct bd_http_lines){0};
    http->breach = NULL;
    http->fed = 0;
    llhttp_init(&http->parser, HTTP_REQUEST, &parser_settings);
    http->parser.data = http;
}

// The bytes are no HTTP. One answer, in our own words, and the end.
static void refuse_bytes(struct bd_http *http)
{
    const llhttp_errno_t error = llhttp_get_errno(&http->parser);
    const char *why = http->breach ? http->breach : llhttp_get_error_reason(&http->parser);
    struct bd_http_refusal refusal = {.status = 400};
    http->keep_alive = false;
    http->method = -1;
    if (http->head.bytes > http->head.bytes_max) {
        refusal.status = 431;
        bd_err_set(&refusal.detail, BD_ERR_LIMIT, "head_bytes",
                   "the head is longer than %zu bytes (limit head_bytes)", http->head.bytes_max);
    } else if (http->head.seen[BD_HTTP_TRANSFER_ENCODING]) {
        if (!http->head.seen[BD_HTTP_CONTENT_LENGTH]) refusal.status = 411;
        bd_err_set(&refusal.detail, BD_ERR_USAGE, "Transfer-Encoding",
                   "a body comes with Content-Length, not with Transfer-Encoding");
    } else if (!http->breach && error == HPE_INVALID_VERSION) {
        refusal.status = 505;
        bd_err_set(&refusal.detail, BD_ERR_UNSUPPORTED, "", "HTTP 1.1 is spoken here");
    } else {
        bd_err_set(&refusal.detail, BD_ERR_USAGE, "", "this is no HTTP request: %s",
                   why ? why : llhttp_errno_name(error));
    }
    bd_log(BD_LOG_DEBUG, "net/http", "%s: %s", http->conn.client->key, refusal.detail.message);
    http->phase = BD_HTTP_PHASE_BUSY;
    bd_http_send_error(http, &refusal);
}

// Gives bytes to the parser. Returns how much it took: less than all at the end of a request.
static size_t parse(struct bd_http *http, const uint8_t *bytes, size_t size)
{
    const char *text = (const char *)bytes;
    const llhttp_errno_t error = llhttp_execute(&http->parser, text, size);
    return error == HPE_OK ? size : (size_t)(llhttp_get_error_pos(&http->parser) - text);
}

static bool has_failed(const struct bd_http *http)
{
    const llhttp_errno_t error = llhttp_get_errno(&http->parser);
    // Where the one sees a head's end and the other does not, neither is right.
    return http->breach || (error != HPE_OK && error != HPE_PAUSED) ||
           (http->lines.place == BD_HTTP_IS_OVER && http->phase == BD_HTTP_PHASE_HEAD);
}

// Feeds the parser up to the end of one request at most. Returns how much it took.
static size_t feed(struct bd_http *http, const uint8_t *bytes, size_t size)
{
    // The first byte of a request starts the clock that it must be whole by.
    if (http->phase == BD_HTTP_PHASE_HEAD && http->fed == 0) bd_conn_touch(&http->conn);
    size_t looked = size;
    if (http->phase == BD_HTTP_PHASE_HEAD)
        http->breach = bd_http_lines_check(&http->lines, bytes, size, &looked);
    const size_t taken = http->breach ? looked : parse(http, bytes, looked);
    http->fed += taken;
    if (http->is_complete) {
        http->phase = BD_HTTP_PHASE_BUSY;
        bd_http_run(http);
    } else if (has_failed(http)) {
        refuse_bytes(http);
    }
    return taken;
}

static bool may_feed(const struct bd_http *http)
{
    return http->conn.state == BD_CONN_OPEN && http->phase != BD_HTTP_PHASE_BUSY &&
           bd_conn_takes_more(&http->conn, UNSENT_BYTES_MAX);
}

static bool stash_has_room(const struct bd_http *http)
{
    return http->stash_bytes <= bd_conn_room_bytes(&http->conn, STASH_BYTES_MAX);
}

static void stash(struct bd_http *http, const uint8_t *bytes, size_t size)
{
    if (size == 0) return;
    http->stash = realloc(http->stash, http->stash_bytes + size);
    BD_ASSERT(http->stash);
    memcpy(http->stash + http->stash_bytes, bytes, size);
    http->stash_bytes += size;
    // Reading goes on while we compute, or we would not notice that the peer left; but not for
    // ever.
    if (!stash_has_room(http)) bd_conn_read(&http->conn, false);
}

// What came behind the handshake belongs to whatever the connection is now.
static void hand_over(struct bd_http *http, size_t used)
{
    uint8_t *stash = http->stash;
    size_t left = http->stash_bytes - used;
    http->stash = NULL;
    http->stash_bytes = 0;
    if (left > 0 && http->conn.state == BD_CONN_OPEN)
        http->conn.ops->bytes(&http->conn, stash + used, left);
    free(stash);
}

// Requests out of the stash, as long as each is answered at once. Not reentered: an answer that
// comes while we are here only changes the phase.
static void pump(struct bd_http *http)
{
    if (http->is_pumping) return;
    http->is_pumping = true;
    size_t used = 0;
    while (used < http->stash_bytes && may_feed(http))
        used += feed(http, http->stash + used, http->stash_bytes - used);
    http->is_pumping = false;
    if (http->websocket || http->stream) {
        hand_over(http, used);
        return;
    }
    http->stash_bytes -= used;
    if (http->stash_bytes > 0) memmove(http->stash, http->stash + used, http->stash_bytes);
    if (http->stash_bytes == 0) {
        free(http->stash);
        http->stash = NULL;
    }
    if (stash_has_room(http) && !(http->spool && bd_spool_is_full(http->spool)))
        bd_conn_read(&http->conn, true);
}

static void on_bytes(struct bd_conn *conn, const uint8_t *bytes, size_t size)
{
    struct bd_http *http = (struct bd_http *)conn;
    stash(http, bytes, size);
    pump(http);
}

void bd_http_next(struct bd_http *http)
{
    if (http->conn.state != BD_CONN_OPEN) return;
    if (!http->keep_alive || http->conn.loop->draining) {
        bd_conn_finish(&http->conn);
        return;
    }
    begin_request(http);
    pump(http);
}

// --- the connection -------------------------------------------------------------------------

static bool is_between_requests(const struct bd_http *http)
{
    return http->phase == BD_HTTP_PHASE_HEAD && http->fed == 0;
}

static uint64_t patience_s(const struct bd_conn *conn)
{
    const struct bd_http *http = (const struct bd_http *)conn;
    const struct bd_limits *limits = &conn->loop->serving->limits;
    if (bd_conn_unsent_bytes(conn) > 0) return limits->idle_seconds;
    switch (http->phase) {
    case BD_HTTP_PHASE_HEAD:
        return is_between_requests(http) ? limits->idle_seconds : limits->header_seconds;
    case BD_HTTP_PHASE_BODY:
        return conn->reading ? limits->idle_seconds : 0;
    case BD_HTTP_PHASE_BUSY:
        return 0;
    }
    return 0;
}

static bool owes(const struct bd_conn *conn)
{
    return ((const struct bd_http *)conn)->phase == BD_HTTP_PHASE_BODY;
}

static void on_silent(struct bd_conn *conn)
{
    struct bd_http *http = (struct bd_http *)conn;
    if (is_between_requests(http)) {
        bd_conn_finish(conn);
        return;
    }
    const char *limit = http->phase == BD_HTTP_PHASE_HEAD ? "header_seconds"
                        : conn->is_slow                   ? "slow_bytes_per_second"
                                                          : "idle_seconds";
    struct bd_http_refusal refusal = {.status = 408};
    bd_err_set(&refusal.detail, BD_ERR_DEADLINE, limit,
               "the request took too long to arrive (limit %s)", limit);
    http->keep_alive = false;
    bd_http_send_error(http, &refusal);
}

static void on_drain(struct bd_conn *conn)
{
    struct bd_http *http = (struct bd_http *)conn;
    if (http->phase != BD_HTTP_PHASE_BUSY) bd_conn_finish(conn);
}

static void on_written(struct bd_conn *conn)
{
    pump((struct bd_http *)conn);
}

static void on_gone(struct bd_conn *conn)
{
    struct bd_http *http = (struct bd_http *)conn;
    if (http->command) bd_command_abandon(http->command);
    http->command = NULL;
    bd_spool_abandon(&http->spool);
}

void bd_http_free(struct bd_conn *conn)
{
    struct bd_http *http = (struct bd_http *)conn;
    bd_websocket_destroy(&http->websocket);
    bd_http_stream_destroy(&http->stream);
    bd_http_head_finish(&http->head);
    free(http->body);
    free(http->stash);
    free(http);
}

static const struct bd_conn_ops http_ops = {
    .bytes = on_bytes,
    .patience_s = patience_s,
    .owes = owes,
    .silent = on_silent,
    .drain = on_drain,
    .written = on_written,
    .gone = on_gone,
    .free = bd_http_free,
};

void bd_http_accept(const struct bd_web *web, uv_stream_t *listener)
{
    struct bd_http *http = calloc(1, sizeof *http);
    BD_ASSERT(http);
    http->conn.ops = &http_ops;
    http->web = web;
    if (!bd_conn_accept(web->sessions->loop, &http->conn, listener, false, false)) return;
    struct sockaddr_storage local = {0};
    int size = sizeof local;
    uv_tcp_getsockname(&http->conn.uv.tcp, (struct sockaddr *)&local, &size);
    bd_sockaddr_host(&local, http->local_host, sizeof http->local_host);
    begin_request(http);
}
