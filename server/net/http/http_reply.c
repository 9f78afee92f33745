// Answers of the HTTP transport: one head, one body, always with a length.

#include <ctype.h>
#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "net/http/http_internal.h"
#include "net/http/viewer.h"
#include "protocol/json.h"

#define REASON_BYTES 40

static const char *name_of(int status)
{
    switch (status) {
#define XX(number, name, string)                                                                   \
    case number:                                                                                   \
        return #string;
        HTTP_STATUS_MAP(XX)
#undef XX
    default:
        return "OTHER";
    }
}

// "NOT_FOUND" as "Not Found".
static const char *reason_of(int status, char out[REASON_BYTES])
{
    const char *name = name_of(status);
    size_t i = 0;
    for (; name[i] && i + 1 < REASON_BYTES; i++) {
        const bool begins = i == 0 || name[i - 1] == '_' || status == 200;
        out[i] = name[i] == '_' ? ' ' : (char)(begins ? name[i] : tolower((unsigned char)name[i]));
    }
    out[i] = 0;
    return out;
}

// A head under construction. What does not fit is left out by whoever adds it, never cut.
struct head {
    char *text;
    size_t used, capacity;
};

static void add(struct head *head, const char *format, ...) BD_PRINTF(2, 3);
static void add(struct head *head, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    int length = vsnprintf(head->text + head->used, head->capacity - head->used, format, args);
    va_end(args);
    if (length > 0 && (size_t)length < head->capacity - head->used) head->used += (size_t)length;
}

#define HEAD_BYTES_MAX 16384

static struct head begin_head_cached(const struct bd_http *http, int status, const char *type,
                                     size_t body_bytes, const char *cache)
{
    struct head head = {.text = malloc(HEAD_BYTES_MAX), .capacity = HEAD_BYTES_MAX};
    BD_ASSERT(head.text);
    char reason[REASON_BYTES];
    add(&head, "HTTP/1.1 %d %s\r\n", status, reason_of(status, reason));
    if (type) add(&head, "Content-Type: %s\r\n", type);
    if (status != 204 && status != 304) add(&head, "Content-Length: %zu\r\n", body_bytes);
    add(&head, "Connection: %s\r\nCache-Control: %s\r\nX-Content-Type-Options: nosniff\r\n",
        http->keep_alive ? "keep-alive" : "close", cache);
    if (http->set_cookie[0]) add(&head, "Set-Cookie: %s\r\n", http->set_cookie);
    return head;
}

static struct head begin_head(const struct bd_http *http, int status, const char *type,
                              size_t body_bytes)
{
    return begin_head_cached(http, status, type, body_bytes, "no-store");
}

// Cut to its length: it stays until the peer has read it.
static uint8_t *end_head(struct head *head)
{
    add(head, "\r\n");
    uint8_t *text = realloc(head->text, head->used);
    BD_ASSERT(text);
    return text;
}

// Takes `body`.
static void send_reply(struct bd_http *http, struct head *head, uint8_t *body, size_t body_bytes)
{
    uint8_t *text = end_head(head);
    if (http->method == BD_HTTP_HEAD) {
        free(body);
        body = NULL;
    }
    bd_conn_write(&http->conn, text, head->used, body, body ? body_bytes : 0);
    bd_http_next(http);
}

void bd_http_send_text(struct bd_http *http, int status, const char *type, const char *text)
{
    size_t size = text ? strlen(text) : 0;
    struct head head = begin_head(http, status, type, size);
    send_reply(http, &head, size ? (uint8_t *)bd_answer_text(text) : NULL, size);
}

static void send_message(struct bd_http *http, int status, const ProtobufCMessage *message)
{
    const char *accept = http->head.values[BD_HTTP_ACCEPT];
    if (accept && strstr(accept, "application/x-protobuf")) {
        size_t size = protobuf_c_message_get_packed_size(message);
        uint8_t *bytes = malloc(size ? size : 1);
        BD_ASSERT(bytes);
        protobuf_c_message_pack(message, bytes);
        struct head head = begin_head(http, status, "application/x-protobuf", size);
        send_reply(http, &head, bytes, size);
    } else {
        char *text = bd_json_text_from_message(message);
        BD_ASSERT(text);
        struct head head = begin_head(http, status, "application/json", strlen(text));
        if (status == 401) add(&head, "WWW-Authenticate: Bearer\r\n");
        if (status == 426) add(&head, "Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n");
        if (status == 429) add(&head, "Retry-After: 1\r\n");
        send_reply(http, &head, (uint8_t *)text, strlen(text));
    }
}

void bd_http_send_error(struct bd_http *http, const struct bd_http_refusal *refusal)
{
    struct bd_answer answer = bd_answer_error(&refusal->detail);
    http->conn.loop->counts.requests_refused++;
    send_message(http, refusal->status ? refusal->status : bd_err_http_status(refusal->detail.err),
                 &answer.envelope->error->base);
    bd_answer_finish(&answer);
}

// --- the viewer -----------------------------------------------------------------------------

// Scripts, styles and connections of this server alone, and nothing inline; nobody frames the page,
// and where it leads to learns nothing of its address.
#define VIEWER_POLICY                                                                              \
    "Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; "           \
    "img-src 'self' blob:; connect-src 'self'; base-uri 'none'; form-action 'none'; "              \
    "frame-ancestors 'none'\r\nReferrer-Policy: no-referrer\r\n"

