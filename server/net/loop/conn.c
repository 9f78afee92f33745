#include "net/loop/conn.h"

#include <stdio.h>
#include <stdlib.h>

#include "base/assert.h"
#include "base/clock.h"
#include "base/log.h"
#include "net/loop/address.h"
#include "net/loop/client.h"
#include "net/loop/loop.h"
#include "net/loop/peer.h"
#include "net/loop/proxy.h"

#define READ_BYTES         65536
#define FINISH_PATIENCE_NS 5000000000u
// Once our side is shut, so long for the peer to take notice.
#define LINGER_NS   2000000000u
#define KEEPALIVE_S 60
// Pieces that have not left, or of which the loop has not heard yet that they did.
#define WRITES_MAX           1024
#define STRANGERS_WRITES_MAX 16

struct write_request {
    uv_write_t uv;
    struct bd_conn *conn;
    uint8_t *first, *second;
};

void bd_conn_touch(struct bd_conn *conn)
{
    conn->active_ns = bd_clock_ns();
}

static void on_closed(uv_handle_t *handle)
{
    struct bd_conn *conn = handle->data;
    bd_client_release(&conn->client);
    bd_client_release(&conn->origin);
    free(conn->proxy);
    conn->ops->free(conn);
}

static void leave_list(struct bd_conn *conn)
{
    if (conn->previous)
        conn->previous->next = conn->next;
    else
        conn->loop->conns = conn->next;
    if (conn->next) conn->next->previous = conn->previous;
    conn->client->connections--;
    conn->loop->conn_count--;
    bd_heartbeat_set(&conn->loop->heart, conn->loop->conn_count > 0);
    if (conn->loop->conn_left) conn->loop->conn_left(conn->loop);
}

void bd_conn_kill(struct bd_conn *conn)
{
    if (conn->state == BD_CONN_CLOSED) return;
    bool told = conn->state == BD_CONN_FINISHING;
    conn->state = BD_CONN_CLOSED;
    if (!told) conn->ops->gone(conn);
    leave_list(conn);
    uv_close(&conn->uv.handle, on_closed);
}

// --- whose it is ----------------------------------------------------------------------------

static const char *limit_of_client(const struct bd_conn *conn, const struct bd_client *client)
{
    return client->connections >= conn->loop->serving->limits.connections_per_client
               ? "limit connections_per_client"
               : NULL;
}

// Takes the reference.
static void count_for(struct bd_conn *conn, struct bd_client *client)
{
    conn->client->connections--;
    client->connections++;
    bd_client_release(&conn->client);
    conn->client = client;
}

enum bd_err bd_conn_identify(struct bd_conn *conn, const struct bd_grant *grant, const char *token,
                             struct bd_err_detail *detail)
{
    char key[sizeof conn->client->key];
    struct bd_client *client = conn->origin;
    if (token) {
        snprintf(key, sizeof key, "token:%s", token);
        client = bd_client_get(conn->loop->clients, key);
    } else {
        bd_client_retain(client);
    }
    // Who is known by an address again was counted for it when it came.
    if (client != conn->client && client != conn->origin && limit_of_client(conn, client)) {
        bd_err_set(detail, BD_ERR_BUSY, "connections_per_client",
                   "%u connections of \"%s\" are open (limit connections_per_client)",
                   client->connections, token);
        bd_client_release(&client);
        return BD_ERR_BUSY;
    }
    count_for(conn, client);
    conn->grant = grant;
    return BD_ERR_OK;
}

// The proxy has said for whom it asks. False, and the connection is closed, if that one has too
// many already.
static bool arrive(struct bd_conn *conn)
{
    char key[64];
    if (conn->proxy->has_source) {
        bd_sockaddr_stranger(&conn->proxy->source, key, sizeof key);
        bd_client_release(&conn->origin);
        conn->origin = bd_client_get(conn->loop->clients, key);
        const char *limit = limit_of_client(conn, conn->origin);
        bd_client_retain(conn->origin);
        count_for(conn, conn->origin);
        if (limit) {
            bd_log(BD_LOG_DEBUG, "net", "%s: a connection was closed at once (%s)", key, limit);
            conn->loop->counts.requests_refused++;
            bd_conn_kill(conn);
            return false;
        }
    }
    free(conn->proxy);
    conn->proxy = NULL;
    return true;
}

// Of the bytes that came, those that are the header's. False: more is to come, or it is closed.
static bool take_proxy_header(struct bd_conn *conn, const uv_buf_t *buf, size_t size, size_t *taken)
{
    struct bd_err_detail detail;
    if (bd_proxy_feed(conn->proxy, (const uint8_t *)buf->base, size, taken, &detail)) {
        bd_log(BD_LOG_WARN, "net", "%s: %s; it was closed", conn->client->key, detail.message);
        conn->loop->counts.requests_refused++;
        bd_conn_kill(conn);
        return false;
    }
    return conn->proxy->is_complete && arrive(conn);
}

