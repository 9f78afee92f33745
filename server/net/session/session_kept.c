// Answers that are kept for a client that may come back, and how it comes back.
//
// What has left for the system may still be lost on its way, so that answers are kept after they
// were sent, too, and are sent again; who does not wait for one any more ignores it. One that was
// sent is forgotten once it must have arrived, or when there is no room for others: those with a
// payload first. Without a payload none is refused, as what it tells may have been done for good;
// such answers are no more than requests under way, and one of each session that has a connection.

#include <stdlib.h>
#include <string.h>
#include <sys/random.h>

#include "base/assert.h"
#include "base/clock.h"
#include "net/session/session_internal.h"
#include "protocol/wire.h"

// One answer as it is sent.
struct unit {
    const uint8_t *head, *payload;
    size_t head_bytes, payload_bytes;
};

struct bd_session_kept {
    uint8_t *head, *payload; // one unit, as it is sent
    size_t head_bytes, payload_bytes;
    bool was_sent;
    uint64_t sent_ns, sent_until; // and conn->out_bytes behind it
    struct bd_session_kept *next;
};

static size_t bytes_of(const struct bd_session_kept *kept)
{
    return sizeof *kept + kept->head_bytes + kept->payload_bytes;
}

static void forget(struct bd_session *session, struct bd_session_kept **at)
{
    struct bd_session_kept *kept = *at;
    *at = kept->next;
    if (!kept->next) session->kept_end = at;
    session->sessions->kept_bytes -= bytes_of(kept);
    free(kept->head);
    free(kept->payload);
    free(kept);
}

void bd_session_forget_kept(struct bd_session *session)
{
    while (session->kept) forget(session, &session->kept);
}

// All of it has left for the system, and the peer spoke long after: a connection that had broken
// meanwhile would be silent. That we could go on sending says nothing.
static bool has_arrived(const struct bd_session *session, const struct bd_session_kept *kept)
{
    const struct bd_conn *conn = session->conn;
    uint64_t patience_ns = session->loop->serving->limits.resume_seconds * 1000000000u;
    return conn && kept->was_sent && conn->heard_ns > kept->sent_ns + patience_ns &&
           conn->out_bytes - bd_conn_unsent_bytes(conn) >= kept->sent_until;
}

void bd_session_forget_arrived(struct bd_session *session)
{
    while (session->kept && has_arrived(session, session->kept)) forget(session, &session->kept);
}

static void *copy(const void *bytes, size_t size)
{
    if (size == 0) return NULL;
    void *out = malloc(size);
    BD_ASSERT(out);
    return memcpy(out, bytes, size);
}

// It is about to be.
static void mark_sent(const struct bd_session *session, struct bd_session_kept *kept)
{
    kept->was_sent = true;
    kept->sent_ns = bd_clock_ns();
    kept->sent_until = session->conn->out_bytes + kept->head_bytes + kept->payload_bytes;
}

static void append(struct bd_session *session, const struct unit *unit)
{
    struct bd_session_kept *kept = malloc(sizeof *kept);
    BD_ASSERT(kept);
    *kept = (struct bd_session_kept){.head = copy(unit->head, unit->head_bytes),
                                     .payload = copy(unit->payload, unit->payload_bytes),
                                     .head_bytes = unit->head_bytes,
                                     .payload_bytes = unit->payload_bytes};
    if (session->conn) mark_sent(session, kept);
    *session->kept_end = kept;
    session->kept_end = &kept->next;
    session->sessions->kept_bytes += bytes_of(kept);
}

static bool has_room(const struct bd_sessions *sessions, uint64_t size)
{
    return sessions->kept_bytes + size <= sessions->loop->serving->limits.resume_bytes;
}

// What was sent has most likely arrived: it makes room, oldest first.
static void forget_sent(struct bd_session *session, uint64_t size, bool is_payload)
{
    for (struct bd_session_kept **at = &session->kept; *at && !has_room(session->sessions, size);)
        if ((*at)->was_sent && ((*at)->payload != NULL) == is_payload)
            forget(session, at);
        else
            at = &(*at)->next;
}

// False if it has a payload, and resume_bytes no room for it.
static bool keep(struct bd_session *session, const struct unit *unit)
{
    struct bd_sessions *sessions = session->sessions;
    bool is_small = unit->payload_bytes == 0;
    uint64_t size = sizeof(struct bd_session_kept) + unit->head_bytes + unit->payload_bytes;
    if (!is_small && size > sessions->loop->serving->limits.resume_bytes) return false;
    bd_session_forget_arrived(session);
    forget_sent(session, size, true);
    // One that has no other way to its client comes before others' that had; so does a small one.
    if (is_small || !session->conn)
        for (struct bd_session *other = sessions->list; other; other = other->next)
            forget_sent(other, size, true);
    forget_sent(session, size, false);
    if (!is_small && !has_room(sessions, size)) return false;
    append(session, unit);
    return true;
}

