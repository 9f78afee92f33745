// The WebSocket handshake's arithmetic (RFC 6455, 4.2.2). Framing is libwslay's, in websocket.c.
//
// Thread: any.

#ifndef BD_NET_HTTP_WS_ACCEPT_H
#define BD_NET_HTTP_WS_ACCEPT_H

#include <stdbool.h>

#include "net/http/http_guard.h"
#include "net/http/http_head.h"

#define BD_WS_PROTOCOL     "bounced.v1"
#define BD_WS_ACCEPT_BYTES 29 // 28 characters and the final zero

// Whether a head asks for what we speak: the upgrade, version 13 (426), a key of 16 bytes, the
// subprotocol bounced.v1 (400 each).
BD_MUST_CHECK
enum bd_err bd_ws_check_handshake(const struct bd_http_head *head,
                                  struct bd_http_refusal *refusal);

// The Sec-WebSocket-Accept to a Sec-WebSocket-Key.
void bd_ws_accept(const char *key, char out[BD_WS_ACCEPT_BYTES]);

// True if `word` is one of a header's comma-separated words, in any case. NULL holds none.
bool bd_http_list_has(const char *list, const char *word);

#endif
