#include "clients/cli/conn.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/clock.h"
#include "clients/cli/interrupt.h"
#include "clients/cli/transport.h"

#define TICK_MS         100
#define CANCEL_WAIT_MS  3000
#define MESSAGE_BYTES   UINT32_MAX // whatever the framing can say: memory grows with what arrives
#define HEADER_BYTES    ((uint64_t)64 << 20)
#define TOKEN_BYTES_MAX 4096

struct bd_cli_conn {
    int fd;
    pid_t child; // of a private daemon, 0 if there is none
    uint64_t last_request_id;
    bool greeted; // the answer to hello has come
    uint64_t hello_id;
    int idle_ms; // the daemon hangs up after so much silence; 0: never
    struct bd_decoder decoder;
    uint8_t inbox[65536];
    size_t inbox_used, inbox_taken;
};

void bd_cli_answer_finish(struct bd_cli_answer *answer)
{
    bd_envelope_free(&answer->envelope);
    bd_message_finish(&answer->message);
}

// What the end of the stream means. A private daemon's exit code says more than the silence.
static enum bd_err gone(struct bd_cli_conn *conn, struct bd_err_detail *detail)
{
    if (!conn->child)
        return bd_err_set(detail, BD_ERR_UNREACHABLE, "server", "the daemon closed the connection");
    int status = bd_transport_reap(conn->child, 5000);
    bd_interrupt_set_child(0);
    conn->child = 0;
    if (WIFSIGNALED(status))
        return bd_err_set(detail, BD_ERR_UNREACHABLE, "server",
                          "the private daemon was ended by signal %d (%s)", WTERMSIG(status),
                          strsignal(WTERMSIG(status)));
    int code = WEXITSTATUS(status);
    enum bd_err err = BD_ERR_UNREACHABLE;
    if (code == bd_err_exit_code(BD_ERR_DEVICE)) err = BD_ERR_DEVICE;
    if (code == bd_err_exit_code(BD_ERR_USAGE)) err = BD_ERR_USAGE;
    return bd_err_set(detail, err, "server", "the private daemon ended with code %d%s", code,
                      code == 127 ? ": it could not be started" : "; its reason stands above");
}

static bool wait_until(int fd, short events, int timeout_ms)
{
    struct pollfd poll_fd = {.fd = fd, .events = events};
    return poll(&poll_fd, 1, timeout_ms) > 0;
}

static enum bd_err send_all(struct bd_cli_conn *conn, const void *bytes, size_t size,
                            struct bd_err_detail *detail)
{
    const uint8_t *next = bytes;
    while (size > 0) {
        ssize_t sent = send(conn->fd, next, size, MSG_NOSIGNAL);
        if (sent >= 0) {
            next += sent;
            size -= (size_t)sent;
        } else if (errno == EAGAIN || errno == EINTR) {
            if (bd_interrupted()) return bd_err_set(detail, BD_ERR_CANCELLED, "", "interrupted");
            wait_until(conn->fd, POLLOUT, TICK_MS);
        } else {
            // The peer may have said why before it closed, so the caller reads on.
            return BD_ERR_UNREACHABLE;
        }
    }
    return BD_ERR_OK;
}

static enum bd_err send_request(struct bd_cli_conn *conn, Bounced__Envelope *request,
                                const void *payload, size_t payload_bytes,
                                struct bd_err_detail *detail)
{
    request->has_request_id = 1;
    request->request_id = ++conn->last_request_id;
    uint8_t *head = NULL;
    size_t head_bytes = 0;
    bd_envelope_encode(request, payload_bytes, &head, &head_bytes);
    enum bd_err err = send_all(conn, head, head_bytes, detail);
    if (!err && payload_bytes) err = send_all(conn, payload, payload_bytes, detail);
    free(head);
    return err;
}

// One read's worth, if any came. BD_ERR_OK also when nothing did.
static enum bd_err fill_inbox(struct bd_cli_conn *conn, struct bd_err_detail *detail)
{
    if (conn->inbox_taken < conn->inbox_used) return BD_ERR_OK;
    conn->inbox_used = conn->inbox_taken = 0;
    ssize_t got = recv(conn->fd, conn->inbox, sizeof conn->inbox, 0);
    if (got > 0) {
        conn->inbox_used = (size_t)got;
        return BD_ERR_OK;
    }
    if (got < 0 && (errno == EAGAIN || errno == EINTR)) return BD_ERR_OK;
    return gone(conn, detail);
}

// What cannot be read from a daemon is its fault, not the scene's.
static enum bd_err nonsense(enum bd_err err, struct bd_err_detail *detail)
{
    if (err == BD_ERR_OK || err == BD_ERR_NO_MEMORY) return err;
    struct bd_err_detail inner = *detail;
    return bd_err_set(detail, BD_ERR_UNREACHABLE, "server", "the daemon sent nonsense: %s",
                      inner.message);
}