// What cannot be kept for a client that may come back: the request then ended in an error.
static struct bd_answer too_large_to_keep(uint64_t request_id)
{
    struct bd_err_detail detail;
    bd_err_set(&detail, BD_ERR_BUSY, "resume_bytes",
               "the answer was too large to be kept (limit resume_bytes)");
    struct bd_answer answer = bd_answer_error(&detail);
    BD_SET(answer.envelope, request_id, request_id);
    return answer;
}

void bd_session_keep(struct bd_session *session, const struct bd_answer *answer,
                     const uint8_t *head, size_t head_bytes)
{
    struct unit unit = {.head = head,
                        .payload = answer->payload,
                        .head_bytes = head_bytes,
                        .payload_bytes = answer->payload_bytes};
    if (keep(session, &unit)) return;
    // One that is on its way now needs no word that it was not kept.
    if (session->conn) return;
    struct bd_answer error = too_large_to_keep(answer->envelope->request_id);
    uint8_t *small;
    bd_envelope_encode(error.envelope, 0, &small, &unit.head_bytes);
    unit = (struct unit){.head = small, .head_bytes = unit.head_bytes};
    keep(session, &unit);
    free(small);
    bd_answer_finish(&error);
}

void bd_session_resend(struct bd_session *session)
{
    for (struct bd_session_kept *kept = session->kept; kept && session->conn; kept = kept->next) {
        mark_sent(session, kept);
        session->transport->send(session->conn, copy(kept->head, kept->head_bytes),
                                 kept->head_bytes, copy(kept->payload, kept->payload_bytes),
                                 kept->payload_bytes);
    }
}

// --- a session that outlives its connection --------------------------------------------------

// Its requests and views go on, and a later connection takes them over by the session's token.

void bd_session_make_token(struct bd_session *session, char out[BD_SHA256_HEX])
{
    uint8_t random[BD_SHA256_BYTES];
    ssize_t size = getrandom(random, sizeof random, 0);
    BD_ASSERT_CMP(size, ==, (ssize_t)sizeof random);
    bd_sha256_hex(random, out);
    if (session->is_resumable && !session->has_older_token) {
        memcpy(session->older_digest, session->token_digest, sizeof session->older_digest);
        session->has_older_token = true;
    }
    bd_sha256_of(out, BD_SHA256_HEX - 1, session->token_digest);
    session->is_resumable = true;
}

void bd_session_has_token(struct bd_session *session)
{
    session->has_older_token = false;
}

static bool are_same(const uint8_t a[BD_SHA256_BYTES], const uint8_t b[BD_SHA256_BYTES])
{
    uint8_t difference = 0;
    for (int i = 0; i < BD_SHA256_BYTES; i++) difference |= a[i] ^ b[i];
    return difference == 0;
}

static bool is_named(const struct bd_session *session, const uint8_t digest[BD_SHA256_BYTES])
{
    bool is_newer = are_same(digest, session->token_digest);
    return is_newer || (session->has_older_token && are_same(digest, session->older_digest));
}

static struct bd_session *find_resumable(const struct bd_session *asker, const char *token)
{
    uint8_t digest[BD_SHA256_BYTES];
    bd_sha256_of(token, strlen(token), digest);
    struct bd_session *found = NULL;
    for (struct bd_session *session = asker->sessions->list; session; session = session->next)
        if (session != asker && session->is_resumable && !session->has_ended &&
            session->grant == asker->grant && is_named(session, digest))
            found = session;
    return found;
}

static uint32_t count_waiting(const struct bd_sessions *sessions)
{
    uint32_t count = 0;
    for (const struct bd_session *session = sessions->list; session; session = session->next)
        count += session->parked_until_ns != 0 && !session->has_ended;
    return count;
}

bool bd_session_may_be_resumed(const struct bd_session *session, const struct bd_conn *conn)
{
    const struct bd_sessions *sessions = session->sessions;
    return session->is_resumable && conn->state == BD_CONN_CLOSED && !sessions->loop->draining &&
           count_waiting(sessions) < sessions->loop->serving->limits.resumable_sessions;
}

// The connection changes its session: the one that it began with has done nothing yet.
static void take_over(struct bd_session *session, struct bd_session *old)
{
    struct bd_conn *conn = session->conn;
    // The old connection may be dead without having said so. It goes without its session, which
    // does not wait for anybody: how many may wait is no reason to end it.
    if (old->conn) {
        struct bd_conn *dead = old->conn;
        bd_session_leave_conn(old);
        bd_conn_kill(dead);
    }
    bd_session_leave_conn(session);
    bd_session_end(session);
    old->conn = conn;
    old->transport = session->transport;
    old->says_goodbye = session->says_goodbye;
    old->parked_until_ns = 0;
    conn->session = old;
    bd_client_release(&old->client);
    old->client = conn->client;
    bd_client_retain(old->client);
}

bool bd_session_resume(struct bd_session *session, uint64_t request_id, const Bounced__Hello *hello)
{
    if (session->greeted || !hello->resume || !hello->resume[0] || session->loop->draining)
        return false;
    struct bd_session *old = find_resumable(session, hello->resume);
    if (!old) return false;
    take_over(session, old);
    bd_session_welcome(old, request_id, hello, true);
    bd_session_resend(old);
    bd_session_flush_watches(old);
    bd_session_wake_views(old, true);
    return true;
}
