#include "net/framed.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/log.h"
#include "net/framed_internal.h"
#include "protocol/wire.h"

#define REQUESTS_AT_ONCE 256
// A peer that does not read its answers sends no more requests.
#define UNSENT_BYTES_MAX (64u << 20)

// One request under way.
struct bd_framed_request {
    struct bd_framed *framed;
    uint64_t id;
    struct bd_command *command;
    struct bd_framed_request *next;
};

// --- sending --------------------------------------------------------------------------------

void bd_framed_send(struct bd_framed *framed, uint64_t request_id, struct bd_answer *answer)
{
    BD_SET(answer->envelope, request_id, request_id);
    uint8_t *head;
    size_t head_bytes;
    bd_envelope_encode(answer->envelope, answer->payload_bytes, &head, &head_bytes);
    uint8_t *payload = answer->payload;
    answer->payload = NULL;
    bd_conn_write(&framed->conn, head, head_bytes, payload, answer->payload_bytes);
    bd_answer_finish(answer);
}

void bd_framed_send_fault(struct bd_framed *framed, uint64_t request_id,
                          const struct bd_fault *fault)
{
    struct bd_answer answer = bd_answer_error(fault);
    bd_net_count_refusal(framed->conn.net);
    bd_framed_send(framed, request_id, &answer);
}

void bd_framed_update_reading(struct bd_framed *framed)
{
    if (framed->conn.state != BD_CONN_OPEN) return;
    bd_conn_read(&framed->conn, bd_conn_unsent_bytes(&framed->conn) < UNSENT_BYTES_MAX &&
                                    bd_framed_uploads_have_room(framed));
}

// --- commands -------------------------------------------------------------------------------

static struct bd_framed_request *find_request(const struct bd_framed *framed, uint64_t id)
{
    struct bd_framed_request *request = framed->requests;
    while (request && request->id != id) request = request->next;
    return request;
}

static void forget_request(struct bd_framed_request *request)
{
    struct bd_framed *framed = request->framed;
    struct bd_framed_request **at = &framed->requests;
    while (*at != request) at = &(*at)->next;
    *at = request->next;
    framed->request_count--;
    free(request);
}

static void on_answer(void *user, struct bd_answer *answer)
{
    struct bd_framed_request *request = user;
    struct bd_framed *framed = request->framed;
    bd_framed_send(framed, request->id, answer);
    forget_request(request);
    bd_framed_update_reading(framed);
}

static void on_progress(void *user, const char *stage, double share)
{
    struct bd_framed_request *request = user;
    Bounced__Progress *progress = malloc(sizeof *progress);
    BD_ASSERT(progress);
    bounced__progress__init(progress);
    progress->stage = bd_answer_text(stage);
    if (share >= 0) BD_SET(progress, share, share);
    struct bd_answer event = bd_answer_of(BOUNCED__ENVELOPE__BODY_PROGRESS, progress);
    bd_framed_send(request->framed, request->id, &event);
}

static const struct bd_command_events plain_events = {on_answer, NULL};
static const struct bd_command_events progress_events = {on_answer, on_progress};

static enum bd_err check_request(const struct bd_framed *framed, uint64_t id,
                                 struct bd_fault *fault)
{
    if (id == 0)
        return bd_fault_set(fault, BD_ERR_USAGE, "request_id",
                            "a request needs an id other than 0");
    if (find_request(framed, id))
        return bd_fault_set(fault, BD_ERR_CONFLICT, "request_id",
                            "request %llu is under way already", (unsigned long long)id);
    if (framed->request_count >= REQUESTS_AT_ONCE)
        return bd_fault_set(fault, BD_ERR_BUSY, "", "%d requests are under way on this connection",
                            REQUESTS_AT_ONCE);
    return BD_ERR_OK;
}

