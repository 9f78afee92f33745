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
    struct bd_steps *steps = user;
    struct bd_live *live = steps->live;
    (void)job;
    uv_mutex_lock(&live->ended_lock);
    steps->next = live->ended;
    live->ended = steps;
    // Under the lock: once it is open, the loop may take the job, end with it, and close.
    uv_async_send(&live->frames_ended);
    uv_mutex_unlock(&live->ended_lock);
}

// Newest first, as pushed: the loop wants them in the order in which they ended.
static struct bd_steps *reverse(struct bd_steps *list)
{
    struct bd_steps *reversed = NULL;
    while (list) {
        struct bd_steps *next = list->next;
        list->next = reversed;
        reversed = list;
        list = next;
    }
    return reversed;
}

static void come_back(struct bd_steps *steps)
{
    const struct bd_job_result *result = bd_job_result(steps->job);
    steps->detail = result->detail;
    bd_steps_record(steps, result->err);
    bd_steps_back(steps);
}

void bd_frame_jobs_collect(struct bd_live *live)
{
    uv_mutex_lock(&live->ended_lock);
    struct bd_steps *ended = reverse(live->ended);
    live->ended = NULL;
    uv_mutex_unlock(&live->ended_lock);
    while (ended) {
        struct bd_steps *steps = ended;
        ended = steps->next;
        come_back(steps);
    }
}

static bool submit(struct bd_steps *steps)
{
    bd_steps_run(steps);
    return steps->detail.err != BD_ERR_OK;
}

static bool cancel(struct bd_steps *steps)
{
    if (steps->job) bd_job_cancel(steps->job);
    return false;
}

const struct bd_step_executor bd_on_render = {.begin = submit, .stop = cancel};
