// What is live, with the loop.

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
