#include "net/http/http_stream.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/clock.h"
#include "net/live/view.h"
#include "net/live/watch.h"
#include "protocol/json.h"

// A reader that is so far behind is told that it missed something, once it has caught up.
#define EVENTS_UNSENT_BYTES_MAX (256u << 10)
#define EVENTS_SEND_BYTES       (128 << 10)
#define PICTURES_SEND_BYTES     (256 << 10)
// Browsers show a part when they see the boundary behind it: each is followed by one at once.
#define BOUNDARY "\r\n--bounced\r\n"

struct bd_http_stream {
    struct bd_http *http;
    struct bd_view *view; // of a motion JPEG
    struct bd_watch watch;
    bool is_watching, has_missed;
    uint64_t said_ns; // when the last event or comment was sent
};

static void say(struct bd_http *http, const char *text)
{
    bd_conn_write(&http->conn, (uint8_t *)bd_answer_text(text), strlen(text), NULL, 0);
}

static void say_head(struct bd_http *http, const char *type)
{
    char head[256];
    snprintf(head, sizeof head,
             "HTTP/1.1 200 OK\r\nContent-Type: %s\r\nConnection: close\r\n"
             "Cache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\n\r\n",
             type);
    say(http, head);
}

// --- motion JPEG ----------------------------------------------------------------------------

static void on_frame(void *user, struct bd_view_frame *frame)
{
    struct bd_http *http = ((struct bd_http_stream *)user)->http;
    char head[256];
    snprintf(head, sizeof head,
             "Content-Type: image/jpeg\r\nContent-Length: %zu\r\nBounced-Frame: %llu\r\n"
             "Bounced-Revision: %llu\r\nBounced-Final: %d\r\n\r\n",
             frame->bytes.size_bytes, (unsigned long long)frame->number,
             (unsigned long long)frame->revision, frame->is_final);
    size_t size = frame->bytes.size_bytes, whole = size + sizeof BOUNDARY - 1;
    uint8_t *bytes = realloc(frame->bytes.data, whole);
    BD_ASSERT(bytes);
    memcpy(bytes + size, BOUNDARY, sizeof BOUNDARY - 1);
    frame->bytes = (struct bd_bytes){0};
    bd_conn_write(&http->conn, (uint8_t *)bd_answer_text(head), strlen(head), bytes, whole);
}

// What it was cannot be said in a stream of pictures: it ends.
static void on_end(void *user, const struct bd_err_detail *detail)
{
    struct bd_http *http = ((struct bd_http_stream *)user)->http;
    (void)detail;
    bd_conn_finish(&http->conn);
}

static bool has_room(void *user)
{
    const struct bd_conn *conn = &((struct bd_http_stream *)user)->http->conn;
    return conn->state == BD_CONN_OPEN && bd_conn_unsent_bytes(conn) == 0;
}

static const struct bd_view_events view_events = {on_frame, on_end, has_room};

// --- events ---------------------------------------------------------------------------------

static void send_event(struct bd_http_stream *stream, const Bounced__SceneEvent *event)
{
    char *json = bd_json_text_from_message(&event->base);
    BD_ASSERT(json);
    size_t size = strlen(json) + sizeof "data: \n\n";
    char *text = malloc(size);
    BD_ASSERT(text);
    snprintf(text, size, "data: %s\n\n", json);
    free(json);
    stream->said_ns = bd_clock_ns();
    bd_conn_write(&stream->http->conn, (uint8_t *)text, strlen(text), NULL, 0);
}

static bool is_behind(const struct bd_http_stream *stream)
{
    return bd_conn_unsent_bytes(&stream->http->conn) > EVENTS_UNSENT_BYTES_MAX;
}

static void on_event(void *user, const Bounced__SceneEvent *event)
{
    struct bd_http_stream *stream = user;
    stream->has_missed = stream->has_missed || is_behind(stream);
    if (!stream->has_missed) send_event(stream, event);
}

static void say_missed(struct bd_http_stream *stream)
{
    static char missed[] = "missed";
    Bounced__SceneEvent event = BOUNCED__SCENE_EVENT__INIT;
    event.scene = stream->watch.scene_id[0] ? stream->watch.scene_id : NULL;
    event.kind = missed;
    stream->has_missed = false;
    send_event(stream, &event);
}

// --- the connection -------------------------------------------------------------------------

static struct bd_http_stream *of(const struct bd_conn *conn)
{
    return ((const struct bd_http *)conn)->stream;
}

// Nothing is said to a stream. It is read all the same, or a peer that leaves would not be noticed.
static void on_bytes(struct bd_conn *conn, const uint8_t *bytes, size_t size)
{
    (void)conn;
    (void)bytes;
    (void)size;
}

static uint64_t patience_s(const struct bd_conn *conn)
{
    return bd_conn_unsent_bytes(conn) > 0 ? conn->loop->serving->limits.idle_seconds : 0;
}

