// A session that outlives its connection: its answers are kept, its requests and views go on, and a
// later connection takes them over by the session's token.
//
// What has left for the system may still be lost on its way, so that answers are kept after they
// were sent, too, and are sent again; who does not wait for one any more ignores it.

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>

#include "base/assert.h"
#include "base/clock.h"
#include "net/session_internal.h"

struct bd_session_kept {
    uint8_t *head, *payload; // one unit, as it is sent
    size_t head_bytes, payload_bytes;
    bool was_sent;
    struct bd_session_kept *next;
};

static size_t bytes_of(const struct bd_session_kept *kept)
{
    return sizeof *kept + kept->head_bytes + kept->payload_bytes;
}

static void forget_first(struct bd_session *session)
{
    struct bd_session_kept *kept = session->kept;
    session->kept = kept->next;
    session->net->kept_bytes -= bytes_of(kept);
    free(kept->head);
    free(kept->payload);
    free(kept);
}

void bd_session_forget_kept(struct bd_session *session)
{
    while (session->kept) forget_first(session);
}

static void *copy(const void *bytes, size_t size)
{
    if (size == 0) return NULL;
    void *out = malloc(size);
    BD_ASSERT(out);
    return memcpy(out, bytes, size);
}

static void append(struct bd_session *session, const struct bd_session_unit *unit)
{
    struct bd_session_kept *kept = malloc(sizeof *kept);
    BD_ASSERT(kept);
    *kept = (struct bd_session_kept){.head = copy(unit->head, unit->head_bytes),
                                     .payload = copy(unit->payload, unit->payload_bytes),
                                     .head_bytes = unit->head_bytes,
                                     .payload_bytes = unit->payload_bytes,
                                     .was_sent = session->conn != NULL};
    struct bd_session_kept **last = &session->kept;
    while (*last) last = &(*last)->next;
    *last = kept;
    session->net->kept_bytes += bytes_of(kept);
}

bool bd_session_keep(struct bd_session *session, const struct bd_session_unit *unit)
{
    uint64_t most = session->net->options.limits.resume_bytes;
    uint64_t size = sizeof(struct bd_session_kept) + unit->head_bytes + unit->payload_bytes;
    // What was sent has most likely arrived: it makes room, oldest first.
    while (session->net->kept_bytes + size > most && session->kept && session->kept->was_sent)
        forget_first(session);
    if (session->net->kept_bytes + size > most && !unit->is_small) return false;
    append(session, unit);
    return true;
}

void bd_session_resend(struct bd_session *session)
{
    for (struct bd_session_kept *kept = session->kept; kept && session->conn; kept = kept->next) {
        kept->was_sent = true;
        session->face->send(session->conn, copy(kept->head, kept->head_bytes), kept->head_bytes,
                            copy(kept->payload, kept->payload_bytes), kept->payload_bytes);
    }
}

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

struct bd_session *bd_session_find_resumable(const struct bd_session *asker, const char *token)
{
    uint8_t digest[BD_SHA256_BYTES];
    bd_sha256_of(token, strlen(token), digest);
    struct bd_session *found = NULL;
    for (struct bd_session *session = asker->net->sessions; session; session = session->next)
        if (session != asker && session->is_resumable && !session->has_ended &&
            session->grant == asker->grant && is_named(session, digest))
            found = session;
    return found;
}
