// A view: a picture of a scene that stays current. Whoever opened it gets a frame for each change,
// and of a still one better and better frames. What is sent, and how, is the opener's: a session's
// events (session_view.c), the parts of an MJPEG stream (http_stream.c).
//
// Thread: the event loop's.

#ifndef BD_NET_LIVE_VIEW_H
#define BD_NET_LIVE_VIEW_H

#include "net/live/live.h"
#include "net/wire/answer.h"
#include "net/wire/frame_options.h"

struct bd_view;

// What a view shows with one frame. Borrowed, but for `bytes`, which the callee may take.
struct bd_view_frame {
    uint64_t number;   // from 1
    uint64_t replaced; // changes and frames that newer ones replaced since the last
    bool is_final;
    char why_final[112]; // in words; empty where it is not
    uint32_t step;
    double age_ms; // from the change that it shows
    uint32_t credits;
    uint64_t sequence, revision, transient;
    const struct bd_report *report;
    double encode_ms;
    float exposure_stops;
    enum bd_encode_format format;
    struct bd_bytes bytes;
};

struct bd_view_events {
    void (*frame)(void *user, struct bd_view_frame *frame);
    // The view is no more; close it.
    void (*end)(void *user, const struct bd_err_detail *detail);
    // Whether the connection takes more bytes; bd_view_wake when it does again.
    bool (*has_room)(void *user);
};

struct bd_view_start {
    struct bd_live *live;
    struct bd_client *client; // the view takes its own reference
    const char *scene;
    const Bounced__FrameRequest *frame; // NULL: every default
    uint32_t credits;
    double frames_per_second; // 0 = no limit
    bool refine;
    const struct bd_view_events *events;
    void *user;
};

// BD_ERR_BUSY naming views_per_client; whatever else is wrong with the request, by field.
BD_MUST_CHECK
enum bd_err bd_view_open(const struct bd_view_start *start, struct bd_view **out,
                         struct bd_err_detail *detail);
// No further events. Nulls; takes NULL.
void bd_view_close(struct bd_view **view);

// Wholly or not at all.
BD_MUST_CHECK
enum bd_err bd_view_update(struct bd_view *view, const Bounced__ViewUpdate *update,
                           struct bd_err_detail *detail);

// So many frames have been shown. Never more than were given at first.
void bd_view_credit(struct bd_view *view, uint32_t count);
// All of them again, and the next frame is a first one: for a client that came back.
void bd_view_restart(struct bd_view *view);
// Room again.
void bd_view_wake(struct bd_view *view);

// A scene changed, or (`is_removed`) is no more.
void bd_views_scene_changed(struct bd_live *live, const char *scene_id, bool is_removed);

// The timer of all views.
void bd_views_begin(struct bd_live *live);
void bd_views_finish(struct bd_live *live);

#endif
