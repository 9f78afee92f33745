// Opens the rooms, runs the loop, and ends both in order.

#include "net/net.h"

#include <signal.h>
#include <stddef.h>
#include <stdlib.h>

#include "base/assert.h"
#include "base/clock.h"
#include "base/log.h"
#include "net/access/auth.h"
#include "net/access/cookie.h"
#include "net/command/command.h"
#include "net/commit/commit.h"
#include "net/commit/idle_commit.h"
#include "net/listen.h"
#include "net/loop/client.h"
#include "net/loop/conn.h"
#include "net/net_internal.h"
#include "net/reload.h"
#include "net/session/framed.h"
#include "net/session/session.h"

// Once the patience of a drain is over, so long for the last answers to arrive.
#define FAREWELL_NS 1000000000u

// --- the loop's own events ------------------------------------------------------------------

static void cancel_everything(struct bd_net *net)
{
    for (struct bd_command *command = net->commands.list; command;) {
        struct bd_command *next = bd_command_next(command);
        bd_command_cancel(command);
        command = next;
    }
}

static bool is_idle(const struct bd_net *net)
{
    return net->loop.conn_count == 0 && net->commands.count == 0 && net->live.view_count == 0 &&
           bd_commits_are_idle(&net->commits);
}

static void drain_conns(struct bd_net *net, bool at_once)
{
    for (struct bd_conn *conn = net->loop.conns; conn;) {
        struct bd_conn *next = conn->next;
        if (at_once)
            bd_conn_kill(conn);
        else if (conn->state == BD_CONN_OPEN)
            conn->ops->drain(conn);
        conn = next;
    }
}

static void drain_step(struct bd_net *net)
{
    uint64_t now_ns = bd_clock_ns();
    if (now_ns > net->drain_until_ns) cancel_everything(net);
    drain_conns(net, now_ns > net->drain_until_ns + FAREWELL_NS);
    if (!is_idle(net)) return;
    // What the last requests laid transient; once, for a disk that is full stays full.
    if (!net->has_committed_rest) {
        net->has_committed_rest = true;
        bd_idle_commit_run(&net->commits, true);
        if (bd_commit_is_pending(&net->commits)) return;
    }
    uv_stop(&net->loop.uv);
}

static void on_tick(uv_timer_t *timer)
{
    struct bd_net *net = timer->data;
    for (struct bd_conn *conn = net->loop.conns; conn;) {
        struct bd_conn *next = conn->next;
        bd_conn_tick(conn);
        conn = next;
    }
    bd_sessions_sweep(&net->sessions);
    bd_clients_sweep(net->loop.clients);
    bd_command_tick(&net->commands);
    if (net->loop.draining) drain_step(net);
}

void bd_net_begin_drain(struct bd_net *net)
{
    uint64_t now_ns = bd_clock_ns();
    if (net->loop.draining) {
        net->drain_until_ns = now_ns; // asked twice: no more patience
        return;
    }
    bd_log(net->options.private_fd < 0 ? BD_LOG_INFO : BD_LOG_DEBUG, "net",
           "draining: %u requests are under way", net->commands.count);
    net->loop.draining = true;
    bd_idle_commit_run(&net->commits, true);
    net->drain_until_ns = now_ns + net->options.serving.limits.drain_seconds * 1000000000u;
    bd_listeners_close(net);
    uv_timer_start(&net->tick, on_tick, 0, 50);
}

static void on_signal(uv_signal_t *signal, int number)
{
    (void)number;
    bd_net_begin_drain(signal->data);
}

static void on_reload(uv_signal_t *signal, int number)
{
    (void)number;
    bd_net_reload(signal->data);
}

// The private daemon lives as long as its one connection.
static void on_conn_left(struct bd_loop *loop)
{
    struct bd_net *net = (struct bd_net *)((char *)loop - offsetof(struct bd_net, loop));
    if (net->options.private_fd >= 0 && !loop->draining) bd_net_begin_drain(net);
}

static void start_own_handles(struct bd_net *net)
{
    uv_loop_t *uv = &net->loop.uv;
    uv_timer_init(uv, &net->tick);
    uv_signal_init(uv, &net->sigterm);
    uv_signal_init(uv, &net->sigint);
    uv_signal_init(uv, &net->sighup);
    net->tick.data = net->sigterm.data = net->sigint.data = net->sighup.data = net;
    uv_timer_start(&net->tick, on_tick, 1000, 1000);
    uv_signal_start(&net->sigterm, on_signal, SIGTERM);
    uv_signal_start(&net->sighup, on_reload, SIGHUP);
    // Ctrl-C reaches the client and its private daemon alike; the client says what is to be done.
    if (net->options.private_fd < 0)
        uv_signal_start(&net->sigint, on_signal, SIGINT);
    else
        signal(SIGINT, SIG_IGN);
    signal(SIGPIPE, SIG_IGN);
    signal(SIGXFSZ, SIG_IGN); // a file that may not grow is an error of write() like a full disk
}

