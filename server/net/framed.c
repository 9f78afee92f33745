#include "net/framed.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/log.h"
#include "net/command.h"
#include "net/net_internal.h"
#include "net/spool.h"
#include "protocol/framing.h"
#include "protocol/wire.h"

#define REQUESTS_AT_ONCE 256
#define UPLOADS_AT_ONCE  16
// A peer that does not read its answers sends no more requests.
#define UNSENT_BYTES_MAX (64u << 20)

struct framed;

// One request under way.
struct request {
    struct framed *framed;
    uint64_t id;
    struct bd_command *command;
    struct request *next;
};

// One blob on its way in.
struct upload {
    struct framed *framed;
    char blob[8 + BD_SHA256_HEX];
    uint64_t size_bytes;
    uint64_t last_request_id; // of the piece that completes it: answered when it is kept
    struct bd_spool *spool;
    struct upload *next;
};

struct framed {
    struct bd_conn conn;
    struct bd_decoder decoder;
    bool greeted, is_private;
    struct request *requests;
    uint32_t request_count;
    struct upload *uploads;
    uint32_t upload_count;
};

// --- sending --------------------------------------------------------------------------------

static void send_answer(struct framed *framed, uint64_t request_id, struct bd_answer *answer)
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

static void send_fault(struct framed *framed, uint64_t request_id, const struct bd_fault *fault)
{
    struct bd_answer answer = bd_answer_error(fault);
    bd_net_count_refusal(framed->conn.net);
    send_answer(framed, request_id, &answer);
}

static void update_reading(struct framed *framed)
{
    if (framed->conn.state != BD_CONN_OPEN) return;
    bool wanted = bd_conn_unsent_bytes(&framed->conn) < UNSENT_BYTES_MAX;
    for (struct upload *upload = framed->uploads; upload; upload = upload->next)
        wanted = wanted && !bd_spool_is_full(upload->spool);
    bd_conn_read(&framed->conn, wanted);
}

// --- commands -------------------------------------------------------------------------------

static struct request *find_request(const struct framed *framed, uint64_t id)
{
    struct request *request = framed->requests;
    while (request && request->id != id) request = request->next;
    return request;
}

static void forget_request(struct request *request)
{
    struct framed *framed = request->framed;
    struct request **at = &framed->requests;
    while (*at != request) at = &(*at)->next;
    *at = request->next;
    framed->request_count--;
    free(request);
}

static void on_answer(void *user, struct bd_answer *answer)
{
    struct request *request = user;
    struct framed *framed = request->framed;
    send_answer(framed, request->id, answer);
    forget_request(request);
    update_reading(framed);
}

static void on_progress(void *user, const char *stage)
{
    struct request *request = user;
    Bounced__Progress *progress = malloc(sizeof *progress);
    BD_ASSERT(progress);
    bounced__progress__init(progress);
    progress->stage = bd_answer_text(stage);
    struct bd_answer event = bd_answer_of(BOUNCED__ENVELOPE__BODY_PROGRESS, progress);
    send_answer(request->framed, request->id, &event);
}

static const struct bd_command_events plain_events = {on_answer, NULL};
static const struct bd_command_events progress_events = {on_answer, on_progress};

