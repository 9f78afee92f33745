// The way of a frame's job back from the render thread to the loop.
//
// A bd_job_request's `user` is a bd_frame_job and its `done` bd_frame_job_done; `ended` then runs on
// the loop. Commands and views have one each.

#ifndef BD_NET_LIVE_FRAME_JOB_H
#define BD_NET_LIVE_FRAME_JOB_H

#include "net/loop/client.h"
#include "sched/sched.h"

struct bd_live;

// Who comes first. Among equals those whose turn it is (bd_job_request.turn).
enum {
    BD_PRIORITY_REFINE = 5,   // a better picture of what a view shows already
    BD_PRIORITY_REQUEST = 10, // somebody asked for one frame
    BD_PRIORITY_VIEW = 20,    // a view shows what is no longer so
};

struct bd_frame_job {
    struct bd_live *live;
    void *user;
    void (*ended)(struct bd_frame_job *job); // on the loop
    struct bd_frame_job *next;               // live->ended
};

// On the render thread: only enqueues.
void bd_frame_job_done(void *user, struct bd_job *job);

// On the loop, when live->frames_ended was rung.
void bd_frame_jobs_collect(struct bd_live *live);

// Requests of one client take turns with those of others.
static inline uint64_t bd_client_turn(const struct bd_client *client)
{
    return (uint64_t)(uintptr_t)client;
}

#endif
