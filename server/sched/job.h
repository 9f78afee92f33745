// A job's life, private to sched/. Two references: the submitter's and the scheduler's, which it
// drops after `done`.

#ifndef BD_SCHED_JOB_H
#define BD_SCHED_JOB_H

#include <pthread.h>
#include <stdatomic.h>

#include "sched/sched.h"

struct bd_job {
    atomic_uint reference_count;
    atomic_bool cancelled;
    atomic_bool yields;        // its room on the device: it stops, and begins anew later
    uint32_t yield_count;      // render thread
    uint32_t spoilt_count;     // devices that failed under it while another's frame was set aside
    uint64_t turn_ends_ns;     // from then on equals come between its slices. Render thread
    bool has_the_device_alone; // until its end: others find no room beside it. Render thread
    bool is_given_up;          // ended already, while its frame was set aside. Render thread
    struct bd_job_request request;
    uint64_t deadline_ns;     // 0 = none
    atomic_uint progress_ppm; // share of the work that is done, in millionths
    atomic_bool checking;     // the work is a spot check, not the frame
    bool render_again;        // the check's verdict, on its way back to the render thread
    bool is_settled;          // a kept frame stood in: nothing better is tried. Render thread
    uint32_t asked_aa;        // sub-frames that follow the first, by which it is judged; 0 = none
    // Size, layers and parameters of what follows a pilot (sched/improve.h), 0 = none; and what
    // that took.
    uint32_t asked_width_px, asked_height_px, asked_layers;
    struct bd_param_list asked_params;
    struct bd_report_time pilot_ms; // until it is in a report
    double improved_ms;             // spent of its budget (sched/improve.h). Render thread
    uint64_t budget_ends_ns;        // for the frame that is to be better; 0 = none. Render thread
    struct bd_standby *standby;     // NULL unless a cheaper frame may stand in (sched/standby.h)
    struct bd_job_check *check;     // NULL unless its error is to be estimated (sched/job_check.h)
    // What its frame makes, until it is at its end. Render thread. The frame of a job that was
    // cancelled while aside is unwound when it gets the device back: `result` was the client's by
    // then.
    struct bd_job_result rendered;
    struct bd_job_result result;
    pthread_mutex_t lock; // of `ended`
    pthread_cond_t ended_changed;
    bool ended;
};

struct bd_job *bd_job_create(const struct bd_job_request *request);
void bd_job_drop(struct bd_job *job);

// BD_ERR_OK, BD_ERR_CANCELLED or BD_ERR_DEADLINE; `user` is the job. For the slicer.
enum bd_err bd_job_should_stop(void *user);

// Whether its deadline has passed.
bool bd_job_is_late(const struct bd_job *job);

// Fills the error of a cancel, of a deadline, and of an error that nobody described.
void bd_job_describe_failure(struct bd_job *job);

// Publishes the result: wakes waiters, calls `done`, drops the scheduler's reference.
void bd_job_end(struct bd_job *job);

#endif
