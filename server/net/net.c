#include "net/net.h"

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "base/assert.h"
#include "base/clock.h"
#include "base/log.h"
#include "net/address.h"
#include "net/command.h"
#include "net/commit.h"
#include "net/cookie.h"
#include "net/edit_step.h"
#include "net/frame_job.h"
#include "net/framed.h"
#include "net/http.h"
#include "net/import_cache.h"
#include "net/journal_turn.h"
#include "net/net_internal.h"
#include "net/session.h"
#include "net/view.h"

#define BACKLOG 128

struct bd_listener {
    struct bd_net *net;
    union {
        uv_handle_t handle;
        uv_stream_t stream;
        uv_tcp_t tcp;
        uv_pipe_t pipe;
    } uv;
    struct bd_address address;
    bool is_http;
    struct bd_listener *next;
};

// --- listening ------------------------------------------------------------------------------

static void on_connection(uv_stream_t *stream, int status)
{
    struct bd_listener *listener = stream->data;
    if (status < 0)
        bd_log(BD_LOG_WARN, "net", "a connection cannot be accepted: %s", uv_strerror(status));
    else if (listener->is_http)
        bd_http_accept(listener->net, stream);
    else
        bd_framed_accept(listener->net, stream, listener->address.is_unix);
}

// A socket file that nobody answers on was left by a process that was killed.
static void remove_dead_socket(const char *path)
{
    struct stat info;
    if (lstat(path, &info) < 0 || !S_ISSOCK(info.st_mode)) return;
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    snprintf(address.sun_path, sizeof address.sun_path, "%s", path);
    int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (fd < 0) return;
    if (connect(fd, (struct sockaddr *)&address, sizeof address) < 0 && errno == ECONNREFUSED)
        unlink(path);
    close(fd);
}

static int bind_unix(struct bd_listener *listener)
{
    uv_pipe_init(&listener->net->loop, &listener->uv.pipe, 0);
    remove_dead_socket(listener->address.path);
    // Made with no rights for others from its first moment on.
    mode_t mask = umask(0177);
    int result = uv_pipe_bind(&listener->uv.pipe, listener->address.path);
    umask(mask);
    return result;
}

static int bind_tcp(struct bd_listener *listener)
{
    uv_tcp_init(&listener->net->loop, &listener->uv.tcp);
    return uv_tcp_bind(&listener->uv.tcp, (const struct sockaddr *)&listener->address.inet, 0);
}

static void note_address(struct bd_listener *listener)
{
    char text[128];
    int size = sizeof listener->address.inet;
    if (!listener->address.is_unix)
        uv_tcp_getsockname(&listener->uv.tcp, (struct sockaddr *)&listener->address.inet, &size);
    bd_address_text(&listener->address, text, sizeof text);
    bd_log(BD_LOG_INFO, "net", "listening on %s%s", listener->is_http ? "http://" : "", text);
}

static enum bd_err check_reach(const struct bd_net *net, const struct bd_address *address,
                               const char *text, struct bd_fault *fault)
{
    if (bd_address_is_local(address) || bd_tokens_needed(net->tokens)) return BD_ERR_OK;
    return bd_fault_set(fault, BD_ERR_USAGE, "listen",
                        "%s can be reached from other machines: that needs --token-file", text);
}

static enum bd_err listen_on(struct bd_net *net, const char *text, bool is_http,
                             struct bd_fault *fault)
{
    struct bd_address address;
    enum bd_err err = bd_address_parse(text, &address, fault);
    if (!err && is_http && address.is_unix)
        err = bd_fault_set(fault, BD_ERR_USAGE, "http", "HTTP is spoken on HOST:PORT");
    if (!err) err = check_reach(net, &address, text, fault);
    if (err) return err;

