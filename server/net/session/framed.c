#include "net/session/framed.h"

#include <stdlib.h>
#include <unistd.h>

#include "base/assert.h"
#include "net/access/auth.h"
#include "net/session/session.h"
#include "protocol/framing.h"

struct bd_framed {
    struct bd_conn conn;
    struct bd_decoder decoder;
};

// --- a session's transport -----------------------------------------------------------------------

static void send_unit(struct bd_conn *conn, uint8_t *head, size_t head_bytes, uint8_t *payload,
                      size_t payload_bytes)
{
    bd_conn_write(conn, head, head_bytes, payload, payload_bytes);
}

static void finish(struct bd_conn *conn, const struct bd_err_detail *detail)
{
    (void)detail; // told by an error message
    bd_conn_finish(conn);
}

static const struct bd_session_transport transport = {.send = send_unit, .finish = finish};

// --- the connection -------------------------------------------------------------------------

static void on_bytes(struct bd_conn *conn, const uint8_t *bytes, size_t size)
{
    struct bd_framed *framed = (struct bd_framed *)conn;
    struct bd_err_detail detail;
    while (size > 0 && conn->state == BD_CONN_OPEN) {
        size_t taken;
        if (bd_decoder_feed(&framed->decoder, bytes, size, &taken, &detail)) {
            bd_session_give_up(conn->session, &detail);
            return;
        }
        bytes += taken;
        size -= taken;
        struct bd_message message;
        if (!bd_decoder_take(&framed->decoder, &message)) continue;
        bd_session_message(conn->session, &message);
        bd_message_finish(&message);
        if (conn->is_known) bd_decoder_bound(&framed->decoder, 0, NULL);
    }
    if (conn->state == BD_CONN_OPEN) bd_session_update_reading(conn->session);
}

static bool owes(const struct bd_conn *conn)
{
    return !bd_decoder_is_empty(&((const struct bd_framed *)conn)->decoder);
}

static void on_free(struct bd_conn *conn)
{
    struct bd_framed *framed = (struct bd_framed *)conn;
    bd_decoder_finish(&framed->decoder);
    free(framed);
}

static const struct bd_conn_ops framed_ops = {
    BD_SESSION_CONN_OPS,
    .bytes = on_bytes,
    .owes = owes,
    .free = on_free,
};

static struct bd_framed *create(const struct bd_sessions *sessions)
{
    struct bd_framed *framed = calloc(1, sizeof *framed);
    BD_ASSERT(framed);
    framed->conn.ops = &framed_ops;
    const struct bd_limits *limits = &sessions->loop->serving->limits;
    bd_decoder_init(&framed->decoder, limits->message_bytes, limits->header_bytes);
    bd_decoder_bound(&framed->decoder, limits->hello_bytes, "hello_bytes");
    return framed;
}

void bd_framed_accept(struct bd_sessions *sessions, uv_stream_t *listener, bool is_pipe,
                      bool is_proxied)
{
    struct bd_framed *framed = create(sessions);
    if (!bd_conn_accept(sessions->loop, &framed->conn, listener, is_pipe, is_proxied)) return;
    // A proxy on a Unix socket is no user: it asks for others.
    struct bd_session_start start = {.transport = &transport, .is_user = is_pipe && !is_proxied};
    if (start.is_user) start.grant = bd_access_of_user(sessions->access, &framed->conn);
    bd_session_begin(sessions, &framed->conn, &start);
}

bool bd_framed_open_private(struct bd_sessions *sessions, int fd)
{
    struct bd_framed *framed = create(sessions);
    if (!bd_conn_open_fd(sessions->loop, &framed->conn, fd)) return false;
    const struct bd_session_start start = {
        .transport = &transport, .is_private = true, .grant = &bd_grant_of_all};
    bd_session_begin(sessions, &framed->conn, &start);
    return true;
}
