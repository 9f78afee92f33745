// The scheduler: jobs in, frames out. Owns the render thread, which owns the GL context.
//
// A job is a snapshot and a request. Jobs of technique reference, which the processor traces, have
// a queue and threads of their own (sched/reference_runner.h). The others wait in one bounded
// queue, higher priority first, then owner after owner (sched/queue.h). Cancel and deadlines are
// checked between slices of about 6 ms; there a frame is also set aside for jobs of higher
// priority, or of its own and another owner's once it had the device for a while, and goes on
// afterwards. Lower ones are owed a ninth of the time (sched/fair_share.h). When the device is
// lost, or an error sticks to it, the context is rebuilt and the job tried once more.
//
// Thread: every function may be called from any thread, unless it says otherwise.

#ifndef BD_SCHED_SCHED_H
#define BD_SCHED_SCHED_H

#include <stdbool.h>
#include <stdint.h>

#include "base/err.h"
#include "base/stalls.h"
#include "frame/report.h"
#include "frame/request.h"
#include "image/image.h"
#include "scene/model/scene.h"

struct bd_sched;
struct bd_job;

struct bd_sched_options {
    const char *device;          // "auto", "software", "egl:N", "uuid:HEX", "pci:ID"
    const char *data_directory;  // the drivers' shader caches live in it; NULL = none
    uint64_t disk_reserve_bytes; // free on the caches' disk, or there are none
    bool quick_code;             // bd_gpu_options
    uint32_t gpu_memory_mib;     // 0 = three quarters of what the device says, 2048 if it does not
    uint32_t queue_length_max;   // jobs waiting in each queue; beyond: BD_ERR_BUSY
    uint32_t reference_threads;  // 0 = as many as the machine runs at once
    struct bd_frame_limits frame_limits;
    uint32_t lose_device_after_slices; // test hook: inject one device loss; 0 = never
};

// Starts the render thread and waits until its device stands. `detail` says what was tried.
BD_MUST_CHECK
enum bd_err bd_sched_create(const struct bd_sched_options *options, struct bd_sched **out,
                            struct bd_err_detail *detail);
// Cancels what runs, fails what waits, joins the thread.
void bd_sched_destroy(struct bd_sched **sched);

struct bd_job_request {
    struct bd_scene *scene;        // the job takes its own reference
    struct bd_frame_request frame; // checked by bd_sched_submit
    uint32_t spent_ms; // of the frame's deadline, at most all: the client's began before
    int priority;      // higher first (net/live/frame_job.h)
    bool accepts_cheaper; // where the deadline passes: the technique's cheapest rung, which is
                          // rendered before what was asked for, with the flag `deadline_rung`
    bool improves; // of technique `auto`: rendered again where its own estimate of its error is
                   // large
    uint64_t turn; // whose it is: among jobs of one priority, owners take turns. 0 = one more owner
    // Called once, on the thread that ran the job, when it ended: only enqueue, then return. NULL
    // is fine for who waits.
    void (*done)(void *user, struct bd_job *job);
    void *user;
};

// The caller owns `*out` and releases it after `done`, or at once if it does not care.
BD_MUST_CHECK
enum bd_err bd_sched_submit(struct bd_sched *sched, const struct bd_job_request *request,
                            struct bd_job **out, struct bd_err_detail *detail);

// Asks a job to stop; it still ends by `done`, with BD_ERR_CANCELLED, within a slice of whatever is
// rendered: also one that waits or is set aside. A reference or a check that waits ends when it is
// its turn. Harmless when it has ended.
void bd_job_cancel(struct bd_job *job);
// Share of the stage's work that is done, 0 to 1; stays 0 for what ends in a moment.
double bd_job_progress(const struct bd_job *job);
// "render", or "check" while its error is estimated. Static.
const char *bd_job_stage(const struct bd_job *job);
// Blocks until the job has ended.
void bd_job_wait(struct bd_job *job);
void bd_job_release(struct bd_job **job);

// Valid once the job has ended; borrowed until its release. `layers[l]` is NULL unless asked for;
// all are NULL after a failure or for a plan. After a passed deadline the result is
// BD_ERR_DEADLINE and the report tells how far it came; but a frame that stands when its check or
// refinement ran out of time is a result, and so is one that stands in (accepts_cheaper): with
// report.stopped = BD_STOPPED_DEADLINE.
struct bd_job_result {
    enum bd_err err;
    struct bd_err_detail detail;
    struct bd_image *layers[BD_LAYER_COUNT];
    struct bd_report report;
};
const struct bd_job_result *bd_job_result(const struct bd_job *job);

struct bd_sched_stats {
    char device_name[128], device_class[64];
    bool software;
    bool device_ok; // false between a loss and the rebuilt context
    uint64_t jobs_done, jobs_failed, jobs_cancelled, device_losses;
    uint32_t jobs_waiting, jobs_running;
    double gpu_memory_mib, gpu_memory_peak_mib, gpu_memory_limit_mib;
    double render_seconds;       // total, of finished jobs
    double reference_memory_mib; // snapshots prepared for tracing
    // How long the render thread worked without asking whether to stop or to give way; once a
    // slice.
    struct bd_stalls render_stalls;
};
void bd_sched_stats(struct bd_sched *sched, struct bd_sched_stats *out);

#endif