// The next whole message, if it is there: `out->envelope` stays NULL if not.
static enum bd_err take_message(struct bd_cli_conn *conn, struct bd_cli_answer *out,
                                struct bd_err_detail *detail)
{
    enum bd_err err = fill_inbox(conn, detail);
    if (err || conn->inbox_taken == conn->inbox_used) return err;
    size_t taken = 0;
    err = bd_decoder_feed(&conn->decoder, conn->inbox + conn->inbox_taken,
                          conn->inbox_used - conn->inbox_taken, &taken, detail);
    conn->inbox_taken += taken;
    if (err || !bd_decoder_take(&conn->decoder, &out->message)) return nonsense(err, detail);
    err =
        bd_envelope_decode(out->message.header, out->message.header_bytes, &out->envelope, detail);
    if (err) bd_cli_answer_finish(out);
    return nonsense(err, detail);
}

static enum bd_err err_from_wire(const Bounced__Error *error, struct bd_err_detail *detail)
{
    enum bd_err err = bd_err_from_name(error->code ? error->code : "internal");
    if (err == BD_ERR_OK) err = BD_ERR_INTERNAL; // an error that says ok is none of ours
    const char *field = error->details && error->details->field ? error->details->field : "";
    return bd_err_set(detail, err, field, "%s",
                      error->message ? error->message : "no reason given");
}

struct wait {
    uint64_t request_id;
    const struct bd_cli_conn_watch *watch;
    bool at_once; // on Ctrl-C: there is nothing yet that the daemon could stop
    bool cancel_sent;
    uint64_t cancel_sent_ns;
};

// Ctrl-C, when it came: asks the daemon to stop, and then lets it only so much time.
static enum bd_err check_interrupt(struct bd_cli_conn *conn, struct wait *wait,
                                   struct bd_err_detail *detail)
{
    if (!bd_interrupted()) return BD_ERR_OK;
    if (wait->cancel_sent && bd_ms_since(wait->cancel_sent_ns) < CANCEL_WAIT_MS) return BD_ERR_OK;
    if (wait->cancel_sent || wait->at_once)
        return bd_err_set(detail, BD_ERR_CANCELLED, "", "interrupted");
    Bounced__Cancel cancel = BOUNCED__CANCEL__INIT;
    cancel.has_request_id = 1;
    cancel.request_id = wait->request_id;
    Bounced__Envelope envelope = BOUNCED__ENVELOPE__INIT;
    envelope.body_case = BOUNCED__ENVELOPE__BODY_CANCEL;
    envelope.cancel = &cancel;
    wait->cancel_sent = true;
    wait->cancel_sent_ns = bd_clock_ns();
    uint8_t *head = NULL;
    size_t head_bytes = 0;
    envelope.has_request_id = 1;
    envelope.request_id = ++conn->last_request_id;
    bd_envelope_encode(&envelope, 0, &head, &head_bytes);
    // One try: a daemon that does not even read is left by closing, which cancels as well.
    ssize_t sent = send(conn->fd, head, head_bytes, MSG_NOSIGNAL | MSG_DONTWAIT);
    free(head);
    if (sent == (ssize_t)head_bytes) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_CANCELLED, "", "interrupted");
}

static void pause_for_news(struct bd_cli_conn *conn, const struct wait *wait)
{
    struct pollfd fds[2] = {{.fd = conn->fd, .events = POLLIN},
                            {.fd = bd_interrupt_fd(), .events = POLLIN}};
    // The pipe stays readable, so it is asked only until it has been heard.
    poll(fds, wait->cancel_sent ? 1 : 2, TICK_MS);
    if (wait->watch && wait->watch->tick) wait->watch->tick(wait->watch->user);
}

// True if `answer` ends the wait. Progress is passed on; what belongs to nobody is dropped.
static bool is_awaited(const struct wait *wait, const struct bd_cli_answer *answer)
{
    const Bounced__Envelope *envelope = answer->envelope;
    bool stream_error =
        envelope->body_case == BOUNCED__ENVELOPE__BODY_ERROR && !envelope->request_id;
    if (envelope->body_case == BOUNCED__ENVELOPE__BODY_PROGRESS) {
        if (wait->watch && wait->watch->stage && envelope->progress->stage)
            wait->watch->stage(wait->watch->user, envelope->progress->stage);
        if (wait->watch && wait->watch->share && envelope->progress->has_share)
            wait->watch->share(wait->watch->user, envelope->progress->share);
        return false;
    }
    return stream_error || envelope->request_id == wait->request_id;
}