// --- create, run, destroy -------------------------------------------------------------------

static enum bd_err open_transports(struct bd_net *net, struct bd_err_detail *detail)
{
    const struct bd_net_options *options = &net->options;
    if (options->private_fd >= 0)
        return bd_framed_open_private(&net->sessions, options->private_fd)
                   ? BD_ERR_OK
                   : bd_err_set(detail, BD_ERR_USAGE, "private",
                                "descriptor %d is no stream socket", options->private_fd);
    enum bd_err err = BD_ERR_OK;
    if (options->http) err = bd_listen_on(net, options->http, true, detail);
    for (int i = 0; !err && i < BD_NET_LISTEN_MAX && options->listens[i]; i++)
        err = bd_listen_on(net, options->listens[i], false, detail);
    return err;
}

// From below upwards: each has what it stands on.
static void open_rooms(struct bd_net *net)
{
    const struct bd_limits *limits = &net->options.serving.limits;
    struct bd_loop *loop = &net->loop;
    uv_loop_init(&loop->uv);
    loop->serving = &net->options.serving;
    loop->counts.start_ns = bd_clock_ns();
    loop->clients = bd_clients_create(limits);
    loop->conn_left = on_conn_left;
    bd_heartbeat_init(&loop->heart, &loop->uv);
    bd_background_begin(loop);
    net->access.cookies = bd_cookies_create(limits);
    bd_live_begin(&net->live, loop);
    bd_commits_begin(&net->commits, loop, &net->live);
    bd_commands_begin(&net->commands, &net->commits, net->options.import_program);
    net->sessions =
        (struct bd_sessions){.loop = loop, .access = &net->access, .commands = &net->commands};
    net->web =
        (struct bd_web){.sessions = &net->sessions, .public_names = net->options.public_names};
}

enum bd_err bd_net_create(const struct bd_net_options *options, struct bd_net **out,
                          struct bd_err_detail *detail)
{
    struct bd_net *net = calloc(1, sizeof *net);
    BD_ASSERT(net);
    net->options = *options;
    enum bd_err err = bd_tokens_read(options->token_file, &net->access.tokens, detail);
    if (err) {
        free(net);
        return err;
    }
    open_rooms(net);
    start_own_handles(net);
    err = open_transports(net, detail);
    if (err)
        bd_net_destroy(&net);
    else
        *out = net;
    return err;
}

void bd_net_run(struct bd_net *net)
{
    uv_run(&net->loop.uv, UV_RUN_DEFAULT);
}

static void close_handles(struct bd_net *net)
{
    uv_handle_t *const own[] = {(uv_handle_t *)&net->tick, (uv_handle_t *)&net->sigterm,
                                (uv_handle_t *)&net->sigint, (uv_handle_t *)&net->sighup};
    for (size_t i = 0; i < sizeof own / sizeof own[0]; i++) uv_close(own[i], NULL);
    bd_commits_close(&net->commits);
    bd_live_close(&net->live);
    bd_background_close(&net->loop);
    bd_heartbeat_close(&net->loop.heart);
    // libuv gives the signals back to the system, which ends the process by them: one more from
    // somebody impatient must not cost the rooms below their orderly end.
    signal(SIGTERM, SIG_IGN);
    signal(SIGINT, SIG_IGN);
    signal(SIGHUP, SIG_IGN);
    uv_run(&net->loop.uv, UV_RUN_DEFAULT); // lets every handle hear that it is closed
    BD_ASSERT_CMP(uv_loop_close(&net->loop.uv), ==, 0);
}

void bd_net_destroy(struct bd_net **net_address)
{
    struct bd_net *net = *net_address;
    if (!net) return;
    bd_listeners_close(net);
    while (net->loop.conns) bd_conn_kill(net->loop.conns);
    close_handles(net);
    bd_background_finish(&net->loop);
    bd_commits_finish(&net->commits);
    bd_live_finish(&net->live);
    bd_sessions_sweep(&net->sessions);
    bd_clients_destroy(&net->loop.clients);
    bd_cookies_destroy(&net->access.cookies);
    bd_commands_finish(&net->commands);
    bd_tokens_destroy(&net->access.tokens);
    bd_options_finish(&net->reloaded);
    free(net);
    *net_address = NULL;
}