// --- reading and writing --------------------------------------------------------------------

static void on_alloc(uv_handle_t *handle, size_t suggested, uv_buf_t *buf)
{
    const struct bd_conn *conn = handle->data;
    (void)suggested;
    // One buffer is enough: libuv reads and calls back before it reads the next connection.
    static char bytes[READ_BYTES];
    *buf = uv_buf_init(bytes, (unsigned)bd_conn_room_bytes(conn, sizeof bytes));
}

static void on_read(uv_stream_t *stream, ssize_t size, const uv_buf_t *buf)
{
    size_t taken = 0;
    struct bd_conn *conn = stream->data;
    if (size < 0) {
        bd_conn_kill(conn);
    } else if (size > 0) {
        conn->loop->counts.bytes_in += (uint64_t)size;
        conn->in_bytes += (uint64_t)size;
        conn->heard_ns = bd_clock_ns();
        if (conn->state != BD_CONN_OPEN) return;
        if (conn->proxy && !take_proxy_header(conn, buf, (size_t)size, &taken)) return;
        if (!conn->clock_runs) bd_conn_touch(conn);
        if (taken == (size_t)size) return;
        conn->ops->bytes(conn, (const uint8_t *)buf->base + taken, (size_t)size - taken);
    }
}

void bd_conn_read(struct bd_conn *conn, bool wanted)
{
    if (conn->reading == wanted || conn->state == BD_CONN_CLOSED) return;
    conn->reading = wanted;
    if (wanted) {
        if (!conn->clock_runs) bd_conn_touch(conn);
        if (uv_read_start(&conn->uv.stream, on_alloc, on_read) < 0) conn->is_broken = true;
    } else {
        uv_read_stop(&conn->uv.stream);
    }
}

static void on_shut(uv_shutdown_t *request, int status)
{
    struct bd_conn *conn = request->handle->data;
    free(request);
    if (status < 0) bd_conn_kill(conn);
}

static void shut_if_written(struct bd_conn *conn)
{
    if (conn->state != BD_CONN_FINISHING || conn->writes > 0 || conn->is_shut) return;
    conn->is_shut = true;
    conn->finishing_ns = bd_clock_ns();
    uv_shutdown_t *request = malloc(sizeof *request);
    BD_ASSERT(request);
    if (uv_shutdown(request, &conn->uv.stream, on_shut) < 0) {
        free(request);
        bd_conn_kill(conn);
    }
}

bool bd_conn_takes_more(const struct bd_conn *conn, size_t most)
{
    return bd_conn_unsent_bytes(conn) < bd_conn_room_bytes(conn, most) &&
           conn->writes < (conn->is_known ? WRITES_MAX : STRANGERS_WRITES_MAX);
}

static void free_request(struct write_request *request)
{
    free(request->first);
    free(request->second);
    free(request);
}

static void on_written(uv_write_t *uv, int status)
{
    struct write_request *request = uv->data;
    struct bd_conn *conn = request->conn;
    free_request(request);
    conn->writes--;
    if (conn->state == BD_CONN_CLOSED) return;
    if (status < 0)
        bd_conn_kill(conn);
    else if (conn->state == BD_CONN_OPEN)
        conn->ops->written(conn);
    else
        shut_if_written(conn);
}

// Takes the request with what it owns.
static void write_bufs(struct write_request *request, const uv_buf_t bufs[2])
{
    struct bd_conn *conn = request->conn;
    const size_t size = bufs[0].len + bufs[1].len;
    if (conn->state != BD_CONN_OPEN) {
        free_request(request);
        return;
    }
    request->uv.data = request;
    conn->writes++;
    if (!conn->clock_runs) bd_conn_touch(conn);
    conn->loop->counts.bytes_out += size;
    conn->out_bytes += size;
    if (uv_write(&request->uv, &conn->uv.stream, bufs, bufs[1].base ? 2 : 1, on_written) < 0) {
        conn->writes--;
        free_request(request);
        conn->is_broken = true;
    }
}

static struct write_request *new_request(struct bd_conn *conn, uint8_t *first, uint8_t *second)
{
    struct write_request *request = malloc(sizeof *request);
    BD_ASSERT(request);
    *request = (struct write_request){.conn = conn, .first = first, .second = second};
    return request;
}

void bd_conn_write(struct bd_conn *conn, uint8_t *first, size_t first_bytes, uint8_t *second,
                   size_t second_bytes)
{
    const uv_buf_t bufs[2] = {uv_buf_init((char *)first, (unsigned)first_bytes),
                              uv_buf_init((char *)second, (unsigned)second_bytes)};
    write_bufs(new_request(conn, first, second), bufs);
}

