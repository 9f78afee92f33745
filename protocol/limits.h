// Every limit that bounced puts on what comes from outside, by name: one table for the code, for
// `--limit NAME=VALUE`, for the hello message and for error messages.
//
// Not here: --gpu-memory, which is an option of its own. Thread: plain data.

#ifndef BD_PROTOCOL_LIMITS_H
#define BD_PROTOCOL_LIMITS_H

#include <stdbool.h>
#include <stdint.h>

#include "base/err.h"

#ifdef __cplusplus
extern "C" {
#endif

#define BD_MIB (1ull << 20)
#define BD_GIB (1ull << 30)

// X(name, default, least, most): what it bounds
#define BD_LIMIT_MAP(X)                                                                            \
    /* A framed message, and an HTTP body other than a blob: 16 MiB holds any edit. */             \
    X(message_bytes, 16 * BD_MIB, 4096, BD_GIB)                                                    \
    /* The protobuf header of a framed message. */                                                 \
    X(header_bytes, BD_MIB, 1024, 64 * BD_MIB)                                                     \
    /* An answer with its image. Clients may rely on the default. */                               \
    X(reply_bytes, BD_GIB, 4096, 4 * BD_GIB - 1)                                                   \
    /* One blob, and the body of POST /v1/render. */                                               \
    X(blob_bytes, 2 * BD_GIB, 4096, 1024 * BD_GIB)                                                 \
    /* A blob that nobody sent, asked for or used for so long is taken away. 0 = never. */         \
    X(blob_seconds, 86400, 0, 1ull << 32)                                                          \
    /* Of the data directory's disk so much is kept free for edits: less, and blobs and scenes */  \
    /* are refused. */                                                                             \
    X(disk_reserve_bytes, 64 * BD_MIB, 0, 1024 * BD_GIB)                                           \
    /* Files in the table of one scene. */                                                         \
    X(scene_files, 4096, 1, 1 << 20)                                                               \
    /* One scene in our flat form. */                                                              \
    X(scene_bytes, 4 * BD_GIB, 4096, 1024 * BD_GIB)                                                \
    /* Triangles of one scene, instanced. */                                                       \
    X(scene_triangles, 200000000, 1, 1ull << 40)                                                   \
    /* Texture pictures: one side; and all texels of a file, whose largest are halved until */     \
    /* they fit, and of the pictures of a batch of edits, which is refused beyond. */              \
    X(picture_side_px, 16384, 1, 65536)                                                            \
    X(picture_texels, 256 * BD_MIB, 1, 64 * BD_GIB)                                                \
    /* The import child: memory, processor time, wall time. */                                     \
    X(import_bytes, 8 * BD_GIB, 16 * BD_MIB, 1024 * BD_GIB)                                        \
    X(import_cpu_seconds, 120, 1, 86400)                                                           \
    X(import_wall_seconds, 180, 1, 86400)                                                          \
    /* Imports and exports that run; the others wait for their turn. */                            \
    X(imports_at_once, 2, 1, 64)                                                                   \
    /* Scenes held at once, and the name of one. */                                                \
    X(scenes, 256, 1, 1 << 20)                                                                     \
    X(scene_name_bytes, 127, 1, 127)                                                               \
    /* A frame: width or height, and their product. */                                             \
    X(image_side_px, 16384, 1, 16384)                                                              \
    X(image_pixels, 64 * BD_MIB, 1, BD_GIB)                                                        \
    /* Complete frames kept as they were sent by HTTP, with their reports; 0 = none. */            \
    X(frame_cache_bytes, 64 * BD_MIB, 0, 64 * BD_GIB)                                              \
    /* Jobs waiting for the GPU, and jobs under way of one client. */                              \
    X(jobs_waiting, 128, 1, 65536)                                                                 \
    X(jobs_per_client, 64, 1, 65536)                                                               \
    /* A client is a token, a user on a Unix socket, or, of strangers, an address (of IPv6 its */  \
    /* first 64 bits). Twice this is the burst. */                                                 \
    X(requests_per_second, 500, 1, 1000000)                                                        \
    /* Tokens that are none of ours, from one address. Half of it is the burst. */                 \
    X(failed_logins_per_minute, 20, 2, 1000000)                                                    \
    /* Under way on one framed connection or WebSocket: requests, uploads, watches. */             \
    X(requests_per_connection, 256, 1, 65536)                                                      \
    X(uploads_per_connection, 16, 1, 4096)                                                         \
    X(watches_per_connection, 64, 1, 65536)                                                        \
    /* Views open on one connection, and of one client. */                                         \
    X(views_per_connection, 16, 1, 4096)                                                           \
    X(views_per_client, 64, 1, 65536)                                                              \
    /* What one client's edits under way have brought in their messages. */                        \
    X(edit_bytes_per_client, 256 * BD_MIB, 4096, 64 * BD_GIB)                                      \
    /* Frames of one view that may be under way to its client. */                                  \
    X(view_credits, 16, 1, 1024)                                                                   \
    /* What a view's still picture is improved by takes no longer, a frame, than about this. */    \
    X(view_refine_seconds, 20, 1, 86400)                                                           \
    /* Open connections, all faces together; and of one client, so that no one locks out all. */   \
    X(connections, 256, 1, 65536)                                                                  \
    X(connections_per_client, 128, 1, 65536)                                                       \
    /* The head of an HTTP request. */                                                             \
    X(head_bytes, 32 * 1024, 1024, 65536)                                                          \
    /* What a connection may have in our memory before its hello, or before a request that may ask \
     */                                                                                            \
    /* (of an HTTP head: head_bytes): its message, what it sends ahead, answers that it leaves. */ \
    X(hello_bytes, 4096, 1024, BD_MIB)                                                             \
    /* To send the HTTP headers, or the hello of a framed connection. */                           \
    X(header_seconds, 10, 1, 3600)                                                                 \
    /* Without a byte either way while nothing is being computed for the peer. */                  \
    X(idle_seconds, 120, 1, 86400)                                                                 \
    /* A message, a body or an answer that is on its way moves so fast, after idle_seconds of */   \
    /* grace: a byte a minute is no sign of life. 0 = at any speed. */                             \
    X(slow_bytes_per_second, 256, 0, BD_GIB)                                                       \
    /* A session whose connection broke waits so long for another; how many wait; and what all */  \
    /* that may be resumed keep of their answers. */                                               \
    X(resume_seconds, 30, 0, 3600)                                                                 \
    X(resumable_sessions, 256, 0, 65536)                                                           \
    X(resume_bytes, 64 * BD_MIB, 0, 64 * BD_GIB)                                                   \
    /* Without an event, until an event stream says that it is still there. */                     \
    X(keep_alive_seconds, 15, 1, 3600)                                                             \
    /* Browser sessions (POST /v1/session): how many, and how long each lasts. */                  \
    X(cookies, 256, 1, 65536)                                                                      \
    X(cookie_seconds, 86400, 1, 31536000)                                                          \
    /* From SIGTERM to the last frame. */                                                          \
    X(drain_seconds, 10, 0, 3600)                                                                  \
    /* For tests: the device is lost once, after this many slices. 0 = never. */                   \
    X(debug_lose_device_after_slices, 0, 0, 1000000)

struct bd_limits {
#define X(name, value, least, most) uint64_t name;
    BD_LIMIT_MAP(X)
#undef X
};

extern const struct bd_limits bd_limits_default;

// Sets one limit from "NAME=VALUE" (decimal, with an optional K, M or G for powers of 1024).
// Unknown names and values out of range are BD_ERR_USAGE; `detail` names the range.
BD_MUST_CHECK
enum bd_err bd_limits_set(struct bd_limits *limits, const char *name_equals_value,
                          struct bd_err_detail *detail);

// Reads a whole number with an optional K, M or G, as limits take them. False if `text` is none, or
// does not fit.
bool bd_limits_parse(const char *text, uint64_t *out);

// Walks the table: the name and value of limit `index`, NULL past the end.
const char *bd_limits_get(const struct bd_limits *limits, uint32_t index, uint64_t *value);

#ifdef __cplusplus
}
#endif

#endif
