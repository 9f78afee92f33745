// A session that outlives its connection: its answers are kept (session_kept.c), its requests and
// views go on, and a later connection takes them over by the session's token.

#include <string.h>
#include <sys/random.h>

#include "base/assert.h"
#include "net/session/session_internal.h"

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
