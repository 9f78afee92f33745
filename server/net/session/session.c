#include "net/session/session.h"

#include <stdlib.h>

#include "base/assert.h"
#include "base/clock.h"
#include "base/log.h"
#include "net/session/session_internal.h"
#include "protocol/wire.h"

// A peer that does not read its answers sends no more requests.
#define UNSENT_BYTES_MAX (64u << 20)

// One request under way.
struct bd_session_request {
    struct bd_session *session;
    uint64_t id;
    struct bd_command *command;
    struct bd_session_request *next;
};

// --- sending --------------------------------------------------------------------------------

static void send_now(struct bd_session *session, struct bd_answer *answer, bool is_kept)
{
    uint8_t *head;
    size_t head_bytes;
    bd_envelope_encode(answer->envelope, answer->payload_bytes, &head, &head_bytes);
    if (is_kept) bd_session_keep(session, answer, head, head_bytes);
    if (session->conn) {
        session->transport->send(session->conn, head, head_bytes, answer->payload,
                                 answer->payload_bytes);
        answer->payload = NULL;
    } else {
        free(head);
    }
    bd_answer_finish(answer);
}

void bd_session_send(struct bd_session *session, uint64_t request_id, struct bd_answer *answer)
{
    BD_SET(answer->envelope, request_id, request_id);
    send_now(session, answer, session->is_resumable && request_id != 0);
}

void bd_session_send_event(struct bd_session *session, uint64_t request_id,
                           struct bd_answer *answer)
{
    BD_SET(answer->envelope, request_id, request_id);
    send_now(session, answer, false);
}

size_t bd_session_unsent_bytes(const struct bd_session *session)
{
    return session->conn ? bd_conn_unsent_bytes(session->conn) : SIZE_MAX;
}

void bd_session_send_error(struct bd_session *session, uint64_t request_id,
                           const struct bd_err_detail *detail)
{
    struct bd_answer answer = bd_answer_error(detail);
    session->loop->counts.requests_refused++;
    bd_session_send(session, request_id, &answer);
}

void bd_session_update_reading(struct bd_session *session)
{
    struct bd_conn *conn = session->conn;
    if (!conn || conn->state != BD_CONN_OPEN) return;
    bool has_room =
        bd_conn_takes_more(conn, UNSENT_BYTES_MAX) && bd_session_uploads_have_room(session);
    bd_conn_read(conn, has_room);
}

void bd_session_written(struct bd_conn *conn)
{
    struct bd_session *session = conn->session;
    bd_session_update_reading(session);
    bd_session_flush_watches(session);
    bd_session_wake_views(session, false);
}

void bd_session_finish(struct bd_session *session, const struct bd_err_detail *detail)
{
    if (session->conn) session->transport->finish(session->conn, detail);
}

// --- commands -------------------------------------------------------------------------------

static struct bd_session_request *find_request(const struct bd_session *session, uint64_t id)
{
    struct bd_session_request *request = session->requests;
    while (request && request->id != id) request = request->next;
    return request;
}

void bd_session_request_ids(const struct bd_session *session, uint64_t *out)
{
    for (const struct bd_session_request *at = session->requests; at; at = at->next)
        *out++ = at->id;
}

static void forget_request(struct bd_session_request *request)
{
    struct bd_session *session = request->session;
    struct bd_session_request **at = &session->requests;
    while (*at != request) at = &(*at)->next;
    *at = request->next;
    session->request_count--;
    free(request);
}

static void on_answer(void *user, struct bd_answer *answer)
{
    struct bd_session_request *request = user;
    struct bd_session *session = request->session;
    bd_session_send(session, request->id, answer);
    forget_request(request);
    bd_session_update_reading(session);
}