void bd_conn_write_static(struct bd_conn *conn, uint8_t *first, size_t first_bytes,
                          const uint8_t *second, size_t second_bytes)
{
    // libuv writes from it, and takes no const.
    const uv_buf_t bufs[2] = {uv_buf_init((char *)first, (unsigned)first_bytes),
                              uv_buf_init((char *)(uintptr_t)second, (unsigned)second_bytes)};
    write_bufs(new_request(conn, first, NULL), bufs);
}

size_t bd_conn_room_bytes(const struct bd_conn *conn, size_t most)
{
    const uint64_t stranger = conn->loop->serving->limits.hello_bytes;
    return conn->is_known || most < stranger ? most : (size_t)stranger;
}

size_t bd_conn_unsent_bytes(const struct bd_conn *conn)
{
    return uv_stream_get_write_queue_size(&conn->uv.stream);
}

void bd_conn_finish(struct bd_conn *conn)
{
    if (conn->state != BD_CONN_OPEN) return;
    conn->state = BD_CONN_FINISHING;
    conn->finishing_ns = bd_clock_ns();
    conn->ops->gone(conn);
    bd_conn_read(conn, true);
    shut_if_written(conn);
}

// Each second costs one, and bytes earn some, up to idle_seconds: a burst long ago is no excuse.
static void spend(struct bd_conn *conn, double *patience_s, bool moves, double seconds,
                  uint64_t bytes)
{
    const struct bd_limits *limits = &conn->loop->serving->limits;
    const double most_s = (double)limits->idle_seconds;
    uint64_t rate = limits->slow_bytes_per_second;
    if (!moves || rate == 0) {
        *patience_s = most_s;
        return;
    }
    *patience_s += (double)bytes / (double)rate - seconds;
    if (*patience_s > most_s) *patience_s = most_s;
}

// What is on its way, and how fast. Time in which we hold the peer back is not its own.
static void look_at_pace(struct bd_conn *conn, uint64_t now_ns, size_t unsent)
{
    double seconds = (double)(now_ns - conn->looked_ns) * 1e-9;
    uint64_t taken = conn->out_bytes - unsent;
    bool owes = conn->ops->owes && conn->ops->owes(conn);
    spend(conn, &conn->in_patience_s, owes, conn->reading ? seconds : 0,
          conn->in_bytes - conn->looked_in_bytes);
    spend(conn, &conn->out_patience_s, unsent > 0, seconds, taken - conn->looked_out_bytes);
    conn->looked_ns = now_ns;
    conn->looked_in_bytes = conn->in_bytes;
    conn->looked_out_bytes = taken;
}

static uint64_t proxy_patience_ns(const struct bd_conn *conn)
{
    return conn->loop->serving->limits.header_seconds * 1000000000u;
}

void bd_conn_tick(struct bd_conn *conn)
{
    if (conn->is_broken) {
        bd_conn_kill(conn);
        return;
    }
    uint64_t now_ns = bd_clock_ns();
    size_t unsent = bd_conn_unsent_bytes(conn);
    if (unsent != conn->unsent_bytes) {
        conn->unsent_bytes = unsent;
        // Who reads a pong a minute has not said hello yet.
        if (conn->is_known || !conn->session) conn->active_ns = now_ns;
        conn->finishing_ns = now_ns;
    }
    look_at_pace(conn, now_ns, unsent);
    if (conn->out_patience_s <= 0) {
        bd_conn_kill(conn);
        return;
    }
    if (conn->state == BD_CONN_FINISHING) {
        uint64_t patience_ns = conn->is_shut ? LINGER_NS : FINISH_PATIENCE_NS;
        if (now_ns - conn->finishing_ns > patience_ns) bd_conn_kill(conn);
        return;
    }
    if (conn->proxy && now_ns - conn->begun_ns > proxy_patience_ns(conn)) {
        bd_log(BD_LOG_WARN, "net", "%s: its PROXY header took too long (limit header_seconds)",
               conn->client->key);
        bd_conn_kill(conn);
        return;
    }
    if (conn->ops->tick) conn->ops->tick(conn);
    if (conn->state != BD_CONN_OPEN) return;
    if (conn->in_patience_s <= 0) {
        conn->is_slow = true;
        conn->ops->silent(conn);
        return;
    }
    uint64_t patience_s = conn->ops->patience_s(conn);
    // Not now_ns: a ping that the tick has just sent is younger.
    if (patience_s == 0 || bd_clock_ns() - conn->active_ns < patience_s * 1000000000u) return;
    // A peer that does not take what we send would not take a farewell either.
    if (unsent > 0)
        bd_conn_kill(conn);
    else
        conn->ops->silent(conn);
}

