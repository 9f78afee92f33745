#include "net/http/websocket.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <wslay/wslay.h>

#include "base/assert.h"
#include "base/clock.h"
#include "net/http/ws_accept.h"
#include "net/session/session.h"

#define LENGTH_BYTES     4 // of header_len
#define FIRST_ROOM_BYTES 4096
#define REASON_BYTES_MAX 120

struct bd_websocket {
    struct bd_conn *conn;
    wslay_event_context_ptr events; // what comes, and control frames that go
    wslay_frame_context_ptr frames; // messages that go
    const uint8_t *in;              // bytes that arrived, during on_bytes
    size_t in_bytes;

    uint8_t *buffer; // of the message that is coming
    size_t used, room;
    uint8_t opcode;
    bool is_refused; // its message: the connection ends

    uint8_t *out; // the start of the frame that is being made: its head and the envelope's
    size_t out_bytes;
    const uint8_t *payload; // what follows it uncopied
    uint8_t *control;       // frames that go together
    size_t control_bytes;
    uint64_t pinged_ns;
};

static struct bd_websocket *of(const struct bd_conn *conn)
{
    return ((const struct bd_http *)conn)->websocket;
}

static bool is_open(const struct bd_websocket *websocket)
{
    return websocket->conn->state == BD_CONN_OPEN;
}

// --- sending --------------------------------------------------------------------------------

static void extend(uint8_t **out, size_t *out_bytes, const uint8_t *bytes, size_t size)
{
    *out = realloc(*out, *out_bytes + size);
    BD_ASSERT(*out);
    memcpy(*out + *out_bytes, bytes, size);
    *out_bytes += size;
}

// Control frames: small, and libwslay comes twice for each. What one flush gives is one write.
static ssize_t on_send(wslay_event_context_ptr events, const uint8_t *bytes, size_t size, int flags,
                       void *user)
{
    (void)events;
    (void)flags;
    struct bd_websocket *websocket = user;
    extend(&websocket->control, &websocket->control_bytes, bytes, size);
    return (ssize_t)size;
}

static ssize_t on_frame_send(const uint8_t *bytes, size_t size, int flags, void *user)
{
    (void)flags;
    struct bd_websocket *websocket = user;
    if (bytes == websocket->payload) return (ssize_t)size; // goes as it is, behind `out`
    extend(&websocket->out, &websocket->out_bytes, bytes, size);
    return (ssize_t)size;
}

static void add_to_frame(struct bd_websocket *websocket, struct wslay_frame_iocb *iocb,
                         const uint8_t *bytes, size_t size)
{
    iocb->data = bytes;
    iocb->data_length = size;
    ssize_t sent = wslay_frame_send(websocket->frames, iocb);
    BD_ASSERT_CMP(sent, ==, (ssize_t)size);
}

static void send_unit(struct bd_conn *conn, uint8_t *head, size_t head_bytes, uint8_t *payload,
                      size_t payload_bytes)
{
    struct bd_websocket *websocket = of(conn);
    // A message says its own length: `total` stays behind.
    const uint8_t *start = head + BD_FRAMING_PREFIX_BYTES - LENGTH_BYTES;
    size_t start_bytes = head_bytes - (BD_FRAMING_PREFIX_BYTES - LENGTH_BYTES);
    struct wslay_frame_iocb iocb = {
        .fin = 1, .opcode = WSLAY_BINARY_FRAME, .payload_length = start_bytes + payload_bytes};
    websocket->payload = payload;
    add_to_frame(websocket, &iocb, start, start_bytes);
    if (payload_bytes > 0) add_to_frame(websocket, &iocb, payload, payload_bytes);
    bd_conn_write(conn, websocket->out, websocket->out_bytes, payload, payload_bytes);
    free(head);
    websocket->out = NULL;
    websocket->out_bytes = 0;
    websocket->payload = NULL;
}

static void flush(struct bd_websocket *websocket)
{
    if (!is_open(websocket) || !wslay_event_want_write(websocket->events)) return;
    if (wslay_event_send(websocket->events) != 0) websocket->conn->is_broken = true;
    if (!websocket->control) return;
    bd_conn_write(websocket->conn, websocket->control, websocket->control_bytes, NULL, 0);
    websocket->control = NULL;
    websocket->control_bytes = 0;
}

static void close_with(struct bd_websocket *websocket, uint16_t code, const char *why)
{
    uint8_t reason[REASON_BYTES_MAX];
    size_t size = 0;
    // A reason is UTF-8, and what we quote from a peer may not be.
    for (; why[size] && size < sizeof reason; size++)
        reason[size] = why[size] >= 0x20 && why[size] < 0x7f ? (uint8_t)why[size] : '?';
    if (wslay_event_queue_close(websocket->events, code, reason, size) != 0) return;
    flush(websocket);
}

static uint16_t code_of(const struct bd_err_detail *detail)
{
    if (!detail) return WSLAY_CODE_GOING_AWAY;
    if (detail->err == BD_ERR_LIMIT) return WSLAY_CODE_MESSAGE_TOO_BIG;
    if (detail->err == BD_ERR_BAD_INPUT) return WSLAY_CODE_INVALID_FRAME_PAYLOAD_DATA;
    return WSLAY_CODE_POLICY_VIOLATION;
}