static enum bd_err check_request(const struct framed *framed, uint64_t id, struct bd_fault *fault)
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
static void start_command(struct framed *framed, Bounced__Envelope *envelope)
{
    struct request *request = malloc(sizeof *request);
    BD_ASSERT(request);
    *request =
        (struct request){.framed = framed, .id = envelope->request_id, .next = framed->requests};
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

static void cancel(struct framed *framed, const Bounced__Envelope *envelope)
{
    struct request *request = find_request(framed, envelope->cancel->request_id);
    if (request) bd_command_cancel(request->command);
    struct bd_answer answer = bd_answer_done();
    send_answer(framed, envelope->request_id, &answer);
}

// --- uploads --------------------------------------------------------------------------------

static void forget_upload(struct upload *upload)
{
    struct framed *framed = upload->framed;
    struct upload **at = &framed->uploads;
    while (*at != upload) at = &(*at)->next;
    *at = upload->next;
    framed->upload_count--;
    bd_spool_abandon(&upload->spool);
    free(upload);
}

static void on_upload_drained(void *user)
{
    update_reading(((struct upload *)user)->framed);
}

static void on_upload_ended(void *user, enum bd_err err, const struct bd_fault *fault)
{
    struct upload *upload = user;
    struct framed *framed = upload->framed;
    if (err) {
        send_fault(framed, upload->last_request_id, fault);
    } else {
        struct bd_answer answer = bd_answer_blob(upload->size_bytes, true);
        send_answer(framed, upload->last_request_id, &answer);
    }
    forget_upload(upload);
    update_reading(framed);
}

static const struct bd_spool_events upload_events = {on_upload_drained, on_upload_ended};

static struct upload *find_upload(const struct framed *framed, const char *blob)
{
    struct upload *upload = framed->uploads;
    while (upload && strcmp(upload->blob, blob) != 0) upload = upload->next;
    return upload;
}

static enum bd_err check_first_piece(const struct framed *framed, const Bounced__BlobPut *put,
                                     struct bd_fault *fault)
{
    uint64_t most = framed->conn.net->options.limits.blob_bytes;
    if (!put->blob || strncmp(put->blob, "sha256:", 7) != 0 ||
        !bd_blob_name_is_valid(put->blob + 7))
        return bd_fault_set(fault, BD_ERR_USAGE, "blob",
                            "a blob's name is sha256: and 64 lower-case hexadecimal digits");
    if (put->size_bytes > most)
        return bd_fault_set(fault, BD_ERR_LIMIT, "blob_bytes",
                            "a blob of %llu bytes is above the limit blob_bytes of %llu",
                            (unsigned long long)put->size_bytes, (unsigned long long)most);
    if (framed->upload_count >= UPLOADS_AT_ONCE)
        return bd_fault_set(fault, BD_ERR_BUSY, "blob", "%d uploads are under way",
                            UPLOADS_AT_ONCE);
    return BD_ERR_OK;
}

static struct upload *begin_upload(struct framed *framed, const Bounced__BlobPut *put)
{
    struct upload *upload = calloc(1, sizeof *upload);
    BD_ASSERT(upload);
    upload->framed = framed;
    upload->size_bytes = put->size_bytes;
    snprintf(upload->blob, sizeof upload->blob, "%s", put->blob);
    upload->spool = bd_spool_create(framed->conn.net, &upload_events, upload);
    upload->next = framed->uploads;
    framed->uploads = upload;
    framed->upload_count++;
    return upload;
}

static enum bd_err check_piece(const struct upload *upload, const Bounced__BlobPut *put,
                               size_t size, struct bd_fault *fault)
{
    uint64_t received = bd_spool_bytes(upload->spool);
    if (upload->last_request_id)
        return bd_fault_set(fault, BD_ERR_CONFLICT, "blob", "the upload is complete already");
    if (put->offset != received || put->size_bytes != upload->size_bytes)
        return bd_fault_set(fault, BD_ERR_CONFLICT, "offset",
                            "%llu of %llu bytes have arrived: this piece is at %llu of %llu",
                            (unsigned long long)received, (unsigned long long)upload->size_bytes,
                            (unsigned long long)put->offset, (unsigned long long)put->size_bytes);
    if (size > upload->size_bytes - received)
        return bd_fault_set(fault, BD_ERR_USAGE, "size_bytes",
                            "the pieces are longer than the blob's %llu bytes",
                            (unsigned long long)upload->size_bytes);
    return BD_ERR_OK;
}

static void put_piece(struct framed *framed, const Bounced__Envelope *envelope,
                      const struct bd_message *message)
{
    const Bounced__BlobPut *put = envelope->blob_put;
    struct bd_fault fault;
    struct upload *upload = put->blob ? find_upload(framed, put->blob) : NULL;
    enum bd_err err = BD_ERR_OK;
    if (!upload) err = check_first_piece(framed, put, &fault);
    if (!err && !upload) upload = begin_upload(framed, put);
    if (!err) err = check_piece(upload, put, message->payload_bytes, &fault);
    if (err) {
        send_fault(framed, envelope->request_id, &fault);
        if (upload && !upload->last_request_id) forget_upload(upload);
        return;
    }
    bd_spool_append(upload->spool, message->payload, message->payload_bytes);
    if (bd_spool_bytes(upload->spool) == upload->size_bytes) {
        upload->last_request_id = envelope->request_id;
        bd_spool_commit(upload->spool, upload->blob + 7);
    } else {
        struct bd_answer answer = bd_answer_blob(bd_spool_bytes(upload->spool), false);
        send_answer(framed, envelope->request_id, &answer);
    }
    update_reading(framed);
}

// --- hello ----------------------------------------------------------------------------------

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
    static const char *const names[] = {"blobs",  "scenes",  "render", "progress",
                                        "cancel", "devices", "stats"};
    reply->capabilities = calloc(sizeof names / sizeof names[0], sizeof(char *));
    BD_ASSERT(reply->capabilities);
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
        reply->capabilities[reply->n_capabilities++] = bd_answer_text(names[i]);
}

static struct bd_answer hello_reply(const struct bd_net *net)
{
    Bounced__HelloReply *reply = malloc(sizeof *reply);
    BD_ASSERT(reply);
    bounced__hello_reply__init(reply);
    BD_SET(reply, version, BD_PROTOCOL_VERSION_MAX);
    BD_SET(reply, min, BD_PROTOCOL_VERSION_MIN);
    BD_SET(reply, max, BD_PROTOCOL_VERSION_MAX);
    add_capabilities(reply);
    add_limits(reply, &net->options.limits);
    reply->build = bd_answer_text(BD_VERSION);
    struct bd_sched_stats stats;
    bd_sched_stats(net->options.sched, &stats);
    reply->device = bd_device_message(&stats);
    return bd_answer_of(BOUNCED__ENVELOPE__BODY_HELLO_REPLY, reply);
}