bool bd_conn_peer(const struct bd_conn *conn, struct bd_peer *out)
{
    uv_os_fd_t fd;
    return conn->uv.handle.type == UV_NAMED_PIPE && uv_fileno(&conn->uv.handle, &fd) == 0 &&
           bd_peer_read(fd, out);
}

static void name_pipe_peer(const struct bd_conn *conn, char *out, size_t size)
{
    struct bd_peer peer;
    if (!bd_conn_peer(conn, &peer)) {
        snprintf(out, size, "unix");
        return;
    }
    snprintf(out, size, "uid:%u", peer.uid);
    bd_peer_finish(&peer);
}

static void name_tcp_peer(const struct bd_conn *conn, char *out, size_t size, bool *is_proxied)
{
    const struct bd_serving *serving = conn->loop->serving;
    struct sockaddr_storage address = {0};
    int address_size = sizeof address;
    if (uv_tcp_getpeername(&conn->uv.tcp, (struct sockaddr *)&address, &address_size) == 0) {
        bd_sockaddr_stranger(&address, out, size);
        *is_proxied |= bd_proxy_has_address(serving->proxies, serving->proxy_count, &address);
    } else {
        snprintf(out, size, "?");
    }
}

// What a proxy itself has open is a count of its own, without a limit but that of all.
static void name_peer(struct bd_conn *conn, bool is_proxied)
{
    char key[64], proxy[80];
    if (conn->uv.handle.type == UV_TCP)
        name_tcp_peer(conn, key, sizeof key, &is_proxied);
    else
        name_pipe_peer(conn, key, sizeof key);
    snprintf(proxy, sizeof proxy, "proxy:%s", key);
    conn->origin = bd_client_get(conn->loop->clients, is_proxied ? proxy : key);
    conn->client = conn->origin;
    bd_client_retain(conn->client);
    if (!is_proxied) return;
    conn->proxy = calloc(1, sizeof *conn->proxy);
    BD_ASSERT(conn->proxy);
}

static void begin(struct bd_conn *conn)
{
    struct bd_loop *loop = conn->loop;
    if (conn->uv.handle.type == UV_TCP) {
        uv_tcp_nodelay(&conn->uv.tcp, 1);
        uv_tcp_keepalive(&conn->uv.tcp, 1, KEEPALIVE_S); // notices a peer that vanished in silence
    }
    conn->begun_ns = conn->looked_ns = bd_clock_ns();
    conn->in_patience_s = conn->out_patience_s = (double)loop->serving->limits.idle_seconds;
    conn->client->connections++;
    conn->state = BD_CONN_OPEN;
    conn->next = loop->conns;
    if (conn->next) conn->next->previous = conn;
    loop->conns = conn;
    loop->conn_count++;
    bd_heartbeat_set(&loop->heart, true);
    bd_conn_read(conn, true);
}

static void init_handle(struct bd_loop *loop, struct bd_conn *conn, bool is_pipe)
{
    conn->loop = loop;
    if (is_pipe)
        uv_pipe_init(&loop->uv, &conn->uv.pipe, 0);
    else
        uv_tcp_init(&loop->uv, &conn->uv.tcp);
    conn->uv.handle.data = conn;
}

static bool give_up(struct bd_conn *conn)
{
    conn->state = BD_CONN_CLOSED;
    uv_close(&conn->uv.handle, on_closed);
    return false;
}

// The limit that one more connection would pass; NULL: none.
static const char *passed_limit(const struct bd_conn *conn)
{
    if (conn->loop->conn_count >= conn->loop->serving->limits.connections)
        return "limit connections";
    return conn->proxy ? NULL : limit_of_client(conn, conn->client);
}

bool bd_conn_accept(struct bd_loop *loop, struct bd_conn *conn, uv_stream_t *listener, bool is_pipe,
                    bool is_proxied)
{
    init_handle(loop, conn, is_pipe);
    if (uv_accept(listener, &conn->uv.stream) < 0) return give_up(conn);
    name_peer(conn, is_proxied);
    // Accepted and closed at once: the peer learns it now instead of waiting in the backlog.
    const char *limit = passed_limit(conn);
    if (limit || loop->draining) {
        bd_log(BD_LOG_DEBUG, "net", "%s: a connection was closed at once (%s)", conn->client->key,
               limit ? limit : "draining");
        loop->counts.requests_refused++;
        return give_up(conn);
    }
    begin(conn);
    return true;
}

bool bd_conn_open_fd(struct bd_loop *loop, struct bd_conn *conn, int fd)
{
    init_handle(loop, conn, true);
    if (uv_pipe_open(&conn->uv.pipe, fd) < 0) return give_up(conn);
    name_peer(conn, false);
    begin(conn);
    return true;
}
