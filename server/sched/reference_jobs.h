// Jobs of technique reference: a queue of their own and a thread that takes them one by one, so
// that frames on the device go on meanwhile. The thread starts with the first job.
//
// Private to sched/. Thread: any.

#ifndef BD_SCHED_REFERENCE_JOBS_H
#define BD_SCHED_REFERENCE_JOBS_H

#include <stdbool.h>
#include <stdint.h>

#include "sched/job.h"
#include "sched/reference_runner.h"

struct bd_reference_jobs;

// `runner` is borrowed. `ended` is called for each job that was run, before it is published.
struct bd_reference_jobs *bd_reference_jobs_create(uint32_t capacity,
                                                   struct bd_reference_runner *runner,
                                                   void (*ended)(void *user,
                                                                 const struct bd_job *job),
                                                   void *user);
// Cancels what runs, fails what waits, joins the thread. Takes NULL.
void bd_reference_jobs_destroy(struct bd_reference_jobs **jobs);

// False if the queue is full.
bool bd_reference_jobs_push(struct bd_reference_jobs *jobs, struct bd_job *job);
void bd_reference_jobs_count(struct bd_reference_jobs *jobs, uint32_t *waiting, uint32_t *running);

#endif
