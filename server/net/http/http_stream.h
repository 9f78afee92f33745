// Answers that do not end: a view as motion JPEG, changes to scenes as server-sent events. The
// connection stays with the answer until either side closes it.
//
// Thread: the event loop's.

#ifndef BD_NET_HTTP_HTTP_STREAM_H
#define BD_NET_HTTP_HTTP_STREAM_H

#include "net/http/http_internal.h"

// GET /v1/scenes/ID/stream.mjpeg: multipart/x-mixed-replace, one part a frame, the next one begun
// when everything sent has left.
void bd_http_begin_mjpeg(struct bd_http *http);

// GET /v1/scenes/ID/events, /v1/events: each change as JSON (SceneEvent).
void bd_http_begin_events(struct bd_http *http);

// Before the connection's memory goes. Takes NULL, nulls.
void bd_http_stream_destroy(struct bd_http_stream **stream);

#endif