static enum bd_err wait_for_answer(struct bd_cli_conn *conn, struct wait *wait,
                                   struct bd_cli_answer *out, struct bd_err_detail *detail)
{
    for (;;) {
        enum bd_err err = take_message(conn, out, detail);
        if (err) return err;
        if (out->envelope) {
            if (is_awaited(wait, out)) return BD_ERR_OK;
            bd_cli_answer_finish(out);
            continue;
        }
        err = check_interrupt(conn, wait, detail);
        if (err) return err;
        if (conn->inbox_taken == conn->inbox_used) pause_for_news(conn, wait);
    }
}

static enum bd_err receive(struct bd_cli_conn *conn, struct wait *wait,
                           Bounced__Envelope__BodyCase want, struct bd_cli_answer *out,
                           struct bd_err_detail *detail)
{
    *out = (struct bd_cli_answer){0};
    enum bd_err err = wait_for_answer(conn, wait, out, detail);
    if (err) return err;
    if (out->envelope->body_case == want) return BD_ERR_OK;
    if (out->envelope->body_case == BOUNCED__ENVELOPE__BODY_ERROR) {
        err = err_from_wire(out->envelope->error, detail);
        // Not by us: it drains, and its patience with our frame has ended.
        if (err == BD_ERR_CANCELLED && !wait->cancel_sent)
            err = bd_err_set(detail, BD_ERR_UNREACHABLE, "server",
                             "the daemon is shutting down and cancelled the request");
        return err;
    }
    err = bd_err_set(detail, BD_ERR_INTERNAL, "server", "an answer of kind %d instead of %d",
                     (int)out->envelope->body_case, (int)want);
    bd_cli_answer_finish(out);
    return err;
}

static int idle_ms_of(const Bounced__HelloReply *reply)
{
    for (size_t i = 0; i < reply->n_limits; i++) {
        const Bounced__KeyValue *limit = reply->limits[i];
        if (!limit->key || strcmp(limit->key, "idle_seconds") != 0) continue;
        long long seconds = limit->value ? atoll(limit->value) : 0;
        return seconds < 0 || seconds > INT_MAX / 1000 ? INT_MAX : (int)seconds * 1000;
    }
    return 0;
}

// The answer to the hello that bd_cli_conn_open sent, before the first call.
static enum bd_err greet(struct bd_cli_conn *conn, struct bd_err_detail *detail)
{
    if (conn->greeted) return BD_ERR_OK;
    struct wait wait = {.request_id = conn->hello_id, .at_once = true};
    struct bd_cli_answer answer;
    enum bd_err err = receive(conn, &wait, BOUNCED__ENVELOPE__BODY_HELLO_REPLY, &answer, detail);
    conn->greeted = !err;
    if (!err) conn->idle_ms = idle_ms_of(answer.envelope->hello_reply);
    bd_cli_answer_finish(&answer);
    return err;
}

enum bd_err bd_cli_conn_call(struct bd_cli_conn *conn, Bounced__Envelope *request,
                             const void *payload, size_t payload_bytes,
                             Bounced__Envelope__BodyCase want,
                             const struct bd_cli_conn_watch *watch, struct bd_cli_answer *out,
                             struct bd_err_detail *detail)
{
    *out = (struct bd_cli_answer){0};
    enum bd_err err = greet(conn, detail);
    if (err) return err;
    err = send_request(conn, request, payload, payload_bytes, detail);
    if (err && err != BD_ERR_UNREACHABLE) return err;
    struct wait wait = {.request_id = request->request_id, .watch = watch};
    return receive(conn, &wait, want, out, detail);
}

enum bd_err bd_cli_conn_event(struct bd_cli_conn *conn, uint64_t request_id,
                              Bounced__Envelope__BodyCase want, struct bd_cli_answer *out,
                              struct bd_err_detail *detail)
{
    struct wait wait = {.request_id = request_id, .at_once = true};
    return receive(conn, &wait, want, out, detail);
}

// A request that does nothing: no request has the number 0.
static enum bd_err say_something(struct bd_cli_conn *conn, struct bd_err_detail *detail)
{
    Bounced__Cancel body = BOUNCED__CANCEL__INIT;
    body.has_request_id = 1;
    Bounced__Envelope envelope = BOUNCED__ENVELOPE__INIT;
    envelope.body_case = BOUNCED__ENVELOPE__BODY_CANCEL;
    envelope.cancel = &body;
    struct bd_cli_answer answer;
    enum bd_err err = bd_cli_conn_call(conn, &envelope, NULL, 0, BOUNCED__ENVELOPE__BODY_DONE, NULL,
                                       &answer, detail);
    bd_cli_answer_finish(&answer);
    return err;
}

