// What the files of the HTTP transport share: one connection's state.

#ifndef BD_NET_HTTP_HTTP_INTERNAL_H
#define BD_NET_HTTP_HTTP_INTERNAL_H

#include <llhttp.h>

#include "net/command/command.h"
#include "net/http/http.h"
#include "net/http/http_head.h"
#include "net/http/http_route.h"
#include "net/loop/conn.h"
#include "net/loop/spool.h"

enum bd_http_phase {
    BD_HTTP_PHASE_HEAD, // until the empty line
    BD_HTTP_PHASE_BODY,
    BD_HTTP_PHASE_BUSY, // until the answer is handed to the connection
};

struct bd_http_stream;
struct bd_websocket;

struct bd_http {
    struct bd_conn conn;
    const struct bd_web *web;
    llhttp_t parser;
    struct bd_http_lines lines;
    size_t fed; // bytes of the request that is coming
    enum bd_http_phase phase;
    struct bd_http_head head;
    struct bd_http_target target;
    int method; // enum bd_http_method, or -1
    bool keep_alive;
    const struct bd_grant *grant; // what who asks may do
    bool has_refusal;             // decided on the head: no body is read
    struct bd_http_refusal refusal;
    bool is_complete;   // the parser saw the end of the message
    const char *breach; // what is wrong with the bytes themselves, or NULL
    bool is_pumping;
    char local_host[64];

    uint8_t *body; // a short one
    size_t body_bytes;
    struct bd_spool *spool; // a long one: a blob, or the scene of a one-shot render
    struct bd_command *command;
    bool is_scene_add;
    char set_cookie[160];           // of the next answer; "" = none
    struct bd_websocket *websocket; // once the connection is one
    struct bd_http_stream *stream;  // once its answer does not end

    uint8_t *stash; // what came behind the request that is under way
    size_t stash_bytes;
};

// --- http_request.c: a request from its head to what it starts ---

// The whole head is there: may who asks have what it asks for? Otherwise `refusal` says why not.
BD_MUST_CHECK
enum bd_err bd_http_check_head(struct bd_http *http);
// Does it bring content, which goes to the disk?
bool bd_http_has_long_body(const struct bd_http *http);

// Called with the whole head: sets has_refusal, or how the body is to be received.
void bd_http_begin_body(struct bd_http *http);
// One piece of the body.
void bd_http_take_body(struct bd_http *http, const uint8_t *bytes, size_t size);

// The whole request is there: starts what it asks for. One answer follows, now or later.
void bd_http_run(struct bd_http *http);
// The same of a one-shot render once its body is on the disk.
void bd_http_render_body(struct bd_http *http);

// Browser sessions; each answers.
void bd_http_begin_session(struct bd_http *http);
void bd_http_end_session(struct bd_http *http);

// --- http_reply.c: answers ---

void bd_http_send_error(struct bd_http *http, const struct bd_http_refusal *refusal);
void bd_http_send_text(struct bd_http *http, int status, const char *type, const char *text);
// A file of the viewer, or that the peer has it already.
void bd_http_send_file(struct bd_http *http, const struct bd_viewer_file *file);
// Takes what is in `answer`.
void bd_http_send_answer(struct bd_http *http, struct bd_answer *answer);

// --- http.c ---

// An answer was handed over: on to the next request, or to the end of the connection.
void bd_http_next(struct bd_http *http);

// The connection's bd_conn_ops.free, whatever it has become.
void bd_http_free(struct bd_conn *conn);

#endif
