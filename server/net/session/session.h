// A session: what a client does in envelopes, whatever carries them. Hello, requests under way,
// uploads and cancel are here; a transport (framed.c, websocket.c) turns bytes into messages and
// back.
//
// Thread: the event loop's.

#ifndef BD_NET_SESSION_SESSION_H
#define BD_NET_SESSION_SESSION_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/err.h"
#include "net/access/access.h"
#include "net/access/auth.h"
#include "net/command/command.h"
#include "net/loop/conn.h"
#include "protocol/framing.h"

struct bd_session;

// All sessions, and what they have from below. Owned by net.c.
struct bd_sessions {
    struct bd_loop *loop;
    struct bd_access *access;
    struct bd_commands *commands;
    struct bd_session *list; // those that have ended too, until they are swept
    uint64_t kept_bytes;     // of answers, for sessions that may be resumed
};

// How a transport carries envelopes.
struct bd_session_transport {
    // One unit. `head` is what bd_envelope_encode makes, `total` included; both are malloc'ed and
    // the callee's from now on; `payload` may be NULL.
    void (*send)(struct bd_conn *conn, uint8_t *head, size_t head_bytes, uint8_t *payload,
                 size_t payload_bytes);
    // Says goodbye behind what was sent. `detail`: why, or NULL.
    void (*finish)(struct bd_conn *conn, const struct bd_err_detail *detail);
};

struct bd_session_start {
    const struct bd_session_transport *transport;
    bool says_goodbye; // the transport has a close of its own: what breaks without one may be
                       // resumed
    bool is_private;   // the private daemon's one connection: never silent for too long
    const struct bd_grant *grant; // NULL: by the token that hello shows
    bool is_user; // of this machine: refused without a grant where no token could give one
};

// A new session on an open connection, as conn->session.
void bd_session_begin(struct bd_sessions *sessions, struct bd_conn *conn,
                      const struct bd_session_start *start);

// One message arrived. It may end the connection.
void bd_session_message(struct bd_session *session, const struct bd_message *message);

// The stream means nothing any more: one last error, with no request to belong to, and the end.
void bd_session_give_up(struct bd_session *session, const struct bd_err_detail *detail);

// Room for more, or none: goes on or stops reading.
void bd_session_update_reading(struct bd_session *session);

// --- a connection's own events (bd_conn_ops), for every transport that has a session ---

uint64_t bd_session_patience_s(const struct bd_conn *conn);
void bd_session_silent(struct bd_conn *conn);
void bd_session_drain(struct bd_conn *conn);
// Something has left: reads on if it had stopped, and what waited for room goes on.
void bd_session_written(struct bd_conn *conn);
// The connection is no more. The session ends with it, unless it may be resumed and neither side
// has said goodbye: then it waits for another connection for resume_seconds.
void bd_session_gone(struct bd_conn *conn);

// The same as members of a struct bd_conn_ops.
#define BD_SESSION_CONN_OPS                                                                        \
    .patience_s = bd_session_patience_s, .silent = bd_session_silent, .drain = bd_session_drain,   \
    .written = bd_session_written, .gone = bd_session_gone

// Those whose grant is revoked end, and say why where they have a connection: it closes. Those that
// wait for one are gone.
void bd_sessions_revoke(struct bd_sessions *sessions);

// Frees sessions that have ended. Not from within one of their callbacks.
void bd_sessions_sweep(struct bd_sessions *sessions);

#endif