    struct bd_listener *listener = calloc(1, sizeof *listener);
    BD_ASSERT(listener);
    *listener = (struct bd_listener){
        .net = net, .address = address, .is_http = is_http, .next = net->listeners};
    net->listeners = listener;
    int result = address.is_unix ? bind_unix(listener) : bind_tcp(listener);
    listener->uv.handle.data = listener;
    if (result == 0) result = uv_listen(&listener->uv.stream, BACKLOG, on_connection);
    if (result < 0)
        return bd_fault_set(fault, BD_ERR_IO, "listen", "%s: %s", text, uv_strerror(result));
    note_address(listener);
    return BD_ERR_OK;
}

static void on_listener_closed(uv_handle_t *handle)
{
    free(handle->data);
}

static void close_listeners(struct bd_net *net)
{
    while (net->listeners) {
        struct bd_listener *listener = net->listeners;
        net->listeners = listener->next;
        uv_close(&listener->uv.handle, on_listener_closed); // a Unix socket's file goes with it
    }
}

// --- the loop's own events ------------------------------------------------------------------

static void cancel_everything(struct bd_net *net)
{
    for (struct bd_command *command = net->commands; command;) {
        struct bd_command *next = bd_command_next(command);
        bd_command_cancel(command);
        command = next;
    }
}

static void on_frames_ended(uv_async_t *async)
{
    bd_frame_jobs_collect(async->data);
}

static bool is_idle(const struct bd_net *net)
{
    return net->conn_count == 0 && net->command_count == 0 && net->view_count == 0 &&
           !bd_commit_is_pending(net) && !bd_journal_turn_is_taken(net);
}

static void drain_step(struct bd_net *net)
{
    if (bd_clock_ns() > net->drain_until_ns) cancel_everything(net);
    for (struct bd_conn *conn = net->conns; conn;) {
        struct bd_conn *next = conn->next;
        if (conn->state == BD_CONN_OPEN) conn->ops->drain(conn);
        conn = next;
    }
    if (!is_idle(net)) return;
    // What the last requests laid transient; once, for a disk that is full stays full.
    if (!net->has_committed_rest) {
        net->has_committed_rest = true;
        bd_edit_commit_quiet(net, true);
        if (bd_commit_is_pending(net)) return;
    }
    uv_stop(&net->loop);
}

static void on_tick(uv_timer_t *timer)
{
    struct bd_net *net = timer->data;
    for (struct bd_conn *conn = net->conns; conn;) {
        struct bd_conn *next = conn->next;
        bd_conn_tick(conn);
        conn = next;
    }
    bd_sessions_sweep(net);
    bd_clients_sweep(net->clients);
    bd_command_tick(net);
    if (net->draining) drain_step(net);
}

void bd_net_begin_drain(struct bd_net *net)
{
    uint64_t now_ns = bd_clock_ns();
    if (net->draining) {
        net->drain_until_ns = now_ns; // asked twice: no more patience
        return;
    }
    bd_log(net->options.private_fd < 0 ? BD_LOG_INFO : BD_LOG_DEBUG, "net",
           "draining: %u requests are under way", net->command_count);
    net->draining = true;
    bd_edit_commit_quiet(net, true);
    net->drain_until_ns = now_ns + net->options.limits.drain_seconds * 1000000000u;
    close_listeners(net);
    uv_timer_start(&net->tick, on_tick, 0, 50);
}

static void on_signal(uv_signal_t *signal, int number)
{
    (void)number;
    bd_net_begin_drain(signal->data);
}

// The private daemon lives as long as its one connection.
void bd_net_conn_left(struct bd_net *net)
{
    if (net->options.private_fd >= 0 && !net->draining) bd_net_begin_drain(net);
}

