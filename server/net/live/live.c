// What is live, with the loop; and the way of frames back to it.

#include "net/live/live.h"

#include "net/live/frame_job.h"
#include "net/live/view.h"

static void on_frames_ended(uv_async_t *async)
{
    bd_frame_jobs_collect(async->data);
}

void bd_live_begin(struct bd_live *live, struct bd_loop *loop)
{
    live->loop = loop;
    uv_mutex_init(&live->ended_lock);
    uv_async_init(&loop->uv, &live->frames_ended, on_frames_ended);
    live->frames_ended.data = live;
    bd_views_begin(live);
}

void bd_live_close(struct bd_live *live)
{
    bd_views_finish(live);
    uv_close((uv_handle_t *)&live->frames_ended, NULL);
}

void bd_live_finish(struct bd_live *live)
{
    uv_mutex_destroy(&live->ended_lock);
}

// --- frames that ended ---------------------------------------------------------------------------

void bd_frame_job_done(void *user, struct bd_job *job)
{
    struct bd_frame_job *frame_job = user;
    struct bd_live *live = frame_job->live;
    (void)job;
    uv_mutex_lock(&live->ended_lock);
    frame_job->next = live->ended;
    live->ended = frame_job;
    // Under the lock: once it is open, the loop may take the job, end with it, and close.
    uv_async_send(&live->frames_ended);
    uv_mutex_unlock(&live->ended_lock);
}

// Newest first, as pushed: the loop wants them in the order in which they ended.
static struct bd_frame_job *reverse(struct bd_frame_job *list)
{
    struct bd_frame_job *reversed = NULL;
    while (list) {
        struct bd_frame_job *next = list->next;
        list->next = reversed;
        reversed = list;
        list = next;
    }
    return reversed;
}

void bd_frame_jobs_collect(struct bd_live *live)
{
    uv_mutex_lock(&live->ended_lock);
    struct bd_frame_job *ended = reverse(live->ended);
    live->ended = NULL;
    uv_mutex_unlock(&live->ended_lock);
    while (ended) {
        struct bd_frame_job *job = ended;
        ended = job->next;
        job->ended(job);
    }
}
