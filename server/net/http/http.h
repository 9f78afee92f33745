// The HTTP transport: one connection, its requests one after the other.
//
// llhttp reads the bytes, once they are found to be lines (http_head.h); what a request may be is
// decided by http_guard.h (who asks) and http_route.h (what for); commands do the work.
//
// Thread: the event loop's.

#ifndef BD_NET_HTTP_HTTP_H
#define BD_NET_HTTP_HTTP_H

#include <uv.h>

#include "net/session/session.h"

// What the transport has from below. Owned by net.c.
struct bd_web {
    struct bd_sessions *sessions;
    const char *const *public_names; // Host names beside our addresses, up to a NULL
};

void bd_http_accept(const struct bd_web *web, uv_stream_t *listener);

#endif