static void on_progress(void *user, const char *stage, double share)
{
    struct bd_session_request *request = user;
    Bounced__Progress *progress = malloc(sizeof *progress);
    BD_ASSERT(progress);
    bounced__progress__init(progress);
    progress->stage = bd_answer_text(stage);
    if (share >= 0) BD_SET(progress, share, share);
    struct bd_answer event = bd_answer_of(BOUNCED__ENVELOPE__BODY_PROGRESS, progress);
    bd_session_send_event(request->session, request->id, &event);
}

static const struct bd_command_events plain_events = {on_answer, NULL};
static const struct bd_command_events progress_events = {on_answer, on_progress};

static enum bd_err check_request(const struct bd_session *session, uint64_t id,
                                 struct bd_err_detail *detail)
{
    if (id == 0)
        return bd_err_set(detail, BD_ERR_USAGE, "request_id", "a request needs an id other than 0");
    if (find_request(session, id) || bd_session_has_view(session, id) ||
        bd_session_has_watch(session, id))
        return bd_err_set(detail, BD_ERR_CONFLICT, "request_id",
                          "request %llu is under way already", (unsigned long long)id);
    if (session->request_count >= session->loop->serving->limits.requests_per_connection)
        return bd_err_set(detail, BD_ERR_BUSY, "requests_per_connection",
                          "%u requests are under way on this connection (limit "
                          "requests_per_connection)",
                          session->request_count);
    return BD_ERR_OK;
}

// Takes the envelope.
static void start_command(struct bd_session *session, Bounced__Envelope *envelope,
                          const struct bd_message *message)
{
    struct bd_session_request *request = malloc(sizeof *request);
    BD_ASSERT(request);
    *request = (struct bd_session_request){
        .session = session, .id = envelope->request_id, .next = session->requests};
    session->requests = request;
    session->request_count++;
    bool progress =
        envelope->body_case == BOUNCED__ENVELOPE__BODY_RENDER && envelope->render->progress;
    struct bd_command_start start = {.commands = session->sessions->commands,
                                     .client = session->client,
                                     .grant = session->grant,
                                     .payload = message->payload,
                                     .payload_bytes = message->payload_bytes,
                                     .envelope = envelope,
                                     .events = progress ? &progress_events : &plain_events,
                                     .user = request};
    struct bd_command *command = bd_command_start(&start);
    if (command) request->command = command;
}

static void cancel(struct bd_session *session, const Bounced__Envelope *envelope)
{
    struct bd_session_request *request = find_request(session, envelope->cancel->request_id);
    if (request) bd_command_cancel(request->command);
    bd_session_end_view(session, envelope->cancel->request_id);
    bd_session_end_watch(session, envelope->cancel->request_id);
    struct bd_answer answer = bd_answer_done();
    bd_session_send(session, envelope->request_id, &answer);
}

// --- messages -------------------------------------------------------------------------------

// A cancel costs nothing: it ends what does.
static enum bd_err take_request(struct bd_session *session, const Bounced__Envelope *envelope,
                                struct bd_err_detail *detail)
{
    struct bd_sessions *sessions = session->sessions;
    if (envelope->body_case == BOUNCED__ENVELOPE__BODY_CANCEL) return BD_ERR_OK;
    sessions->loop->counts.requests++;
    // Whose it is, hello says itself.
    if (envelope->body_case == BOUNCED__ENVELOPE__BODY_HELLO) return BD_ERR_OK;
    return bd_client_take_request(sessions->loop->clients, session->client, detail);
}

// True if a request may be taken; otherwise it has been answered. The bucket comes first: a flood
// of nonsense empties it like any other.
static bool admit(struct bd_session *session, const Bounced__Envelope *envelope)
{
    struct bd_err_detail detail;
    enum bd_err err = take_request(session, envelope, &detail);
    if (!err) err = check_request(session, envelope->request_id, &detail);
    if (err) bd_session_send_error(session, envelope->request_id, &detail);
    return !err;
}