static void finish(struct bd_conn *conn, const struct bd_err_detail *detail)
{
    close_with(of(conn), code_of(detail), detail ? detail->message : "the server is shutting down");
    bd_conn_finish(conn);
}

static const struct bd_session_transport transport = {.send = send_unit, .finish = finish};

// --- receiving ------------------------------------------------------------------------------

static ssize_t on_recv(wslay_event_context_ptr events, uint8_t *out, size_t size, int flags,
                       void *user)
{
    (void)flags;
    struct bd_websocket *websocket = user;
    if (size > websocket->in_bytes) size = websocket->in_bytes;
    if (size == 0 || !is_open(websocket)) {
        wslay_event_set_error(events, WSLAY_ERR_WOULDBLOCK);
        return -1;
    }
    memcpy(out, websocket->in, size);
    websocket->in += size;
    websocket->in_bytes -= size;
    return (ssize_t)size;
}

static void refuse(struct bd_websocket *websocket, const struct bd_err_detail *detail)
{
    websocket->is_refused = true;
    bd_session_give_up(websocket->conn->session, detail);
}

// What a frame promises is checked before a byte of it is kept.
static void on_frame_start(wslay_event_context_ptr events,
                           const struct wslay_event_on_frame_recv_start_arg *frame, void *user)
{
    (void)events;
    struct bd_websocket *websocket = user;
    struct bd_err_detail detail;
    const struct bd_limits *limits = &websocket->conn->loop->serving->limits;
    const bool is_known = websocket->conn->is_known;
    const uint64_t most = is_known ? limits->message_bytes : limits->hello_bytes;
    const char *name = is_known ? "message_bytes" : "hello_bytes";
    if (wslay_is_ctrl_frame(frame->opcode)) {
        websocket->opcode = frame->opcode;
        return;
    }
    websocket->opcode = WSLAY_BINARY_FRAME;
    if (websocket->is_refused || !is_open(websocket)) return;
    if (frame->opcode == WSLAY_TEXT_FRAME) {
        websocket->is_refused = true;
        close_with(websocket, WSLAY_CODE_UNSUPPORTED_DATA, "messages here are binary");
        bd_conn_finish(websocket->conn);
    } else if (websocket->used > most || frame->payload_length > most - websocket->used) {
        bd_err_set(&detail, BD_ERR_LIMIT, name,
                   "a message of more than %llu bytes is above the limit %s",
                   (unsigned long long)most, name);
        refuse(websocket, &detail);
    }
}

static void append(struct bd_websocket *websocket, const uint8_t *bytes, size_t size)
{
    if (size == 0) return; // the first fragment may be empty, and there is no buffer yet
    size_t needed = websocket->used + size;
    if (needed > websocket->room) {
        size_t room = websocket->room ? 2 * websocket->room : FIRST_ROOM_BYTES;
        websocket->room = room < needed ? needed : room;
        websocket->buffer = realloc(websocket->buffer, websocket->room);
        BD_ASSERT(websocket->buffer);
    }
    memcpy(websocket->buffer + websocket->used, bytes, size);
    websocket->used = needed;
}

static uint32_t header_bytes_of(const struct bd_websocket *websocket)
{
    const uint8_t *b = websocket->buffer;
    return (uint32_t)b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24;
}

static void check_header_length(struct bd_websocket *websocket)
{
    uint64_t most = websocket->conn->loop->serving->limits.header_bytes;
    struct bd_err_detail detail;
    if (websocket->used < LENGTH_BYTES || header_bytes_of(websocket) <= most) return;
    bd_err_set(&detail, BD_ERR_LIMIT, "header_bytes",
               "a header of %u bytes is above the limit header_bytes of %llu",
               header_bytes_of(websocket), (unsigned long long)most);
    refuse(websocket, &detail);
}

static void on_frame_chunk(wslay_event_context_ptr events,
                           const struct wslay_event_on_frame_recv_chunk_arg *chunk, void *user)
{
    (void)events;
    struct bd_websocket *websocket = user;
    if (wslay_is_ctrl_frame(websocket->opcode) || websocket->is_refused) return;
    if (!is_open(websocket)) return;
    append(websocket, chunk->data, chunk->data_length);
    check_header_length(websocket);
}

static void take_message(struct bd_websocket *websocket)
{
    struct bd_err_detail detail;
    if (websocket->used < LENGTH_BYTES ||
        header_bytes_of(websocket) > websocket->used - LENGTH_BYTES) {
        bd_err_set(&detail, BD_ERR_BAD_INPUT, "header_len",
                   "a message of %zu bytes is shorter than the header that it promises",
                   websocket->used);
        refuse(websocket, &detail);
        return;
    }
    struct bd_message message = {.buffer = websocket->buffer,
                                 .header = websocket->buffer + LENGTH_BYTES,
                                 .header_bytes = header_bytes_of(websocket)};
    message.payload = message.header + message.header_bytes;
    message.payload_bytes = websocket->used - LENGTH_BYTES - message.header_bytes;
    websocket->buffer = NULL;
    websocket->used = websocket->room = 0;
    bd_session_message(websocket->conn->session, &message);
    bd_message_finish(&message);
}

