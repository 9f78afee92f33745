// Frames as steps: the way of a job from the loop to the render thread and back.
//
// A step on bd_on_render submits a job: steps.job, whose `done` is bd_frame_job_done and whose
// `user` the steps. The step is over with the frame, and fails as it did.

#ifndef BD_NET_LIVE_FRAME_JOB_H
#define BD_NET_LIVE_FRAME_JOB_H

#include "net/loop/client.h"
#include "net/loop/steps.h"
#include "sched/sched.h"

struct bd_live;

// Who comes first. Among equals those whose turn it is (bd_job_request.turn).
enum {
    BD_PRIORITY_REFINE = 5,   // a better picture of what a view shows already
    BD_PRIORITY_REQUEST = 10, // somebody asked for one frame
    BD_PRIORITY_VIEW = 20,    // a view shows what is no longer so
};

extern const struct bd_step_executor bd_on_render;

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
