// The framed face: protocol/framing.h on a Unix or TCP socket, or on an inherited descriptor.
//
// Thread: the event loop's.

#ifndef BD_NET_FRAMED_H
#define BD_NET_FRAMED_H

#include <stdbool.h>
#include <uv.h>

struct bd_conn;
struct bd_grant;
struct bd_net;

// What the user at the other end of a Unix socket may do; NULL: nothing, unless a token says so.
const struct bd_grant *bd_framed_grant_of_user(const struct bd_conn *conn);

void bd_framed_accept(struct bd_net *net, uv_stream_t *listener, bool is_pipe, bool is_proxied);

// The private daemon's one connection: trusted, and never silent for too long. False if the
// descriptor is no stream socket.
bool bd_framed_open_private(struct bd_net *net, int fd);

#endif