static void on_written(struct bd_conn *conn)
{
    struct bd_http_stream *stream = of(conn);
    if (stream->has_missed && !is_behind(stream)) say_missed(stream);
    if (stream->view && bd_conn_unsent_bytes(conn) == 0) bd_view_credit(stream->view, 1);
}

static void on_tick(struct bd_conn *conn)
{
    struct bd_http_stream *stream = of(conn);
    uint64_t now_ns = bd_clock_ns();
    uint64_t quiet_ns = conn->loop->serving->limits.keep_alive_seconds * 1000000000u;
    if (!stream->is_watching || now_ns - stream->said_ns < quiet_ns) return;
    if (bd_conn_unsent_bytes(conn) > 0) return;
    stream->said_ns = now_ns;
    say(stream->http, ": still here\n\n");
}

static void leave(struct bd_http_stream *stream)
{
    bd_view_close(&stream->view);
    if (stream->is_watching) bd_watch_end(&stream->watch);
    stream->is_watching = false;
}

static void on_gone(struct bd_conn *conn)
{
    leave(of(conn));
}

static const struct bd_conn_ops stream_ops = {
    .bytes = on_bytes,
    .patience_s = patience_s,
    .silent = bd_conn_kill,
    .drain = bd_conn_finish,
    .tick = on_tick,
    .written = on_written,
    .gone = on_gone,
    .free = bd_http_free,
};

void bd_http_stream_destroy(struct bd_http_stream **stream)
{
    free(*stream);
    *stream = NULL;
}

// --- begin ----------------------------------------------------------------------------------

static struct bd_http_stream *create(struct bd_http *http)
{
    struct bd_http_stream *stream = calloc(1, sizeof *stream);
    BD_ASSERT(stream);
    *stream = (struct bd_http_stream){.http = http, .said_ns = bd_clock_ns()};
    return stream;
}

static void refuse(struct bd_http *http, struct bd_http_stream *stream,
                   const struct bd_err_detail *detail)
{
    struct bd_http_refusal refusal = {.detail = *detail};
    bd_http_stream_destroy(&stream);
    bd_http_send_error(http, &refusal);
}

static void take_over(struct bd_http *http, struct bd_http_stream *stream, const char *type)
{
    http->stream = stream;
    http->conn.ops = &stream_ops;
    say_head(http, type);
}

static enum bd_err open_view(struct bd_http *http, struct bd_http_stream *stream,
                             struct bd_err_detail *detail)
{
    struct bd_view_start start = {.live = http->web->sessions->commands->live,
                                  .client = http->conn.client,
                                  .scene = http->target.id,
                                  .credits = 1,
                                  .refine = true,
                                  .events = &view_events,
                                  .user = stream};
    const struct bd_store_entry *entry;
    Bounced__Render *render;
    enum bd_err err =
        bd_http_query_read_stream(http->target.query, &render, &start.frames_per_second, detail);
    if (err) return err;
    start.frame = render->frame;
    if (render->environment)
        err = bd_err_set(detail, BD_ERR_USAGE, "environment",
                         "an environment comes with a file; a held scene has its own");
    if (!err) err = bd_store_get(http->conn.loop->serving->store, http->target.id, &entry, detail);
    if (!err && !bd_grant_covers(http->grant, entry->name))
        err = bd_err_set(detail, BD_ERR_NOT_FOUND, "scene", "there is no scene \"%.64s\"",
                         http->target.id);
    if (!err) err = bd_view_open(&start, &stream->view, detail);
    bounced__render__free_unpacked(render, NULL);
    return err;
}

void bd_http_begin_mjpeg(struct bd_http *http)
{
    struct bd_http_stream *stream = create(http);
    struct bd_err_detail detail;
    if (open_view(http, stream, &detail)) {
        refuse(http, stream, &detail);
        return;
    }
    // The next picture is begun when this one has left: what lies in the system's buffer is old.
    int send_bytes = PICTURES_SEND_BYTES;
    uv_send_buffer_size(&http->conn.uv.handle, &send_bytes);
    take_over(http, stream, "multipart/x-mixed-replace; boundary=bounced");
    say(http, &BOUNDARY[2]);
}

void bd_http_begin_events(struct bd_http *http)
{
    struct bd_http_stream *stream = create(http);
    struct bd_err_detail detail;
    stream->watch = (struct bd_watch){.grant = http->grant, .event = on_event, .user = stream};
    if (bd_watch_begin(&stream->watch, http->web->sessions->commands->live, http->target.id,
                       &detail)) {
        refuse(http, stream, &detail);
        return;
    }
    stream->is_watching = true;
    // The system's own buffer would grow to megabytes under a reader that has stopped.
    int send_bytes = EVENTS_SEND_BYTES;
    uv_send_buffer_size(&http->conn.uv.handle, &send_bytes);
    take_over(http, stream, "text/event-stream");
}
