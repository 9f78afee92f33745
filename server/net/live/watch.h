// Watches: who wants to hear of changes to scenes. A session's events (session_watch.c) and event
// streams (http_stream.c) hang on them.
//
// Thread: the event loop's.

#ifndef BD_NET_LIVE_WATCH_H
#define BD_NET_LIVE_WATCH_H

#include "net/live/live.h"
#include "protocol/bounced.pb-c.h"

struct bd_watch {
    struct bd_live *live;
    char scene_id[BD_SCENE_ID_BYTES]; // "" = all scenes
    const struct bd_grant *grant;     // what who watches may know of
    // `event` is borrowed.
    void (*event)(void *user, const Bounced__SceneEvent *event);
    void *user;
    struct bd_watch *previous, *next; // live->watches
};

// Checks `scene` (NULL or "": all) and joins the list; the struct is the caller's, its first three
// and last two members unset. BD_ERR_NOT_FOUND.
BD_MUST_CHECK
enum bd_err bd_watch_begin(struct bd_watch *watch, struct bd_live *live, const char *scene,
                           struct bd_err_detail *detail);
void bd_watch_end(struct bd_watch *watch);

#endif