static void start_own_handles(struct bd_net *net)
{
    uv_loop_init(&net->loop);
    uv_mutex_init(&net->ended_lock);
    uv_async_init(&net->loop, &net->frames_ended, on_frames_ended);
    uv_timer_init(&net->loop, &net->tick);
    uv_timer_init(&net->loop, &net->quiet_timer);
    bd_commit_begin(net);
    bd_views_begin(net);
    uv_signal_init(&net->loop, &net->sigterm);
    uv_signal_init(&net->loop, &net->sigint);
    net->frames_ended.data = net->tick.data = net->sigterm.data = net->sigint.data = net;
    uv_timer_start(&net->tick, on_tick, 1000, 1000);
    uv_signal_start(&net->sigterm, on_signal, SIGTERM);
    // Ctrl-C reaches the client and its private daemon alike; the client says what is to be done.
    if (net->options.private_fd < 0)
        uv_signal_start(&net->sigint, on_signal, SIGINT);
    else
        signal(SIGINT, SIG_IGN);
    signal(SIGPIPE, SIG_IGN);
    signal(SIGXFSZ, SIG_IGN); // a file that may not grow is an error of write() like a full disk
}

// --- create, run, destroy -------------------------------------------------------------------

static enum bd_err open_faces(struct bd_net *net, struct bd_fault *fault)
{
    const struct bd_net_options *options = &net->options;
    if (options->private_fd >= 0)
        return bd_framed_open_private(net, options->private_fd)
                   ? BD_ERR_OK
                   : bd_fault_set(fault, BD_ERR_USAGE, "private",
                                  "descriptor %d is no stream socket", options->private_fd);
    enum bd_err err = BD_ERR_OK;
    if (options->http) err = listen_on(net, options->http, true, fault);
    for (int i = 0; !err && i < BD_NET_LISTEN_MAX && options->listens[i]; i++)
        err = listen_on(net, options->listens[i], false, fault);
    return err;
}

enum bd_err bd_net_create(const struct bd_net_options *options, struct bd_net **out,
                          struct bd_fault *fault)
{
    struct bd_net *net = calloc(1, sizeof *net);
    BD_ASSERT(net);
    net->options = *options;
    net->start_ns = bd_clock_ns();
    enum bd_err err = bd_tokens_read(options->token_file, &net->tokens, fault);
    if (err) {
        free(net);
        return err;
    }
    net->import_cache = bd_import_cache_create();
    net->clients = bd_clients_create(&net->options.limits);
    net->cookies = bd_cookies_create(&net->options.limits);
    start_own_handles(net);
    err = open_faces(net, fault);
    if (err)
        bd_net_destroy(&net);
    else
        *out = net;
    return err;
}

void bd_net_run(struct bd_net *net)
{
    uv_run(&net->loop, UV_RUN_DEFAULT);
}

void bd_net_destroy(struct bd_net **net_address)
{
    struct bd_net *net = *net_address;
    if (!net) return;
    close_listeners(net);
    while (net->conns) bd_conn_kill(net->conns);
    uv_close((uv_handle_t *)&net->frames_ended, NULL);
    uv_close((uv_handle_t *)&net->tick, NULL);
    uv_close((uv_handle_t *)&net->quiet_timer, NULL);
    bd_commit_close(net);
    bd_views_finish(net);
    uv_close((uv_handle_t *)&net->sigterm, NULL);
    uv_close((uv_handle_t *)&net->sigint, NULL);
    // libuv gives the signals back to the system, which ends the process by them: one more from
    // somebody impatient must not cost the rooms below their orderly end.
    signal(SIGTERM, SIG_IGN);
    signal(SIGINT, SIG_IGN);
    uv_run(&net->loop, UV_RUN_DEFAULT); // lets every handle hear that it is closed
    BD_ASSERT_CMP(uv_loop_close(&net->loop), ==, 0);
    uv_mutex_destroy(&net->ended_lock);
    bd_commit_finish(net);
    bd_sessions_sweep(net);
    bd_clients_destroy(&net->clients);
    bd_cookies_destroy(&net->cookies);
    bd_import_cache_destroy(&net->import_cache);
    bd_tokens_destroy(&net->tokens);
    free(net);
    *net_address = NULL;
}
