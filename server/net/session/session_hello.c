// The start of a session: who asks, and what the server says of itself.

#include <stdio.h>
#include <stdlib.h>

#include "base/assert.h"
#include "net/access/author.h"
#include "net/session/session_internal.h"
#include "protocol/wire.h"

static enum bd_err check_version(const Bounced__Hello *hello, struct bd_err_detail *detail)
{
    uint32_t min = hello->has_min ? hello->min : 1;
    uint32_t max = hello->has_max ? hello->max : min;
    if (min <= BD_PROTOCOL_VERSION_MAX && max >= BD_PROTOCOL_VERSION_MIN) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_UNSUPPORTED, "min",
                      "the client speaks versions %u to %u, the server %d to %d", min, max,
                      BD_PROTOCOL_VERSION_MIN, BD_PROTOCOL_VERSION_MAX);
}

// A user of this machine whom the token file does not name; the client's key is "uid:NUMBER".
static enum bd_err refuse_user(const struct bd_session *session, struct bd_err_detail *detail)
{
    const char *key = session->client->key;
    if (bd_tokens_needed(session->sessions->access->tokens))
        return bd_err_set(detail, BD_ERR_UNAUTHORIZED, "token",
                          "a token is needed: the token file has no line for you, %s", key);
    return bd_err_set(detail, BD_ERR_FORBIDDEN, "uid",
                      "this socket is for the server's own user and root, not for %s: a line "
                      "\"%s\" in its token file would let you in",
                      key, key);
}

static enum bd_err refuse_token(const struct bd_session *session, const Bounced__Hello *hello,
                                struct bd_err_detail *detail)
{
    struct bd_clients *clients = session->loop->clients;
    enum bd_err err = hello->token
                          ? bd_client_take_failed_login(clients, session->conn->origin, detail)
                          : bd_client_take_request(clients, session->conn->client, detail);
    if (err) return err;
    return bd_err_set(detail, BD_ERR_UNAUTHORIZED, "token",
                      hello->token ? "the token is not one of ours" : "a token is needed");
}

// From here on it is the token that asks, if there is one.
static enum bd_err become(struct bd_session *session, const struct bd_grant *grant,
                          struct bd_err_detail *detail)
{
    enum bd_err err = bd_conn_identify(session->conn, grant, bd_grant_token(grant), detail);
    if (err) return err;
    session->grant = grant;
    bd_client_retain(session->conn->client);
    bd_client_release(&session->client);
    session->client = session->conn->client;
    return BD_ERR_OK;
}

static enum bd_err check_hello(struct bd_session *session, const Bounced__Hello *hello,
                               struct bd_err_detail *detail)
{
    const struct bd_tokens *tokens = session->sessions->access->tokens;
    const struct bd_grant *grant = session->grant;
    if (!grant && session->is_user && !(hello->token && bd_tokens_needed(tokens)))
        return refuse_user(session, detail);
    if (!grant) grant = bd_tokens_find(tokens, hello->token);
    if (!grant) return refuse_token(session, hello, detail);
    enum bd_err err = become(session, grant, detail);
    if (!err) err = bd_client_take_request(session->loop->clients, session->client, detail);
    return err ? err : check_version(hello, detail);
}

static void add_limits(Bounced__HelloReply *reply, const struct bd_limits *limits)
{
    reply->limits = calloc(sizeof *limits / sizeof(uint64_t), sizeof(Bounced__KeyValue *));
    BD_ASSERT(reply->limits);
    uint64_t value;
    for (const char *name; (name = bd_limits_get(limits, (uint32_t)reply->n_limits, &value));) {
        char text[24];
        snprintf(text, sizeof text, "%llu", (unsigned long long)value);
        Bounced__KeyValue *pair = malloc(sizeof *pair);
        BD_ASSERT(pair);
        bounced__key_value__init(pair);
        pair->key = bd_answer_text(name);
        pair->value = bd_answer_text(text);
        reply->limits[reply->n_limits++] = pair;
    }
}

