// The HTTP face: one connection, its requests one after the other.
//
// llhttp reads the bytes, once they are found to be lines (http_head.h); what a request may be is
// decided by http_guard.h (who asks) and http_route.h (what for); commands do the work.
//
// Thread: the event loop's.

#ifndef BD_NET_HTTP_H
#define BD_NET_HTTP_H

#include <uv.h>

struct bd_web;

void bd_http_accept(const struct bd_web *web, uv_stream_t *listener);

#endif