static void on_message(wslay_event_context_ptr events,
                       const struct wslay_event_on_msg_recv_arg *arg, void *user)
{
    (void)events;
    struct bd_websocket *websocket = user;
    if (arg->opcode != WSLAY_BINARY_FRAME || websocket->is_refused || !is_open(websocket)) return;
    take_message(websocket);
}

// --- the connection -------------------------------------------------------------------------

static void on_bytes(struct bd_conn *conn, const uint8_t *bytes, size_t size)
{
    struct bd_websocket *websocket = of(conn);
    websocket->in = bytes;
    websocket->in_bytes = size;
    bool failed = wslay_event_recv(websocket->events) != 0;
    websocket->in = NULL;
    websocket->in_bytes = 0;
    if (conn->state != BD_CONN_OPEN) return;
    flush(websocket);
    // A close that came and was answered, or a breach of the framing that was.
    if (failed || !wslay_event_get_read_enabled(websocket->events))
        bd_conn_finish(conn);
    else
        bd_session_update_reading(conn->session);
}

static bool owes(const struct bd_conn *conn)
{
    return of(conn)->used > 0;
}

// A peer whose network has vanished says nothing, and neither does one that looks at a still
// picture: only a ping tells them apart.
static void on_tick(struct bd_conn *conn)
{
    struct bd_websocket *websocket = of(conn);
    uint64_t now_ns = bd_clock_ns();
    uint64_t idle_ns = conn->loop->serving->limits.idle_seconds * 1000000000u;
    if (conn->clock_runs) return; // hello comes first, and has a clock of its own
    bool is_asked = websocket->pinged_ns > conn->heard_ns;
    if (is_asked && now_ns - websocket->pinged_ns > idle_ns / 2) {
        bd_conn_kill(conn);
    } else if (!is_asked && now_ns - conn->heard_ns > idle_ns / 2) {
        const struct wslay_event_msg ping = {.opcode = WSLAY_PING};
        websocket->pinged_ns = now_ns;
        if (wslay_event_queue_msg(websocket->events, &ping) == 0) flush(websocket);
    }
}

static const struct bd_conn_ops websocket_ops = {
    BD_SESSION_CONN_OPS, .bytes = on_bytes, .owes = owes, .tick = on_tick, .free = bd_http_free,
};

// libwslay's buffering mode allocates what a frame's head promises; its event interface copies what
// is sent; it tells of a frame only with the first byte of its content, and closes without a code
// where the frame itself is broken.
static struct bd_websocket *create(struct bd_conn *conn)
{
    static const struct wslay_event_callbacks event_callbacks = {
        .recv_callback = on_recv,
        .send_callback = on_send,
        .on_frame_recv_start_callback = on_frame_start,
        .on_frame_recv_chunk_callback = on_frame_chunk,
        .on_msg_recv_callback = on_message,
    };
    static const struct wslay_frame_callbacks frame_callbacks = {.send_callback = on_frame_send};
    struct bd_websocket *websocket = calloc(1, sizeof *websocket);
    BD_ASSERT(websocket);
    websocket->conn = conn;
    int failed = wslay_event_context_server_init(&websocket->events, &event_callbacks, websocket);
    BD_ASSERT_CMP(failed, ==, 0);
    failed = wslay_frame_context_init(&websocket->frames, &frame_callbacks, websocket);
    BD_ASSERT_CMP(failed, ==, 0);
    wslay_event_config_set_no_buffering(websocket->events, 1);
    // Ours is checked in on_frame_start, where it can be named.
    wslay_event_config_set_max_recv_msg_length(websocket->events, INT64_MAX);
    return websocket;
}

void bd_websocket_destroy(struct bd_websocket **address)
{
    struct bd_websocket *websocket = *address;
    *address = NULL;
    if (!websocket) return;
    wslay_event_context_free(websocket->events);
    wslay_frame_context_free(websocket->frames);
    free(websocket->buffer);
    free(websocket);
}

static void send_accept(struct bd_http *http)
{
    char accept[BD_WS_ACCEPT_BYTES], head[256];
    bd_ws_accept(http->head.values[BD_HTTP_WS_KEY], accept);
    snprintf(head, sizeof head,
             "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
             "Sec-WebSocket-Accept: %s\r\nSec-WebSocket-Protocol: " BD_WS_PROTOCOL "\r\n\r\n",
             accept);
    bd_conn_write(&http->conn, (uint8_t *)bd_answer_text(head), strlen(head), NULL, 0);
}

void bd_websocket_begin(struct bd_http *http)
{
    const struct bd_session_start start = {
        .transport = &transport, .says_goodbye = true, .grant = http->grant};
    send_accept(http);
    http->websocket = create(&http->conn);
    http->conn.ops = &websocket_ops;
    http->conn.is_known = false; // until hello, as on every transport
    bd_session_begin(http->web->sessions, &http->conn, &start);
    bd_conn_touch(&http->conn);
}
