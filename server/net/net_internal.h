// What the files of net/ share: the loop's state.

#ifndef BD_NET_INTERNAL_H
#define BD_NET_INTERNAL_H

#include <uv.h>

#include "net/auth.h"
#include "net/background.h"
#include "net/client.h"
#include "net/conn.h"
#include "net/disk_watch.h"
#include "net/heartbeat.h"
#include "net/net.h"
#include "net/options.h"

struct bd_command;
struct bd_commit;
struct bd_cookies;
struct bd_delta;
struct bd_edit_place;
struct bd_frame_cache;
struct bd_frame_job;
struct bd_import_cache;
struct bd_import_pool;
struct bd_journal_turn;
struct bd_listener;
struct bd_upkeep;
struct bd_view;
struct bd_watch;

#define BD_NET_PASS_NAME_MAX 48

struct bd_net_stats {
    uint64_t requests, requests_refused;
    uint64_t bytes_in, bytes_out;
    uint64_t frames, frames_remembered;
    // Seconds spent in each pass of every frame, by name, in order of first appearance.
    uint32_t pass_count;
    struct {
        char name[24];
        double seconds;
        uint64_t ran, reused;
    } passes[BD_NET_PASS_NAME_MAX];
};

struct bd_net {
    struct bd_net_options options;
    uv_loop_t loop;
    struct bd_tokens *tokens;
    struct bd_clients *clients;
    struct bd_cookies *cookies;
    struct bd_import_cache *import_cache;
    struct bd_frame_cache *frame_cache;
    struct bd_import_pool *import_pool;
    struct bd_listener *listeners;
    struct bd_conn *conns; // newest first
    uint32_t conn_count;
    uint64_t kept_bytes;         // of answers, for sessions that may be resumed
    struct bd_session *sessions; // those that have ended too, until they are swept
    uint64_t start_ns;
    struct bd_net_stats stats;

    struct bd_command *commands; // under way, newest first
    uint32_t command_count;
    struct bd_view *views; // newest first, those included that wait for their last frame's end
    uint32_t view_count;
    uv_timer_t view_timer;
    struct bd_watch *watches; // newest first
    struct bd_background_state background;
    uv_async_t frames_ended;
    uv_mutex_t ended_lock;
    struct bd_frame_job *ended; // under the lock: frames that the render thread is done with

    struct bd_commit *commit;
    struct bd_journal_turn *journal_turns; // the first one is under way
    struct bd_upkeep *upkeep;              // under way; others wait behind it
    struct bd_edit_place *edit_places;     // oldest first
    uint64_t edit_changes;                 // of that list
    uv_timer_t quiet_timer;

    uv_timer_t tick;
    struct bd_heartbeat heart;
    struct bd_disk_watch disk;
    uv_signal_t sigterm, sigint, sighup;
    struct bd_options reloaded; // that `options` points into since the last SIGHUP
    bool draining, has_committed_rest;
    uint64_t drain_until_ns;
};

// Stops listening; what is under way may end.
void bd_net_begin_drain(struct bd_net *net);

// A connection joined the list, or left it.
void bd_net_conn_joined(struct bd_net *net);
void bd_net_conn_left(struct bd_net *net);

// A scene's published state changed: tells watches and views. All is borrowed.
struct bd_scene_change {
    const char *kind; // added | edited | transient | removed, said before the store forgets it
    const struct bd_delta *delta; // what of it; NULL: not said
    const char *author;           // NULL or "": nobody is known
    const char *batch;            // of a revision: its kind, as the log has it; NULL: none
    uint64_t of;                  // the revision that it is about; 0: none
};
void bd_net_scene_changed(struct bd_net *net, const char *scene_id,
                          const struct bd_scene_change *change);

// Counts a request that was turned away, whatever the reason.
void bd_net_count_refusal(struct bd_net *net);

#endif
