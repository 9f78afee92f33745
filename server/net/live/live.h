// What is live: views, and watches of scenes; and the way of frames back from the render thread.
//
// Owned by net.c. Thread: the event loop's, but for what frame_job.h says.

#ifndef BD_NET_LIVE_LIVE_H
#define BD_NET_LIVE_LIVE_H

#include "net/loop/loop.h"

struct bd_delta;
struct bd_steps;
struct bd_view;
struct bd_watch;

struct bd_live {
    struct bd_loop *loop;
    struct bd_view *views; // newest first, those included that wait for their last frame's end
    uint32_t view_count;
    uv_timer_t view_timer;
    struct bd_watch *watches; // newest first
    uv_async_t frames_ended;
    uv_mutex_t ended_lock;
    struct bd_steps *ended; // under the lock: whose frames the render thread is done with
};

void bd_live_begin(struct bd_live *live, struct bd_loop *loop);
void bd_live_close(struct bd_live *live);  // before the loop's last turn
void bd_live_finish(struct bd_live *live); // after it

// A scene's published state changed: tells watches and views. All is borrowed.
struct bd_live_change {
    const char *kind; // added | edited | transient | removed, said before the store forgets it
    const struct bd_delta *delta; // what of it; NULL: not said
    const char *author;           // NULL or "": nobody is known
    const char *batch;            // of a revision: its kind, as the log has it; NULL: none
    uint64_t of;                  // the revision that it is about; 0: none
};
void bd_live_changed(struct bd_live *live, const char *scene_id,
                     const struct bd_live_change *change);

#endif