// Takes the envelope.
static void start_command(struct bd_framed *framed, Bounced__Envelope *envelope)
{
    struct bd_framed_request *request = malloc(sizeof *request);
    BD_ASSERT(request);
    *request = (struct bd_framed_request){
        .framed = framed, .id = envelope->request_id, .next = framed->requests};
    framed->requests = request;
    framed->request_count++;
    bool progress =
        envelope->body_case == BOUNCED__ENVELOPE__BODY_RENDER && envelope->render->progress;
    struct bd_command_start start = {.net = framed->conn.net,
                                     .client = framed->conn.client,
                                     .envelope = envelope,
                                     .events = progress ? &progress_events : &plain_events,
                                     .user = request};
    struct bd_command *command = bd_command_start(&start);
    if (command) request->command = command;
}

static void cancel(struct bd_framed *framed, const Bounced__Envelope *envelope)
{
    struct bd_framed_request *request = find_request(framed, envelope->cancel->request_id);
    if (request) bd_command_cancel(request->command);
    struct bd_answer answer = bd_answer_done();
    bd_framed_send(framed, envelope->request_id, &answer);
}

// --- hello ----------------------------------------------------------------------------------

static enum bd_err check_hello(const struct bd_framed *framed, const Bounced__Hello *hello,
                               struct bd_fault *fault)
{
    uint32_t min = hello->has_min ? hello->min : 1;
    uint32_t max = hello->has_max ? hello->max : min;
    if (min > BD_PROTOCOL_VERSION_MAX || max < BD_PROTOCOL_VERSION_MIN)
        return bd_fault_set(fault, BD_ERR_UNSUPPORTED, "min",
                            "the client speaks versions %u to %u, the server %d to %d", min, max,
                            BD_PROTOCOL_VERSION_MIN, BD_PROTOCOL_VERSION_MAX);
    if (!framed->conn.trusted && !bd_tokens_accept(framed->conn.net->tokens, hello->token))
        return bd_fault_set(fault, BD_ERR_UNAUTHORIZED, "token",
                            hello->token ? "the token is not one of ours" : "a token is needed");
    return BD_ERR_OK;
}

static void greet(struct bd_framed *framed, const Bounced__Envelope *envelope)
{
    struct bd_fault fault;
    if (check_hello(framed, envelope->hello, &fault)) {
        bd_framed_send_fault(framed, envelope->request_id, &fault);
        bd_conn_finish(&framed->conn);
        return;
    }
    framed->greeted = true;
    framed->conn.clock_runs = false;
    struct bd_answer answer = bd_framed_hello_reply(framed->conn.net);
    bd_framed_send(framed, envelope->request_id, &answer);
}

// --- messages -------------------------------------------------------------------------------

// True if a message that is no command may be taken; otherwise it has been answered.
static bool admit(struct bd_framed *framed, uint64_t request_id)
{
    struct bd_fault fault;
    struct bd_net *net = framed->conn.net;
    net->stats.requests++;
    if (!bd_client_take_request(net->clients, framed->conn.client, &fault)) return true;
    bd_framed_send_fault(framed, request_id, &fault);
    return false;
}

// Takes the envelope.
static void handle(struct bd_framed *framed, Bounced__Envelope *envelope,
                   const struct bd_message *message)
{
    struct bd_fault fault;
    Bounced__Envelope__BodyCase body = envelope->body_case;
    if (!framed->greeted && body != BOUNCED__ENVELOPE__BODY_HELLO) {
        bd_fault_set(&fault, BD_ERR_USAGE, "hello", "the first message of a connection is hello");
        bd_framed_send_fault(framed, envelope->request_id, &fault);
        bd_conn_finish(&framed->conn);
    } else if (check_request(framed, envelope->request_id, &fault)) {
        bd_framed_send_fault(framed, envelope->request_id, &fault);
    } else if (body == BOUNCED__ENVELOPE__BODY_HELLO) {
        if (admit(framed, envelope->request_id)) greet(framed, envelope);
    } else if (body == BOUNCED__ENVELOPE__BODY_BLOB_PUT) {
        if (admit(framed, envelope->request_id)) bd_framed_put_piece(framed, envelope, message);
    } else if (body == BOUNCED__ENVELOPE__BODY_CANCEL) {
        cancel(framed, envelope);
    } else {
        start_command(framed, envelope);
        envelope = NULL;
    }
    if (envelope) bounced__envelope__free_unpacked(envelope, NULL);
}

