// A stream connection of each transport: reading, writing, patience, closing.
//
// Above it, a transport (framed.c, http.c) makes sense of the bytes. Below it, libuv. What every
// transport needs alike is here: writes that own their bytes, a peer that vanishes, one that sends
// a byte a minute, one that does not read, and a close that lets the last answer arrive.
//
// Thread: the event loop's.

#ifndef BD_NET_LOOP_CONN_H
#define BD_NET_LOOP_CONN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <uv.h>

#include "base/err.h"

struct bd_client;
struct bd_conn;
struct bd_grant;
struct bd_loop;
struct bd_peer;
struct bd_proxy_header;
struct bd_session;

struct bd_conn_ops {
    // Bytes arrived; `bytes` is valid during the call. May finish or kill the connection.
    void (*bytes)(struct bd_conn *conn, const uint8_t *bytes, size_t size);
    // Seconds of silence that are allowed now; 0 = any. Asked once a second.
    uint64_t (*patience_s)(const struct bd_conn *conn);
    // Is the peer in the middle of a message? NULL: never. Asked once a second.
    bool (*owes)(const struct bd_conn *conn);
    // The patience is over: say so if there is a way, then finish. `is_slow`: with its speed.
    void (*silent)(struct bd_conn *conn);
    // The server drains: finish as soon as nothing is owed to the peer.
    void (*drain)(struct bd_conn *conn);
    // Once a second; NULL if there is nothing to do.
    void (*tick)(struct bd_conn *conn);
    // Something that was sent has left: there is room for more.
    void (*written)(struct bd_conn *conn);
    // The peer is gone, or we gave up. Abandon what was under way. No calls after this but free.
    void (*gone)(struct bd_conn *conn);
    void (*free)(struct bd_conn *conn);
};

enum bd_conn_state {
    BD_CONN_OPEN,
    BD_CONN_FINISHING, // writing what is left; what arrives is thrown away
    BD_CONN_CLOSED,
};

// A socket of either kind, connected or listening.
union bd_socket {
    uv_handle_t handle;
    uv_stream_t stream;
    uv_tcp_t tcp;
    uv_pipe_t pipe;
};

// The first member of each transport's own struct.
struct bd_conn {
    struct bd_loop *loop;
    const struct bd_conn_ops *ops;
    union bd_socket uv;
    struct bd_client *client;      // whose requests these are now, and whom it counts for
    struct bd_client *origin;      // as a stranger, by its address or user
    const struct bd_grant *grant;  // of the token that was shown last; NULL: none
    struct bd_proxy_header *proxy; // that still has to come, from a proxy that is named
    struct bd_conn *previous, *next;
    enum bd_conn_state state;
    struct bd_session *session; // of those transports that speak in envelopes
    // Said hello, or asked for something that it may have: until then it is a stranger, of which
    // next to nothing is kept (limit hello_bytes).
    bool is_known;
    bool reading;
    bool clock_runs; // what comes and goes is no sign of life: a phase with a deadline
    bool is_shut;    // our side was shut down
    bool is_broken;  // libuv refused: the next tick ends it, so that no caller's ground gives way
    uint64_t begun_ns, active_ns, finishing_ns;
    uint64_t heard_ns;   // when the last byte came
    size_t unsent_bytes; // at the last look: progress is a change
    uint64_t looked_ns, looked_in_bytes, looked_out_bytes;
    uint64_t in_bytes, out_bytes; // all that came, and all that was given to it to send
    // Left with a peer that is in the middle of a message, and with one that has more to read.
    double in_patience_s, out_patience_s;
    bool is_slow;
    uint32_t writes; // under way
};

// Accepts from `listener` into `conn`, which its transport has allocated, zeroed, and given `ops`.
// Frees it (ops->free) and returns false if it cannot be, or if there are too many connections.
// `is_proxied`: whoever comes there is a proxy; at other places it may be by its address. Its
// header comes first, and the transport sees what is behind it.
bool bd_conn_accept(struct bd_loop *loop, struct bd_conn *conn, uv_stream_t *listener, bool is_pipe,
                    bool is_proxied);
// The same for a descriptor that is open already.
bool bd_conn_open_fd(struct bd_loop *loop, struct bd_conn *conn, int fd);

// Who is at the other end of a Unix socket; false elsewhere. Free with bd_peer_finish.
bool bd_conn_peer(const struct bd_conn *conn, struct bd_peer *out);

// What comes now is asked by whoever has this grant: a token, by its name, is one client wherever
// it is shown; without one (NULL) it is the address or user that connected. BD_ERR_BUSY, naming
// connections_per_client, if that token has too many; the connection is then whose it was.
BD_MUST_CHECK
enum bd_err bd_conn_identify(struct bd_conn *conn, const struct bd_grant *grant, const char *token,
                             struct bd_err_detail *detail);

// Starts or stops reading. A stopped connection does not notice that its peer left.
void bd_conn_read(struct bd_conn *conn, bool wanted);

// Sends `first` and then `second` (NULL: nothing), both malloc'ed and owned from now on.
void bd_conn_write(struct bd_conn *conn, uint8_t *first, size_t first_bytes, uint8_t *second,
                   size_t second_bytes);
// The same, but `second` lives as long as the program.
void bd_conn_write_static(struct bd_conn *conn, uint8_t *first, size_t first_bytes,
                          const uint8_t *second, size_t second_bytes);

// What may be kept for this connection of one kind of bytes: `most`, for a stranger hello_bytes.
size_t bd_conn_room_bytes(const struct bd_conn *conn, size_t most);
// Whether more answers may be made for it: fewer than `most` bytes of that room wait for the peer
// to read, and not too many pieces, each of which has a few hundred bytes of ours around it.
bool bd_conn_takes_more(const struct bd_conn *conn, size_t most);

// Bytes that wait for the peer to read.
size_t bd_conn_unsent_bytes(const struct bd_conn *conn);

// Sends what is left, shuts down, lets the peer read it while throwing away what it still sends,
// then closes. Closing at once would reset the connection under the answer.
void bd_conn_finish(struct bd_conn *conn);

// Closes at once.
void bd_conn_kill(struct bd_conn *conn);

// A sign of life: the patience begins anew.
void bd_conn_touch(struct bd_conn *conn);

// Once a second, for each connection.
void bd_conn_tick(struct bd_conn *conn);

#endif