// Whether a request that belongs to the session itself was taken care of.
static bool handle_here(struct bd_session *session, const Bounced__Envelope *envelope,
                        const struct bd_message *message)
{
    switch ((int)envelope->body_case) {
    case BOUNCED__ENVELOPE__BODY_HELLO:
        bd_session_greet(session, envelope);
        return true;
    case BOUNCED__ENVELOPE__BODY_BLOB_PUT:
        bd_session_put_piece(session, envelope, message);
        return true;
    case BOUNCED__ENVELOPE__BODY_CANCEL:
        cancel(session, envelope);
        return true;
    case BOUNCED__ENVELOPE__BODY_SCENE_WATCH:
        bd_session_watch(session, envelope);
        return true;
    case BOUNCED__ENVELOPE__BODY_VIEW_OPEN:
        bd_session_open_view(session, envelope);
        return true;
    case BOUNCED__ENVELOPE__BODY_VIEW_UPDATE:
        bd_session_update_view(session, envelope);
        return true;
    case BOUNCED__ENVELOPE__BODY_VIEW_CLOSE:
        bd_session_close_view(session, envelope);
        return true;
    default:
        return false;
    }
}

// Takes the envelope.
static void handle(struct bd_session *session, Bounced__Envelope *envelope,
                   const struct bd_message *message)
{
    struct bd_err_detail detail;
    Bounced__Envelope__BodyCase body = envelope->body_case;
    bool is_taken = false;
    if (body != BOUNCED__ENVELOPE__BODY_HELLO) bd_session_has_token(session);
    if (!session->greeted && body != BOUNCED__ENVELOPE__BODY_HELLO) {
        bd_err_set(&detail, BD_ERR_USAGE, "hello", "the first message of a connection is hello");
        bd_session_send_error(session, envelope->request_id, &detail);
        bd_session_finish(session, &detail);
    } else if (body == BOUNCED__ENVELOPE__BODY_VIEW_CREDIT) {
        bd_session_credit_view(session, envelope->view_credit);
    } else if (admit(session, envelope)) {
        enum bd_err err = bd_wire_check_text(&bounced__envelope__descriptor, message->header,
                                             message->header_bytes, &detail);
        if (err) bd_session_send_error(session, envelope->request_id, &detail);
        is_taken = !err && !handle_here(session, envelope, message);
        if (is_taken) start_command(session, envelope, message);
    }
    if (!is_taken) bounced__envelope__free_unpacked(envelope, NULL);
}

void bd_session_message(struct bd_session *session, const struct bd_message *message)
{
    Bounced__Envelope *envelope;
    struct bd_err_detail detail;
    if (bd_envelope_decode(message->header, message->header_bytes, &envelope, &detail))
        bd_session_give_up(session, &detail);
    else
        handle(session, envelope, message);
}

void bd_session_give_up(struct bd_session *session, const struct bd_err_detail *detail)
{
    bd_log(BD_LOG_DEBUG, "net/session", "%s: %s", session->client->key, detail->message);
    bd_session_send_error(session, 0, detail);
    bd_session_finish(session, detail);
}

// --- the connection's events ----------------------------------------------------------------

uint64_t bd_session_patience_s(const struct bd_conn *conn)
{
    const struct bd_session *session = conn->session;
    const struct bd_limits *limits = &session->loop->serving->limits;
    if (!session->greeted && !session->is_private) return limits->header_seconds;
    if (bd_conn_unsent_bytes(conn) > 0) return limits->idle_seconds;
    // While we compute, or hold it back from sending, silence is not its fault.
    if (session->is_private || session->requests || !conn->reading) return 0;
    if (session->views || session->watches) return 0; // a still picture is no news
    return limits->idle_seconds;
}

void bd_session_silent(struct bd_conn *conn)
{
    struct bd_session *session = conn->session;
    struct bd_err_detail detail;
    if (!session->greeted)
        bd_err_set(&detail, BD_ERR_DEADLINE, "header_seconds",
                   "hello took too long (limit header_seconds)");
    else if (conn->is_slow)
        bd_err_set(&detail, BD_ERR_DEADLINE, "slow_bytes_per_second",
                   "a message came too slowly (limit slow_bytes_per_second)");
    else
        bd_err_set(&detail, BD_ERR_DEADLINE, "idle_seconds",
                   "the connection was idle for too long (limit idle_seconds)");
    bd_session_give_up(session, &detail);
}

