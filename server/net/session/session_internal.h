// What the files of a session share: its state.

#ifndef BD_NET_SESSION_SESSION_INTERNAL_H
#define BD_NET_SESSION_SESSION_INTERNAL_H

#include "base/hash.h"
#include "net/command/command.h"
#include "net/session/session.h"

struct bd_session_request; // under way
struct bd_session_upload;  // a blob on its way in
struct bd_session_kept;
struct bd_session_view;
struct bd_session_watch;

struct bd_session {
    struct bd_sessions *sessions;
    struct bd_loop *loop; // theirs
    struct bd_client *client;
    struct bd_conn *conn; // NULL once it is gone
    const struct bd_session_transport *transport;
    const struct bd_grant *grant; // what the client may do; NULL before a hello that needs a token
    bool greeted, is_private, says_goodbye, is_user;
    bool is_resumable; // outlives its connection by resume_seconds
    uint8_t token_digest[BD_SHA256_BYTES];
    // The token that the client is known to have: the answer with the newer one may be lost.
    bool has_older_token;
    uint8_t older_digest[BD_SHA256_BYTES];
    uint64_t parked_until_ns;                 // 0: it has a connection
    struct bd_session_kept *kept, **kept_end; // answers, oldest first
    bool has_ended;                           // swept once the loop is at rest
    struct bd_session_request *requests;
    uint32_t request_count;
    struct bd_session_upload *uploads;
    uint32_t upload_count;
    struct bd_session_view *views;
    uint32_t view_count, view_number;
    struct bd_session_watch *watches;
    uint32_t watch_count;
    struct bd_session *next; // bd_sessions.list
};

// Sends under this id and takes what is in `answer`.
void bd_session_send(struct bd_session *session, uint64_t request_id, struct bd_answer *answer);
void bd_session_send_error(struct bd_session *session, uint64_t request_id,
                           const struct bd_err_detail *detail);

// The same for what has no meaning any more once its moment is over.
void bd_session_send_event(struct bd_session *session, uint64_t request_id,
                           struct bd_answer *answer);

// The last thing that the connection hears, with the reason or NULL.
void bd_session_finish(struct bd_session *session, const struct bd_err_detail *detail);
// The connection and the session go separate ways.
void bd_session_leave_conn(struct bd_session *session);
// Nothing of it goes on. Its memory stays until the loop is at rest.
void bd_session_end(struct bd_session *session);
// The ids of its requests, request_count of them.
void bd_session_request_ids(const struct bd_session *session, uint64_t *out);

// Bytes that wait for the peer to read.
size_t bd_session_unsent_bytes(const struct bd_session *session);

// --- session_view.c ---

void bd_session_open_view(struct bd_session *session, const Bounced__Envelope *envelope);
void bd_session_update_view(struct bd_session *session, const Bounced__Envelope *envelope);
void bd_session_close_view(struct bd_session *session, const Bounced__Envelope *envelope);
void bd_session_credit_view(struct bd_session *session, const Bounced__ViewCredit *credit);
// By the request that opened it.
bool bd_session_has_view(const struct bd_session *session, uint64_t request_id);
void bd_session_end_view(struct bd_session *session, uint64_t request_id);
// The ids of the requests that opened them, view_count of them.
void bd_session_view_ids(const struct bd_session *session, uint64_t *out);
// There is room again; `restart`: the peer came back, and has lost what was under way to it.
void bd_session_wake_views(struct bd_session *session, bool restart);
void bd_session_end_views(struct bd_session *session);

// --- session_watch.c ---

void bd_session_watch(struct bd_session *session, const Bounced__Envelope *envelope);
bool bd_session_has_watch(const struct bd_session *session, uint64_t request_id);
void bd_session_end_watch(struct bd_session *session, uint64_t request_id);
// The same of watches, watch_count of them.
void bd_session_watch_ids(const struct bd_session *session, uint64_t *out);
void bd_session_end_watches(struct bd_session *session);
// There is room again: says what was missed.
void bd_session_flush_watches(struct bd_session *session);

// --- session_upload.c ---

// One piece, answered now or, the last one, once the blob is kept.
void bd_session_put_piece(struct bd_session *session, const Bounced__Envelope *envelope,
                          const struct bd_message *message);
// Does the disk keep up with every upload?
bool bd_session_uploads_have_room(const struct bd_session *session);
void bd_session_forget_uploads(struct bd_session *session);

// --- session_kept.c ---

// Keeps a copy of an answer whose envelope is encoded as `head`: if there is no room for it and it
// is not on its way either, an error in its place.
void bd_session_keep(struct bd_session *session, const struct bd_answer *answer,
                     const uint8_t *head, size_t head_bytes);
void bd_session_resend(struct bd_session *session);
void bd_session_forget_kept(struct bd_session *session);
// Those that were sent resume_seconds before the client was last heard, and more.
void bd_session_forget_arrived(struct bd_session *session);

// A new one; the one before it is good until bd_session_has_token.
void bd_session_make_token(struct bd_session *session, char out[BD_SHA256_HEX]);
// The client speaks, so that the answer with its token has arrived: the one before is spent.
void bd_session_has_token(struct bd_session *session);
// A goodbye of either side ends it; a connection that broke leaves it waiting for the next one, if
// not too many wait already.
bool bd_session_may_be_resumed(const struct bd_session *session, const struct bd_conn *conn);
// The connection of this session, which has done nothing yet, goes on with the one that `hello`
// names, if there is one with the same rights: this one has ended then. Otherwise false.
BD_MUST_CHECK
bool bd_session_resume(struct bd_session *session, uint64_t request_id,
                       const Bounced__Hello *hello);

// --- session_hello.c ---

// Who asks, and what the server says of itself. The connection may go on with another session.
void bd_session_greet(struct bd_session *session, const Bounced__Envelope *envelope);
void bd_session_welcome(struct bd_session *session, uint64_t request_id,
                        const Bounced__Hello *hello, bool was_resumed);

#endif
