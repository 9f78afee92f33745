// What the scheduler's own files share: its struct, and the calls between them.
//
// Private to sched/.

#ifndef BD_SCHED_SCHED_PARTS_H
#define BD_SCHED_SCHED_PARTS_H

#include <pthread.h>

#include "frame/frame.h"
#include "sched/check_views.h"
#include "sched/fair_share.h"
#include "sched/job.h"
#include "sched/queue.h"
#include "sched/sched.h"
#include "sched/worker.h"

struct bd_sched {
    struct bd_sched_options options;
    char device[64];
    char cache_directory[4096];
    uint64_t disk_reserve_bytes;
    pthread_t thread;
    struct bd_reference_runner *reference_runner;
    struct bd_job_worker *references, *checks;
    struct bd_check_views *check_views; // the checks' worker only

    pthread_mutex_t lock; // of everything below
    pthread_cond_t work_changed;
    struct bd_job_queue queue;
    struct bd_job *running[BD_FRAMES_MAX]; // each set aside for the next; the last has the device
    uint32_t running_count;
    bool stopping;
    bool started; // the device was tried
    enum bd_err start_err;
    struct bd_err_detail start_detail;
    struct bd_sched_stats stats;

    // Render thread only.
    struct bd_gpu *gpu;
    struct bd_renderer renderer;
    struct bd_fair_share share;
    uint64_t noted_ns;    // up to when time is accounted for
    bool spoilt_by_other; // the device failed under a job for which another was set aside
};

// --- the device (device.c), on the render thread --------------------------------------------

// `lose_after`: of struct bd_gpu_options, for tests.
BD_MUST_CHECK
enum bd_err bd_sched_open_device(struct bd_sched *sched, uint32_t lose_after,
                                 struct bd_err_detail *detail);
void bd_sched_close_device(struct bd_sched *sched);
// What stuck to a device stays: out of memory in the middle of a pass or a refused call, as well as
// a loss, would fail every frame to come.
bool bd_sched_device_is_spoilt(const struct bd_sched *sched);
void bd_sched_drop_device(struct bd_sched *sched);
// Opens one where there is none. Not left to the next job: a daemon without a device says that it
// is not ready, and gets none.
void bd_sched_mend_device(struct bd_sched *sched);

// --- jobs -----------------------------------------------------------------------------------

// The render thread (render_thread.c); `user` is the scheduler.
void *bd_sched_render_thread(void *user);
// Accounts for a job and ends it (sched.c). On the thread that had it last.
void bd_sched_end_job(struct bd_sched *sched, struct bd_job *job);

#endif