void bd_session_drain(struct bd_conn *conn)
{
    struct bd_session *session = conn->session;
    if (!session->requests) bd_session_finish(session, NULL);
}

// --- its life -------------------------------------------------------------------------------

void bd_session_begin(struct bd_sessions *sessions, struct bd_conn *conn,
                      const struct bd_session_start *start)
{
    struct bd_session *session = calloc(1, sizeof *session);
    BD_ASSERT(session);
    *session = (struct bd_session){.sessions = sessions,
                                   .loop = sessions->loop,
                                   .client = conn->client,
                                   .conn = conn,
                                   .transport = start->transport,
                                   .is_private = start->is_private,
                                   .says_goodbye = start->says_goodbye,
                                   .grant = start->grant,
                                   .is_user = start->is_user,
                                   .next = sessions->list};
    bd_client_retain(session->client);
    session->kept_end = &session->kept;
    conn->session = sessions->list = session;
    conn->clock_runs = !start->is_private;
}

// Whoever calls may be in the middle of one of its messages, which still has to find its memory.
void bd_session_end(struct bd_session *session)
{
    while (session->requests) {
        struct bd_session_request *request = session->requests;
        if (request->command) bd_command_abandon(request->command);
        forget_request(request);
    }
    bd_session_forget_uploads(session);
    bd_session_forget_kept(session);
    bd_session_end_views(session);
    bd_session_end_watches(session);
    session->has_ended = true;
}

// Uploads go on in one connection or not at all.
void bd_session_leave_conn(struct bd_session *session)
{
    session->conn->session = NULL;
    session->conn = NULL;
    bd_session_forget_uploads(session);
}

void bd_session_gone(struct bd_conn *conn)
{
    struct bd_session *session = conn->session;
    const struct bd_limits *limits = &conn->loop->serving->limits;
    if (!session) return; // another connection has it
    bd_session_leave_conn(session);
    if (bd_session_may_be_resumed(session, conn))
        session->parked_until_ns = bd_clock_ns() + limits->resume_seconds * 1000000000u;
    else
        bd_session_end(session);
}

// Nobody has come back for it.
static bool is_over(const struct bd_session *session)
{
    if (session->has_ended || session->conn) return false;
    return session->loop->draining || bd_clock_ns() > session->parked_until_ns;
}

// A user's line may be as it was while another, which comes before it, is new.
static bool is_out(const struct bd_session *session)
{
    const struct bd_grant *grant = session->grant;
    if (!grant || grant->is_revoked) return grant != NULL;
    const bool is_by_user = session->is_user && !grant->is_token && session->conn;
    return is_by_user && bd_access_of_user(session->sessions->access, session->conn) != grant;
}

void bd_sessions_revoke(struct bd_sessions *sessions)
{
    struct bd_err_detail detail;
    bd_err_set(&detail, BD_ERR_UNAUTHORIZED, "token",
               "the token is not one of ours any more, or has other rights: begin again");
    // Giving up sends and closes, and takes nobody out of the list.
    for (struct bd_session *session = sessions->list; session; session = session->next) {
        if (session->has_ended || !is_out(session)) continue;
        session->is_resumable = false;
        if (session->conn)
            bd_session_give_up(session, &detail);
        else
            bd_session_end(session);
    }
}

void bd_sessions_sweep(struct bd_sessions *sessions)
{
    for (struct bd_session **at = &sessions->list; *at;) {
        struct bd_session *session = *at;
        if (is_over(session)) bd_session_end(session);
        if (!session->has_ended) {
            bd_session_forget_arrived(session);
            at = &session->next;
            continue;
        }
        *at = session->next;
        bd_client_release(&session->client);
        free(session);
    }
}
