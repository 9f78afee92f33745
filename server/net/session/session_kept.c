// Answers that are kept for a client that may come back.
//
// What has left for the system may still be lost on its way, so that answers are kept after they
// were sent, too, and are sent again; who does not wait for one any more ignores it. One that was
// sent is forgotten once it must have arrived, or when there is no room for others: those with a
// payload first. Without a payload none is refused, as what it tells may have been done for good;
// such answers are no more than requests under way, and one of each session that has a connection.

#include <stdlib.h>
#include <string.h>

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
    struct bd_fault fault;
    bd_fault_set(&fault, BD_ERR_BUSY, "resume_bytes",
                 "the answer was too large to be kept (limit resume_bytes)");
    struct bd_answer answer = bd_answer_error(&fault);
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
