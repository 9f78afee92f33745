// A body's way in: a short one into memory, a long one to the disk.

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "net/access/blob_rights.h"
#include "net/http/http_internal.h"

static void on_spool_drained(void *user)
{
    bd_conn_read(&((struct bd_http *)user)->conn, true);
}

static void on_spool_ended(void *user, enum bd_err err, const struct bd_fault *fault)
{
    struct bd_http *http = user;
    if (err) {
        struct bd_http_refusal refusal = {.fault = *fault};
        // The disk may fail in mid-body: what still comes is not ours to read.
        if (http->phase == BD_HTTP_PHASE_BODY) http->keep_alive = false;
        bd_http_send_fault(http, &refusal);
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