// The stream means nothing any more: one last error, with no request to belong to.
static void give_up(struct bd_framed *framed, const struct bd_fault *fault)
{
    bd_log(BD_LOG_DEBUG, "net/framed", "%s: %s", framed->conn.client->key, fault->message);
    bd_framed_send_fault(framed, 0, fault);
    bd_conn_finish(&framed->conn);
}

static void on_bytes(struct bd_conn *conn, const uint8_t *bytes, size_t size)
{
    struct bd_framed *framed = (struct bd_framed *)conn;
    struct bd_fault fault;
    while (size > 0 && conn->state == BD_CONN_OPEN) {
        size_t taken;
        if (bd_decoder_feed(&framed->decoder, bytes, size, &taken, &fault)) {
            give_up(framed, &fault);
            return;
        }
        bytes += taken;
        size -= taken;
        struct bd_message message;
        if (!bd_decoder_take(&framed->decoder, &message)) continue;
        Bounced__Envelope *envelope;
        if (bd_envelope_decode(message.header, message.header_bytes, &envelope, &fault))
            give_up(framed, &fault);
        else
            handle(framed, envelope, &message);
        bd_message_finish(&message);
    }
}

// --- the connection -------------------------------------------------------------------------

static uint64_t patience_s(const struct bd_conn *conn)
{
    const struct bd_framed *framed = (const struct bd_framed *)conn;
    const struct bd_limits *limits = &conn->net->options.limits;
    if (!framed->greeted && !framed->is_private) return limits->header_seconds;
    if (bd_conn_unsent_bytes(conn) > 0) return limits->idle_seconds;
    // While we compute, or hold it back from sending, silence is not its fault.
    if (framed->is_private || framed->requests || !conn->reading) return 0;
    return limits->idle_seconds;
}

static void on_silent(struct bd_conn *conn)
{
    struct bd_framed *framed = (struct bd_framed *)conn;
    struct bd_fault fault;
    bd_fault_set(&fault, BD_ERR_DEADLINE, framed->greeted ? "idle_seconds" : "header_seconds",
                 framed->greeted ? "the connection was idle for too long (limit idle_seconds)"
                                 : "hello took too long (limit header_seconds)");
    give_up(framed, &fault);
}

static void on_drain(struct bd_conn *conn)
{
    struct bd_framed *framed = (struct bd_framed *)conn;
    if (!framed->requests) bd_conn_finish(conn);
}

static void on_written(struct bd_conn *conn)
{
    bd_framed_update_reading((struct bd_framed *)conn);
}

static void on_gone(struct bd_conn *conn)
{
    struct bd_framed *framed = (struct bd_framed *)conn;
    while (framed->requests) {
        struct bd_framed_request *request = framed->requests;
        if (request->command) bd_command_abandon(request->command);
        forget_request(request);
    }
    bd_framed_forget_uploads(framed);
}

static void on_free(struct bd_conn *conn)
{
    struct bd_framed *framed = (struct bd_framed *)conn;
    bd_decoder_finish(&framed->decoder);
    free(framed);
}

static const struct bd_conn_ops framed_ops = {
    .bytes = on_bytes,
    .patience_s = patience_s,
    .silent = on_silent,
    .drain = on_drain,
    .written = on_written,
    .gone = on_gone,
    .free = on_free,
};

static struct bd_framed *create(const struct bd_net *net)
{
    struct bd_framed *framed = calloc(1, sizeof *framed);
    BD_ASSERT(framed);
    framed->conn.ops = &framed_ops;
    framed->conn.clock_runs = true;
    bd_decoder_init(&framed->decoder, net->options.limits.message_bytes,
                    net->options.limits.header_bytes);
    return framed;
}

void bd_framed_accept(struct bd_net *net, uv_stream_t *listener, bool is_pipe)
{
    struct bd_framed *framed = create(net);
    framed->conn.trusted = is_pipe;
    bd_conn_accept(net, &framed->conn, listener, is_pipe);
}

bool bd_framed_open_private(struct bd_net *net, int fd)
{
    struct bd_framed *framed = create(net);
    framed->conn.trusted = true;
    framed->is_private = true;
    framed->conn.clock_runs = false;
    return bd_conn_open_fd(net, &framed->conn, fd);
}
