// The framed transport: protocol/framing.h on a Unix or TCP socket, or on an inherited descriptor.
//
// Thread: the event loop's.

#ifndef BD_NET_SESSION_FRAMED_H
#define BD_NET_SESSION_FRAMED_H

#include <stdbool.h>
#include <uv.h>

struct bd_conn;
struct bd_grant;
struct bd_sessions;

void bd_framed_accept(struct bd_sessions *sessions, uv_stream_t *listener, bool is_pipe,
                      bool is_proxied);

// The private daemon's one connection: trusted, and never silent for too long. False if the
// descriptor is no stream socket.
bool bd_framed_open_private(struct bd_sessions *sessions, int fd);

#endif
