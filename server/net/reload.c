#include "net/reload.h"

#include <stddef.h>
#include <string.h>

#include "base/log.h"
#include "net/access/cookie.h"
#include "net/listen.h"
#include "net/net_internal.h"
#include "net/options.h"
#include "net/session/session.h"

// --- limits ---------------------------------------------------------------------------------

// Those that the loop looks at each time. Of imports more at once wait for the children that there
// are.
static const size_t live[] = {
#define LIVE(name) offsetof(struct bd_limits, name)
    LIVE(message_bytes),
    LIVE(header_bytes),
    LIVE(blob_bytes),
    LIVE(blob_seconds),
    LIVE(disk_reserve_bytes),
    LIVE(frame_cache_bytes),
    LIVE(scene_name_bytes),
    LIVE(imports_at_once),
    LIVE(jobs_per_client),
    LIVE(requests_per_second),
    LIVE(failed_logins_per_minute),
    LIVE(requests_per_connection),
    LIVE(uploads_per_connection),
    LIVE(watches_per_connection),
    LIVE(views_per_connection),
    LIVE(views_per_client),
    LIVE(edit_bytes_per_client),
    LIVE(view_credits),
    LIVE(view_refine_seconds),
    LIVE(connections),
    LIVE(connections_per_client),
    LIVE(head_bytes),
    LIVE(hello_bytes),
    LIVE(header_seconds),
    LIVE(idle_seconds),
    LIVE(slow_bytes_per_second),
    LIVE(resume_seconds),
    LIVE(resumable_sessions),
    LIVE(resume_bytes),
    LIVE(keep_alive_seconds),
    LIVE(cookie_seconds),
    LIVE(drain_seconds),
#undef LIVE
};

static bool is_live(size_t offset)
{
    for (size_t i = 0; i < sizeof live / sizeof live[0]; i++)
        if (live[i] == offset) return true;
    return false;
}

static void say_restart(const char *what, const char *name)
{
    bd_log(BD_LOG_WARN, "net", "reload: %s%s is another, which needs a restart", what, name);
}

static void apply_limits(struct bd_limits *running, const struct bd_limits *fresh)
{
    uint64_t value;
    const char *name;
    // The table's rows are the struct's members, in one order.
    for (uint32_t i = 0; (name = bd_limits_get(fresh, i, &value)); i++) {
        uint64_t *member = (uint64_t *)(void *)running + i;
        if (*member == value) continue;
        if (is_live(i * sizeof value))
            *member = value;
        else
            say_restart("limit ", name);
    }
}

// --- options --------------------------------------------------------------------------------

static bool differs(const char *a, const char *b)
{
    return a && b ? strcmp(a, b) != 0 : a != b;
}

static void say_fixed(const struct bd_net_options *running, const struct bd_options *fresh)
{
    const char *http = strcmp(fresh->http, "none") == 0 ? NULL : fresh->http;
    if (differs(running->http, http)) say_restart("http", "");
    for (uint32_t i = 0; i < BD_NET_LISTEN_MAX; i++) {
        const char *listen = i < fresh->listen_count ? fresh->listens[i] : NULL;
        if (differs(running->listens[i], listen)) say_restart("listen", "");
    }
    if (running->socket_mode != fresh->socket_mode) say_restart("socket-mode", "");
    if (running->has_socket_group != fresh->has_socket_group ||
        running->socket_group != fresh->socket_group)
        say_restart("socket-group", "");
    if (differs(running->fixed.data, fresh->data)) say_restart("data", "");
    if (differs(running->fixed.device, fresh->device)) say_restart("device", "");
    if (running->fixed.quick_code != fresh->quick_code) say_restart("code", "");
    if (running->fixed.gpu_memory_mib != fresh->gpu_memory_mib) say_restart("gpu-memory", "");
    if (running->fixed.log_json != fresh->log_json) say_restart("log", "");
    if (running->fixed.sandbox != (int)fresh->sandbox) say_restart("sandbox", "");
}

static void apply(struct bd_net *net, const struct bd_options *fresh)
{
    struct bd_net_options *running = &net->options;
    say_fixed(running, fresh);
    apply_limits(&running->serving.limits, &fresh->limits);
    memcpy(running->public_names, fresh->public_names, sizeof running->public_names);
    memcpy(running->serving.proxies, fresh->proxies, sizeof running->serving.proxies);
    running->serving.proxy_count = fresh->proxy_count;
    running->token_file = fresh->token_file;
}

// --- who is out -----------------------------------------------------------------------------

static uint32_t end_conns(struct bd_net *net)
{
    uint32_t count = 0;
    for (struct bd_conn *conn = net->loop.conns; conn;) {
        struct bd_conn *next = conn->next;
        if (conn->grant && conn->grant->is_revoked) {
            // What finishes is on its way to say why.
            if (conn->state == BD_CONN_OPEN) bd_conn_kill(conn);
            count++;
        }
        conn = next;
    }
    return count;
}

// With or without a token file is for the listeners to know before they open.
static enum bd_err read_tokens(struct bd_net *net, const struct bd_options *fresh,
                               struct bd_err_detail *detail)
{
    if (!fresh->token_file != !net->options.token_file)
        return bd_err_set(detail, BD_ERR_USAGE, "token-file",
                          "token-file: with it or without it is a restart's affair");
    if (fresh->proxy_count > 0 && !fresh->token_file) return bd_listen_refuse_proxy(detail);
    return fresh->token_file ? bd_tokens_reload(net->access.tokens, fresh->token_file, detail)
                             : BD_ERR_OK;
}

void bd_net_reload(struct bd_net *net)
{
    struct bd_options fresh;
    struct bd_err_detail detail;
    if (net->loop.draining || !net->options.argv) return;
    enum bd_err err = bd_options_read(&fresh, net->options.argc, net->options.argv, &detail);
    if (!err) err = read_tokens(net, &fresh, &detail);
    if (err) {
        bd_log(BD_LOG_ERROR, "net", "reload: nothing is changed: %s", detail.message);
        bd_options_finish(&fresh);
        return;
    }
    apply(net, &fresh);
    // Sessions first: those of its connections would wait for another.
    bd_sessions_revoke(&net->sessions);
    const uint32_t closed = end_conns(net);
    bd_cookies_revoke(net->access.cookies);
    bd_options_finish(&net->reloaded); // whose texts were in use until now
    net->reloaded = fresh;
    bd_log(BD_LOG_INFO, "net", "reload: tokens and options are read again; %u connections closed",
           closed);
}
