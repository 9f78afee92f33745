#include "sched/standby.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "frame/ladder.h"
#include "sched/job.h"

struct bd_standby {
    struct bd_param_list asked, cheap;
    bool stands, improves;
    struct bd_job_result kept;
};

struct bd_standby *bd_standby_create(struct bd_job_request *request)
{
    struct bd_frame_request *frame = &request->frame;
    struct bd_param_list cheap;
    if (!request->accepts_cheaper || frame->deadline_ms == 0 || frame->plan_only ||
        bd_frame_request_is_traced(frame) || bd_frame_request_is_checked(frame) ||
        !bd_ladder_cheapest(bd_technique_for(frame->technique, &frame->params, NULL),
                            &frame->params, &cheap))
        return NULL;
    struct bd_standby *standby = calloc(1, sizeof *standby);
    BD_ASSERT(standby);
    standby->asked = frame->params;
    standby->cheap = frame->params = cheap;
    return standby;
}

static void free_layers(struct bd_job_result *result)
{
    for (uint32_t l = 0; l < BD_LAYER_COUNT; l++) bd_image_destroy(&result->layers[l]);
}

void bd_standby_destroy(struct bd_standby **standby)
{
    if (!*standby) return;
    free_layers(&(*standby)->kept);
    free(*standby);
    *standby = NULL;
}

static void keep(struct bd_job *job)
{
    free_layers(&job->standby->kept);
    job->standby->kept = job->result;
    job->standby->stands = true;
    job->result = (struct bd_job_result){0};
    job->request.frame.params = job->standby->asked;
}

void bd_standby_keep_for(struct bd_job *job, const struct bd_param_list *better)
{
    if (!job->standby) job->standby = calloc(1, sizeof *job->standby);
    BD_ASSERT(job->standby);
    job->standby->improves = true;
    job->standby->cheap = job->request.frame.params;
    job->standby->asked = *better;
    keep(job);
}

// The rung's pairs, as they stand in for what was asked: those that differ from it.
static void describe(const struct bd_standby *standby, char *out, size_t size)
{
    size_t used = 0;
    out[0] = 0;
    for (uint32_t i = 0; i < standby->cheap.count && used < size; i++) {
        const char *key = standby->cheap.pairs[i].key, *value = standby->cheap.pairs[i].value;
        if (i < standby->asked.count && strcmp(standby->asked.pairs[i].value, value) == 0) continue;
        used += (size_t)snprintf(out + used, size - used, " %s=%s", key, value);
    }
}

static void stand_in(struct bd_job *job)
{
    struct bd_standby *standby = job->standby;
    struct bd_report_time time_ms = job->result.report.time_ms;
    const enum bd_err err = job->result.err;
    const struct bd_err_detail detail = job->result.detail;
    char settings[BD_REPORT_FLAG_BYTES];
    free_layers(&job->result);
    job->result = standby->kept;
    standby->kept = (struct bd_job_result){0};
    standby->stands = false;
    job->is_settled = true;
    struct bd_report *report = &job->result.report;
    bd_report_add_time(&report->time_ms, &time_ms);
    // A budget that is spent: its flag stands already.
    if (err == BD_ERR_DEADLINE && job->budget_ends_ns && !bd_job_is_late(job)) return;
    if (err != BD_ERR_DEADLINE) {
        bd_report_flag(report, "better_failed: %.160s", detail.message);
        return;
    }
    report->stopped = BD_STOPPED_DEADLINE;
    if (report->aa < job->request.frame.aa)
        snprintf(settings, sizeof settings, " aa=%u", report->aa);
    else
        describe(standby, settings, sizeof settings);
    bd_report_flag(report, "deadline_rung: %u ms passed, rendered with%s",
                   job->request.frame.deadline_ms, settings);
}

bool bd_standby_take(struct bd_job *job)
{
    struct bd_standby *standby = job->standby;
    if (!standby) return false;
    if (!standby->stands && job->result.err == BD_ERR_OK) {
        keep(job);
        return true;
    }
    if (!standby->stands) return false;
    const enum bd_err err = job->result.err;
    if (err == BD_ERR_DEADLINE || (standby->improves && err && err != BD_ERR_CANCELLED))
        stand_in(job);
    else
        bd_report_add_time(&job->result.report.time_ms, &standby->kept.report.time_ms);
    return false;
}