static void add_capabilities(Bounced__HelloReply *reply)
{
    static const char *const names[] = {
        "blobs",      "scenes",    "render",  "progress", "cancel", "devices", "stats",
        "techniques", "views",     "watches", "pose",     "half",   "resume",  "under_way",
        "edits",      "transient", "undo",    "log",      "export", "replay",
    };
    reply->capabilities = calloc(sizeof names / sizeof names[0], sizeof(char *));
    BD_ASSERT(reply->capabilities);
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
        reply->capabilities[reply->n_capabilities++] = bd_answer_text(names[i]);
}

static struct bd_answer hello_reply(const struct bd_sessions *sessions)
{
    Bounced__HelloReply *reply = malloc(sizeof *reply);
    BD_ASSERT(reply);
    bounced__hello_reply__init(reply);
    BD_SET(reply, version, BD_PROTOCOL_VERSION_MAX);
    BD_SET(reply, min, BD_PROTOCOL_VERSION_MIN);
    BD_SET(reply, max, BD_PROTOCOL_VERSION_MAX);
    add_capabilities(reply);
    add_limits(reply, &sessions->loop->serving->limits);
    reply->build = bd_answer_text(BD_VERSION);
    struct bd_sched_stats stats;
    bd_sched_stats(sessions->loop->serving->sched, &stats);
    reply->device = bd_device_message(&stats);
    return bd_answer_of(BOUNCED__ENVELOPE__BODY_HELLO_REPLY, reply);
}

static void add_author(Bounced__HelloReply *reply, const struct bd_session *session)
{
    char author[BD_EDIT_AUTHOR_BYTES];
    enum bd_err err = bd_author_make(session->grant, session->client, NULL, author, NULL);
    BD_ASSERT(!err);
    reply->author = bd_answer_text(author);
}

// Who comes back learns what has arrived: what it asked for and is neither here nor among the kept
// answers was lost on its way.
static void add_under_way(Bounced__HelloReply *reply, const struct bd_session *session)
{
    size_t count = session->request_count + session->view_count + session->watch_count;
    reply->under_way = malloc((count + 1) * sizeof *reply->under_way);
    BD_ASSERT(reply->under_way);
    bd_session_request_ids(session, reply->under_way);
    reply->n_under_way = session->request_count;
    bd_session_view_ids(session, reply->under_way + reply->n_under_way);
    reply->n_under_way += session->view_count;
    bd_session_watch_ids(session, reply->under_way + reply->n_under_way);
    reply->n_under_way += session->watch_count;
}

void bd_session_welcome(struct bd_session *session, uint64_t request_id,
                        const Bounced__Hello *hello, bool was_resumed)
{
    session->greeted = true;
    session->conn->clock_runs = false;
    session->conn->is_known = true;
    struct bd_answer answer = hello_reply(session->sessions);
    Bounced__HelloReply *reply = answer.envelope->hello_reply;
    add_author(reply, session);
    // Where the end of a stream is all the goodbye there is, who means to come back says so.
    if (hello->resume || session->says_goodbye) {
        char token[BD_SHA256_HEX];
        bd_session_make_token(session, token);
        reply->session = bd_answer_text(token);
        BD_SET(reply, resumed, was_resumed);
        if (was_resumed) add_under_way(reply, session);
    }
    bd_session_send_event(session, request_id, &answer); // not kept: it belongs to the connection
}

void bd_session_greet(struct bd_session *session, const Bounced__Envelope *envelope)
{
    struct bd_err_detail detail;
    const Bounced__Hello *hello = envelope->hello;
    if (check_hello(session, hello, &detail)) {
        bd_session_send_error(session, envelope->request_id, &detail);
        bd_session_finish(session, &detail);
        return;
    }
    if (!bd_session_resume(session, envelope->request_id, hello))
        bd_session_welcome(session, envelope->request_id, hello, false);
}
