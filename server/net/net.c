#include "net/net.h"

#include <signal.h>
#include <stdlib.h>

#include "base/assert.h"
#include "base/clock.h"
#include "base/log.h"
#include "net/command.h"
#include "net/commit.h"
#include "net/cookie.h"
#include "net/edit_step.h"
#include "net/frame_cache.h"
#include "net/frame_job.h"
#include "net/framed.h"
#include "net/import_cache.h"
#include "net/journal_turn.h"
#include "net/listen.h"
#include "net/net_internal.h"
#include "net/reload.h"
#include "net/session.h"
#include "net/view.h"

// Once the patience of a drain is over, so long for the last answers to arrive.
#define FAREWELL_NS 1000000000u

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

static void drain_conns(struct bd_net *net, bool at_once)
{
    for (struct bd_conn *conn = net->conns; conn;) {
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

void bd_net_conn_joined(struct bd_net *net)
{
    bd_heartbeat_set(&net->heart, true);
}

// The private daemon lives as long as its one connection.
void bd_net_conn_left(struct bd_net *net)
{
    bd_heartbeat_set(&net->heart, net->conn_count > 0);
    if (net->options.private_fd >= 0 && !net->draining) bd_net_begin_drain(net);
}

static void start_own_handles(struct bd_net *net)
{
    uv_loop_init(&net->loop);
    uv_mutex_init(&net->ended_lock);
    uv_async_init(&net->loop, &net->frames_ended, on_frames_ended);
    uv_timer_init(&net->loop, &net->tick);
    bd_heartbeat_init(&net->heart, &net->loop);
    uv_timer_init(&net->loop, &net->quiet_timer);
    bd_background_begin(net);
    bd_commit_begin(net);
    bd_disk_watch_begin(net);
    bd_views_begin(net);
    uv_signal_init(&net->loop, &net->sigterm);
    uv_signal_init(&net->loop, &net->sigint);
    uv_signal_init(&net->loop, &net->sighup);
    net->frames_ended.data = net->tick.data = net->sigterm.data = net->sigint.data = net;
    net->sighup.data = net;
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

static enum bd_err open_faces(struct bd_net *net, struct bd_fault *fault)
{
    const struct bd_net_options *options = &net->options;
    if (options->private_fd >= 0)
        return bd_framed_open_private(net, options->private_fd)
                   ? BD_ERR_OK
                   : bd_fault_set(fault, BD_ERR_USAGE, "private",
                                  "descriptor %d is no stream socket", options->private_fd);
    enum bd_err err = BD_ERR_OK;
    if (options->http) err = bd_listen_on(net, options->http, true, fault);
    for (int i = 0; !err && i < BD_NET_LISTEN_MAX && options->listens[i]; i++)
        err = bd_listen_on(net, options->listens[i], false, fault);
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
    net->frame_cache = bd_frame_cache_create(&net->options.limits);
    // As many as there may be at work at once.
    net->import_pool = bd_import_pool_create(options->import_program,
                                             (uint32_t)options->limits.imports_at_once);
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
    bd_listeners_close(net);
    while (net->conns) bd_conn_kill(net->conns);
    uv_close((uv_handle_t *)&net->frames_ended, NULL);
    uv_close((uv_handle_t *)&net->tick, NULL);
    bd_heartbeat_close(&net->heart);
    uv_close((uv_handle_t *)&net->quiet_timer, NULL);
    bd_background_close(net);
    bd_commit_close(net);
    bd_disk_watch_close(net);
    bd_views_finish(net);
    uv_close((uv_handle_t *)&net->sigterm, NULL);
    uv_close((uv_handle_t *)&net->sigint, NULL);
    uv_close((uv_handle_t *)&net->sighup, NULL);
    // libuv gives the signals back to the system, which ends the process by them: one more from
    // somebody impatient must not cost the rooms below their orderly end.
    signal(SIGTERM, SIG_IGN);
    signal(SIGINT, SIG_IGN);
    signal(SIGHUP, SIG_IGN);
    uv_run(&net->loop, UV_RUN_DEFAULT); // lets every handle hear that it is closed
    BD_ASSERT_CMP(uv_loop_close(&net->loop), ==, 0);
    uv_mutex_destroy(&net->ended_lock);
    bd_background_finish(net);
    bd_import_pool_destroy(&net->import_pool);
    bd_commit_finish(net);
    bd_sessions_sweep(net);
    bd_clients_destroy(&net->clients);
    bd_cookies_destroy(&net->cookies);
    bd_import_cache_destroy(&net->import_cache);
    bd_frame_cache_destroy(&net->frame_cache);
    bd_tokens_destroy(&net->tokens);
    bd_options_finish(&net->reloaded);
    free(net);
    *net_address = NULL;
}
