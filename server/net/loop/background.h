// Work at low priority, each on a thread of its own: imports and exports, and what edits bring as
// blobs, which take a core for seconds. Never on libuv's pool, whose four threads encode frames and
// write the journal.
//
// imports_at_once of each lane run, the others wait in order.
//
// Thread: the event loop's, but for `run`.

#ifndef BD_NET_LOOP_BACKGROUND_H
#define BD_NET_LOOP_BACKGROUND_H

#include <stdbool.h>
#include <stdint.h>
#include <uv.h>

struct bd_background_thread;
struct bd_loop;

// An edit's picture does not wait for a stranger's import, which may take minutes.
enum bd_background_lane {
    BD_BACKGROUND_FILES,   // imports, exports
    BD_BACKGROUND_CONTENT, // of edits: pictures, maps, streams
    BD_BACKGROUND_LANES
};

// Part of whoever wants the work done, zeroed at first. It must outlive `back`.
struct bd_background {
    void *user;
    enum bd_background_lane lane;
    void (*begun)(struct bd_background *work); // its turn has come; may be NULL
    void (*run)(struct bd_background *work);   // on the thread
    void (*back)(struct bd_background *work);  // `work` may be gone after it
    bool has_failed; // for `back`: the system had no thread for it, and `run` was not called

    // Ours.
    struct bd_loop *loop;
    struct bd_background *next; // of those that wait
    bool is_waiting;
};

// Of the loop.
struct bd_background_state {
    struct {
        struct bd_background *waiting; // oldest first
        uint32_t count;                // of those that have begun and did not come back
    } lanes[BD_BACKGROUND_LANES];
    int done_fd; // an eventfd: something lies in `done`
    uv_poll_t done_poll;
    struct bd_background_thread *done;   // atomic: pushed by the threads, taken whole by the loop
    struct bd_background_thread *ending; // have nothing left to do but end
};

void bd_background_begin(struct bd_loop *loop);  // with the loop
void bd_background_close(struct bd_loop *loop);  // before the loop's last turn
void bd_background_finish(struct bd_loop *loop); // after it

void bd_background_start(struct bd_loop *loop, struct bd_background *work);

// Takes work back whose turn has not come: nothing of it is called. False: it has begun.
bool bd_background_drop(struct bd_background *work);

#endif
