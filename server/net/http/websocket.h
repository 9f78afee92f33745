// The WebSocket transport: a session on a connection of the HTTP port, after its handshake. A
// message is protocol/framing.h's unit without `total`. Frames, fragments, pings and closes are
// libwslay's.
//
// Thread: the event loop's.

#ifndef BD_NET_HTTP_WEBSOCKET_H
#define BD_NET_HTTP_WEBSOCKET_H

#include "net/http/http_internal.h"

// Answers the handshake, whose head has passed bd_ws_check_handshake, and takes the connection
// over: http->conn.ops are its own from now on.
void bd_websocket_begin(struct bd_http *http);

// Before the connection's memory goes. Takes NULL, nulls.
void bd_websocket_destroy(struct bd_websocket **websocket);

#endif