void bd_http_send_file(struct bd_http *http, const struct bd_viewer_file *file)
{
    bool is_held = bd_http_etag_is_held(http->head.values[BD_HTTP_IF_NONE_MATCH], file->etag);
    size_t size = is_held ? 0 : file->size_bytes;
    struct head head = begin_head_cached(http, is_held ? 304 : 200, file->type, size, "no-cache");
    add(&head, "ETag: %s\r\n" VIEWER_POLICY, file->etag);
    const bool has_body = size > 0 && http->method != BD_HTTP_HEAD;
    uint8_t *text = end_head(&head);
    bd_conn_write_static(&http->conn, text, head.used, has_body ? file->bytes : NULL,
                         has_body ? size : 0);
    bd_http_next(http);
}

// --- frames ---------------------------------------------------------------------------------

static void add_timing(struct head *head, const Bounced__Report *report)
{
    add(head, "Server-Timing: ");
    for (size_t i = 0; i < report->n_passes; i++) {
        const Bounced__ReportPass *pass = report->passes[i];
        bool ran = strcmp(pass->state, "ran") == 0;
        add(head, "%s;dur=%.3f%s, ", pass->name, pass->ms, ran ? "" : ";desc=\"reused\"");
    }
    const Bounced__ReportTime *time = report->time_ms;
    add(head,
        "load;dur=%.3f, compile;dur=%.3f, readback;dur=%.3f, encode;dur=%.3f, "
        "total;dur=%.3f\r\n",
        time->load, time->compile, time->readback, time->encode, time->total);
}

// Names in a report come from a scene: only what a header may hold goes in.
static void add_clean(struct head *head, const char *name, const char *text)
{
    char clean[128];
    size_t used = 0;
    for (; *text && used + 1 < sizeof clean; text++)
        clean[used++] = *text >= 0x20 && *text < 0x7f ? *text : '?';
    clean[used] = 0;
    add(head, "%s: %s\r\n", name, clean);
}

static void send_frame(struct bd_http *http, struct bd_answer *answer)
{
    const Bounced__Report *report = answer->envelope->render_reply->report;
    const char *held = http->head.values[BD_HTTP_IF_NONE_MATCH];
    const bool is_held = answer->etag[0] && bd_http_etag_is_held(held, answer->etag);
    // A frame that has a name may be kept by who asked, and is asked for again by it.
    struct head head =
        begin_head_cached(http, is_held ? 304 : 200, answer->payload_type, answer->payload_bytes,
                          answer->etag[0] ? "private, no-cache" : "no-store");
    if (answer->etag[0]) add(&head, "ETag: %s\r\n", answer->etag);
    if (report->remembered) add(&head, "Bounced-Remembered: 1\r\n");
    add_timing(&head, report);
    add_clean(&head, "Bounced-Scene", report->scene);
    add_clean(&head, "Bounced-Device", report->device->class_);
    add_clean(&head, "Bounced-Stopped", report->stopped);
    for (size_t i = 0; i < report->n_flags; i++) add_clean(&head, "Bounced-Flag", report->flags[i]);
    if (is_held) {
        send_reply(http, &head, NULL, 0);
        return;
    }
    uint8_t *payload = answer->payload;
    answer->payload = NULL;
    send_reply(http, &head, payload, answer->payload_bytes);
}

// --- exports --------------------------------------------------------------------------------

static void send_export(struct bd_http *http, struct bd_answer *answer)
{
    const Bounced__SceneExportReply *reply = answer->envelope->scene_export_reply;
    struct head head = begin_head(http, 200, answer->payload_type, answer->payload_bytes);
    add(&head, "Bounced-Revision: %" PRIu64 "\r\n", reply->revision);
    if (reply->transient) add(&head, "Bounced-Transient: %" PRIu64 "\r\n", reply->transient);
    add_clean(&head, "Bounced-Scene", reply->hash);
    for (size_t i = 0; i < reply->n_flags; i++) add_clean(&head, "Bounced-Flag", reply->flags[i]);
    uint8_t *payload = answer->payload;
    answer->payload = NULL;
    send_reply(http, &head, payload, answer->payload_bytes);
}

// --- by body --------------------------------------------------------------------------------

static void send_blob_reply(struct bd_http *http, const Bounced__BlobReply *reply)
{
    if (reply->n_have > 0) {
        bd_http_send_text(http, 200, NULL, NULL);
        return;
    }
    struct bd_http_refusal refusal = {0};
    bd_err_set(&refusal.detail, BD_ERR_NOT_FOUND, "blob", "there is no such blob");
    bd_http_send_error(http, &refusal);
}

void bd_http_send_answer(struct bd_http *http, struct bd_answer *answer)
{
    Bounced__Envelope *envelope = answer->envelope;
    // All members of the oneof are messages and lie in one place.
    const ProtobufCMessage *body = &envelope->error->base;
    if (envelope->body_case == BOUNCED__ENVELOPE__BODY_ERROR)
        send_message(http, bd_err_http_status(bd_err_from_name(envelope->error->code)), body);
    else if (envelope->body_case == BOUNCED__ENVELOPE__BODY_DONE)
        bd_http_send_text(http, 204, NULL, NULL);
    else if (envelope->body_case == BOUNCED__ENVELOPE__BODY_BLOB_REPLY)
        send_blob_reply(http, envelope->blob_reply);
    else if (envelope->body_case == BOUNCED__ENVELOPE__BODY_RENDER_REPLY && answer->payload)
        send_frame(http, answer);
    else if (envelope->body_case == BOUNCED__ENVELOPE__BODY_RENDER_REPLY)
        send_message(http, 200, &envelope->render_reply->report->base);
    else if (envelope->body_case == BOUNCED__ENVELOPE__BODY_SCENE_EXPORT_REPLY)
        send_export(http, answer);
    else
        send_message(http, http->is_scene_add ? 201 : 200, body);
    bd_answer_finish(answer);
}