enum bd_err bd_cli_conn_wait_for_input(struct bd_cli_conn *conn, int fd,
                                       struct bd_err_detail *detail)
{
    enum bd_err err = greet(conn, detail);
    struct pollfd fds[2] = {{.fd = fd, .events = POLLIN},
                            {.fd = bd_interrupt_fd(), .events = POLLIN}};
    while (!err) {
        int ready = poll(fds, 2, conn->idle_ms ? conn->idle_ms / 3 : -1);
        if (bd_interrupted()) return bd_err_set(detail, BD_ERR_CANCELLED, "", "interrupted");
        if (ready > 0) return BD_ERR_OK;
        if (ready == 0) err = say_something(conn, detail);
    }
    return err;
}

// The first line of the file, without what surrounds it.
static enum bd_err read_token(const char *path, char token[TOKEN_BYTES_MAX],
                              struct bd_err_detail *detail)
{
    FILE *file = fopen(path, "re");
    if (!file)
        return bd_err_set(detail, BD_ERR_IO, "token-file", "%.200s: %s", path, strerror(errno));
    char *line = fgets(token, TOKEN_BYTES_MAX, file);
    fclose(file);
    if (line) line[strcspn(line, " \t\r\n")] = 0;
    if (!line || !*line)
        return bd_err_set(detail, BD_ERR_USAGE, "token-file", "%.200s: no token in it", path);
    return BD_ERR_OK;
}

static enum bd_err send_hello(struct bd_cli_conn *conn, const char *token_file,
                              struct bd_err_detail *detail)
{
    char token[TOKEN_BYTES_MAX];
    Bounced__Hello hello = BOUNCED__HELLO__INIT;
    hello.has_min = hello.has_max = 1;
    hello.min = BD_PROTOCOL_VERSION_MIN;
    hello.max = BD_PROTOCOL_VERSION_MAX;
    hello.client = (char *)"bounce/" BD_VERSION;
    if (token_file) {
        enum bd_err err = read_token(token_file, token, detail);
        if (err) return err;
        hello.token = token;
    }
    Bounced__Envelope envelope = BOUNCED__ENVELOPE__INIT;
    envelope.body_case = BOUNCED__ENVELOPE__BODY_HELLO;
    envelope.hello = &hello;
    enum bd_err err = send_request(conn, &envelope, NULL, 0, detail);
    conn->hello_id = conn->last_request_id;
    return err == BD_ERR_UNREACHABLE ? BD_ERR_OK : err; // the first call finds out why
}

static enum bd_err nobody(struct bd_err_detail *detail)
{
    char path[512];
    if (!bd_transport_default_path(path, sizeof path))
        return bd_err_set(detail, BD_ERR_UNREACHABLE, "server",
                          "no daemon: XDG_RUNTIME_DIR is not set; name one by --server");
    return bd_err_set(detail, BD_ERR_UNREACHABLE, "server",
                      "no daemon at %.200s; start bounced, or name one by --server", path);
}

static enum bd_err reach(struct bd_cli_conn *conn, const struct bd_cli_common *common,
                         enum bd_cli_conn_kind kind, struct bd_err_detail *detail)
{
    if (common->server) return bd_transport_connect(common->server, &conn->fd, detail);
    // A device can be chosen for a new daemon only.
    if (!common->device && bd_transport_connect_default(&conn->fd)) return BD_ERR_OK;
    if (kind == BD_CLI_CONN_RUNNING) return nobody(detail);
    const struct bd_private_options daemon = {common->device, common->quick_code, common->quiet};
    enum bd_err err = bd_transport_start_private(&daemon, &conn->fd, &conn->child, detail);
    if (!err) bd_interrupt_set_child(conn->child);
    return err;
}

enum bd_err bd_cli_conn_open(const struct bd_cli_common *common, enum bd_cli_conn_kind kind,
                             struct bd_cli_conn **out, struct bd_err_detail *detail)
{
    struct bd_cli_conn *conn = calloc(1, sizeof *conn);
    if (!conn) return bd_err_set(detail, BD_ERR_NO_MEMORY, "", "no memory for a connection");
    conn->fd = -1;
    bd_decoder_init(&conn->decoder, MESSAGE_BYTES, HEADER_BYTES);
    enum bd_err err = reach(conn, common, kind, detail);
    if (!err && fcntl(conn->fd, F_SETFL, O_NONBLOCK))
        err = bd_err_set(detail, BD_ERR_INTERNAL, "", "no non-blocking socket");
    if (!err) err = send_hello(conn, common->token_file, detail);
    if (err) bd_cli_conn_close(&conn);
    *out = conn;
    return err;
}

void bd_cli_conn_close(struct bd_cli_conn **conn)
{
    if (!*conn) return;
    if ((*conn)->fd >= 0) close((*conn)->fd);
    if ((*conn)->child) bd_transport_reap((*conn)->child, bd_interrupted() ? 1000 : 5000);
    bd_interrupt_set_child(0);
    bd_decoder_finish(&(*conn)->decoder);
    free(*conn);
    *conn = NULL;
}