static enum bd_err check_hello(const struct framed *framed, const Bounced__Hello *hello,
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

static void greet(struct framed *framed, const Bounced__Envelope *envelope)
{
    struct bd_fault fault;
    if (check_hello(framed, envelope->hello, &fault)) {
        send_fault(framed, envelope->request_id, &fault);
        bd_conn_finish(&framed->conn);
        return;
    }
    framed->greeted = true;
    framed->conn.clock_runs = false;
    struct bd_answer answer = hello_reply(framed->conn.net);
    send_answer(framed, envelope->request_id, &answer);
}

// --- messages -------------------------------------------------------------------------------

// True if a message that is no command may be taken; otherwise it has been answered.
static bool admit(struct framed *framed, uint64_t request_id)
{
    struct bd_fault fault;
    struct bd_net *net = framed->conn.net;
    net->stats.requests++;
    if (!bd_client_take_request(net->clients, framed->conn.client, &fault)) return true;
    send_fault(framed, request_id, &fault);
    return false;
}

// Takes the envelope.
static void handle(struct framed *framed, Bounced__Envelope *envelope,
                   const struct bd_message *message)
{
    struct bd_fault fault;
    Bounced__Envelope__BodyCase body = envelope->body_case;
    if (!framed->greeted && body != BOUNCED__ENVELOPE__BODY_HELLO) {
        bd_fault_set(&fault, BD_ERR_USAGE, "hello", "the first message of a connection is hello");
        send_fault(framed, envelope->request_id, &fault);
        bd_conn_finish(&framed->conn);
    } else if (check_request(framed, envelope->request_id, &fault)) {
        send_fault(framed, envelope->request_id, &fault);
    } else if (body == BOUNCED__ENVELOPE__BODY_HELLO) {
        if (admit(framed, envelope->request_id)) greet(framed, envelope);
    } else if (body == BOUNCED__ENVELOPE__BODY_BLOB_PUT) {
        if (admit(framed, envelope->request_id)) put_piece(framed, envelope, message);
    } else if (body == BOUNCED__ENVELOPE__BODY_CANCEL) {
        cancel(framed, envelope);
    } else {
        start_command(framed, envelope);
        envelope = NULL;
    }
    if (envelope) bounced__envelope__free_unpacked(envelope, NULL);
}

// The stream means nothing any more: one last error, with no request to belong to.
static void give_up(struct framed *framed, const struct bd_fault *fault)
{
    bd_log(BD_LOG_DEBUG, "net/framed", "%s: %s", framed->conn.client->key, fault->message);
    send_fault(framed, 0, fault);
    bd_conn_finish(&framed->conn);
}

static void on_bytes(struct bd_conn *conn, const uint8_t *bytes, size_t size)
{
    struct framed *framed = (struct framed *)conn;
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
    const struct framed *framed = (const struct framed *)conn;
    const struct bd_limits *limits = &conn->net->options.limits;
    if (!framed->greeted && !framed->is_private) return limits->header_seconds;
    if (bd_conn_unsent_bytes(conn) > 0) return limits->idle_seconds;
    // While we compute, or hold it back from sending, silence is not its fault.
    if (framed->is_private || framed->requests || !conn->reading) return 0;
    return limits->idle_seconds;
}

static void on_silent(struct bd_conn *conn)
{
    struct framed *framed = (struct framed *)conn;
    struct bd_fault fault;
    bd_fault_set(&fault, BD_ERR_DEADLINE, framed->greeted ? "idle_seconds" : "header_seconds",
                 framed->greeted ? "the connection was idle for too long (limit idle_seconds)"
                                 : "hello took too long (limit header_seconds)");
    give_up(framed, &fault);
}

static void on_drain(struct bd_conn *conn)
{
    struct framed *framed = (struct framed *)conn;
    if (!framed->requests) bd_conn_finish(conn);
}

static void on_written(struct bd_conn *conn)
{
    update_reading((struct framed *)conn);
}

static void on_gone(struct bd_conn *conn)
{
    struct framed *framed = (struct framed *)conn;
    while (framed->requests) {
        struct request *request = framed->requests;
        if (request->command) bd_command_abandon(request->command);
        forget_request(request);
    }
    while (framed->uploads) forget_upload(framed->uploads);
}

static void on_free(struct bd_conn *conn)
{
    struct framed *framed = (struct framed *)conn;
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

static struct framed *create(const struct bd_net *net)
{
    struct framed *framed = calloc(1, sizeof *framed);
    BD_ASSERT(framed);
    framed->conn.ops = &framed_ops;
    framed->conn.clock_runs = true;
    bd_decoder_init(&framed->decoder, net->options.limits.message_bytes,
                    net->options.limits.header_bytes);
    return framed;
}

void bd_framed_accept(struct bd_net *net, uv_stream_t *listener, bool is_pipe)
{
    struct framed *framed = create(net);
    framed->conn.trusted = is_pipe;
    bd_conn_accept(net, &framed->conn, listener, is_pipe);
}

bool bd_framed_open_private(struct bd_net *net, int fd)
{
    struct framed *framed = create(net);
    framed->conn.trusted = true;
    framed->is_private = true;
    framed->conn.clock_runs = false;
    return bd_conn_open_fd(net, &framed->conn, fd);
}
