#include "net/listen.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "base/assert.h"
#include "base/log.h"
#include "net/access/auth.h"
#include "net/http/http.h"
#include "net/loop/address.h"
#include "net/loop/conn.h"
#include "net/net_internal.h"
#include "net/session/framed.h"

#define BACKLOG 128

struct bd_listener {
    struct bd_net *net;
    union bd_socket uv;
    struct bd_address address;
    bool is_http;
    struct bd_listener *next;
};

static bool is_proxied(const struct bd_listener *listener)
{
    const struct bd_serving *serving = &listener->net->options.serving;
    return listener->address.is_unix &&
           bd_proxy_has_path(serving->proxies, serving->proxy_count, listener->address.path);
}

static void on_connection(uv_stream_t *stream, int status)
{
    struct bd_listener *listener = stream->data;
    if (status < 0)
        bd_log(BD_LOG_WARN, "net", "a connection cannot be accepted: %s", uv_strerror(status));
    else if (listener->is_http)
        bd_http_accept(&listener->net->web, stream);
    else
        bd_framed_accept(&listener->net->sessions, stream, listener->address.is_unix,
                         is_proxied(listener));
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

// Made with no rights for others from its first moment on; what more there is to be comes before
// anybody can be accepted.
static enum bd_err bind_unix(struct bd_listener *listener, struct bd_err_detail *detail)
{
    const struct bd_net_options *options = &listener->net->options;
    const char *path = listener->address.path;
    uv_pipe_init(&listener->net->loop.uv, &listener->uv.pipe, 0);
    remove_dead_socket(path);
    mode_t mask = umask(0177);
    int result = uv_pipe_bind(&listener->uv.pipe, path);
    umask(mask);
    if (result < 0)
        return bd_err_set(detail, BD_ERR_IO, "listen", "unix:%s: %s", path, uv_strerror(result));
    if (options->has_socket_group && chown(path, (uid_t)-1, options->socket_group) < 0)
        return bd_err_set(detail, BD_ERR_IO, "socket-group", "%s cannot be given to group %u: %s",
                          path, options->socket_group, strerror(errno));
    if (chmod(path, options->socket_mode) < 0)
        return bd_err_set(detail, BD_ERR_IO, "socket-mode", "%s: %s", path, strerror(errno));
    return BD_ERR_OK;
}

static enum bd_err bind_tcp(struct bd_listener *listener, const char *text,
                            struct bd_err_detail *detail)
{
    const struct sockaddr *address = (const struct sockaddr *)&listener->address.inet;
    uv_tcp_init(&listener->net->loop.uv, &listener->uv.tcp);
    int result = uv_tcp_bind(&listener->uv.tcp, address, 0);
    if (result == 0) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_IO, "listen", "%s: %s", text, uv_strerror(result));
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

// Whoever means to let others in and forgot the file's mode would look for it for long.
static void warn_of_closed_door(const struct bd_listener *listener)
{
    const struct bd_net *net = listener->net;
    if (!listener->address.is_unix || net->options.socket_mode != BD_NET_SOCKET_MODE) return;
    if (bd_tokens_name_users(net->access.tokens))
        bd_log(BD_LOG_WARN, "net",
               "the token file names users, but %s is for the daemon's own alone (--socket-mode)",
               listener->address.path);
}

enum bd_err bd_listen_refuse_proxy(struct bd_err_detail *detail)
{
    return bd_err_set(detail, BD_ERR_USAGE, "proxy",
                      "--proxy lets in whomever the proxy lets in: that needs --token-file");
}

static enum bd_err check_reach(const struct bd_net *net, const struct bd_address *address,
                               const char *text, struct bd_err_detail *detail)
{
    if (bd_tokens_needed(net->access.tokens)) return BD_ERR_OK;
    if (net->options.serving.proxy_count > 0) return bd_listen_refuse_proxy(detail);
    if (bd_address_is_local(address)) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_USAGE, "listen",
                      "%s can be reached from other machines: that needs --token-file", text);
}

enum bd_err bd_listen_on(struct bd_net *net, const char *text, bool is_http,
                         struct bd_err_detail *detail)
{
    struct bd_address address;
    enum bd_err err = bd_address_parse(text, &address, detail);
    if (!err && is_http && address.is_unix)
        err = bd_err_set(detail, BD_ERR_USAGE, "http", "HTTP is spoken on HOST:PORT");
    if (!err) err = check_reach(net, &address, text, detail);
    if (err) return err;

    struct bd_listener *listener = calloc(1, sizeof *listener);
    BD_ASSERT(listener);
    *listener = (struct bd_listener){
        .net = net, .address = address, .is_http = is_http, .next = net->listeners};
    net->listeners = listener;
    err = address.is_unix ? bind_unix(listener, detail) : bind_tcp(listener, text, detail);
    listener->uv.handle.data = listener;
    if (err) return err;
    int result = uv_listen(&listener->uv.stream, BACKLOG, on_connection);
    if (result < 0)
        return bd_err_set(detail, BD_ERR_IO, "listen", "%s: %s", text, uv_strerror(result));
    note_address(listener);
    warn_of_closed_door(listener);
    return BD_ERR_OK;
}

static void on_listener_closed(uv_handle_t *handle)
{
    free(handle->data);
}

void bd_listeners_close(struct bd_net *net)
{
    while (net->listeners) {
        struct bd_listener *listener = net->listeners;
        net->listeners = listener->next;
        uv_close(&listener->uv.handle, on_listener_closed); // a Unix socket's file goes with it
    }
}
