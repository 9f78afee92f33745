// The runner of steps, and the executors of the loop, of the pool and of the background.

#include "net/loop/steps.h"

#include "base/assert.h"
#include "net/loop/loop.h"

// --- the runner -----------------------------------------------------------------------------

static void tell_stage(struct bd_steps *steps)
{
    const char *stage = steps->step->stage;
    if (stage && steps->kind->tell) steps->kind->tell(steps, stage);
}

static bool is_cancelled(const struct bd_steps *steps)
{
    const struct bd_steps_kind *kind = steps->kind;
    return atomic_load(&steps->cancelled) && !(kind->is_past_cancel && kind->is_past_cancel(steps));
}

// The one place between two steps.
static bool is_over(struct bd_steps *steps)
{
    struct bd_err_detail *detail = &steps->detail;
    if (detail->err) return true;
    if (is_cancelled(steps))
        bd_err_set(detail, BD_ERR_CANCELLED, "", "the request was cancelled");
    else if (!steps->step->on)
        return true;
    else if (steps->kind->stops_with_daemon && steps->loop->draining)
        bd_err_set(detail, BD_ERR_CANCELLED, "", "the server is shutting down");
    return detail->err != BD_ERR_OK;
}

void bd_steps_go_on(struct bd_steps *steps)
{
    while (!is_over(steps)) {
        const struct bd_step_executor *on = steps->step->on;
        steps->waits = false;
        if (on != &bd_on_background) tell_stage(steps);
        if (!on->begin(steps) || steps->waits) return;
        bd_steps_pass(steps);
    }
    steps->kind->end(steps);
}

void bd_steps_pass(struct bd_steps *steps)
{
    steps->step = steps->branch ? steps->branch : steps->step + 1;
    steps->branch = NULL;
}

void bd_steps_back(struct bd_steps *steps)
{
    bd_steps_pass(steps);
    bd_steps_go_on(steps);
}

void bd_steps_begin(struct bd_steps *steps, const struct bd_step *first)
{
    steps->step = first;
    steps->branch = NULL;
    bd_steps_go_on(steps);
}

void bd_steps_cancel(struct bd_steps *steps)
{
    const struct bd_step_executor *on = steps->step->on;
    atomic_store(&steps->cancelled, true);
    if (on && on->stop && on->stop(steps)) bd_steps_go_on(steps);
}

void bd_steps_branch(struct bd_steps *steps, const struct bd_step *list)
{
    steps->branch = list;
}

void bd_steps_finish(struct bd_steps *steps)
{
    static const struct bd_step none[1];
    steps->branch = none;
}

// A step says why it failed; a failure without words of its own has some put in.
void bd_steps_record(struct bd_steps *steps, enum bd_err err)
{
    struct bd_err_detail *detail = &steps->detail;
    if (err && detail->err != err)
        bd_err_set(detail, err, "", "the request ended: %s", bd_err_name(err));
    detail->err = err;
}

void bd_steps_run(struct bd_steps *steps)
{
    bd_steps_record(steps, steps->kind->run(steps));
}

// --- on the loop ----------------------------------------------------------------------------

static bool begin_on_loop(struct bd_steps *steps)
{
    bd_steps_run(steps);
    return true;
}

const struct bd_step_executor bd_on_loop = {.begin = begin_on_loop};

// --- on the pool ----------------------------------------------------------------------------

static void run_on_pool(uv_work_t *work)
{
    bd_steps_run(work->data);
}

static void pool_back(uv_work_t *work, int status)
{
    BD_ASSERT_CMP(status, ==, 0);
    bd_steps_back(work->data);
}

static bool begin_on_pool(struct bd_steps *steps)
{
    steps->work.data = steps;
    int result = uv_queue_work(&steps->loop->uv, &steps->work, run_on_pool, pool_back);
    BD_ASSERT_CMP(result, ==, 0);
    return false;
}

const struct bd_step_executor bd_on_pool = {.begin = begin_on_pool};

// --- in the background ----------------------------------------------------------------------

static void background_begun(struct bd_background *work)
{
    tell_stage(work->user);
}

static void run_in_background(struct bd_background *work)
{
    bd_steps_run(work->user);
}

static void background_back(struct bd_background *work)
{
    struct bd_steps *steps = work->user;
    if (work->has_failed)
        bd_err_set(&steps->detail, BD_ERR_NO_MEMORY, "", "the system has no thread for it");
    bd_steps_back(steps);
}

static bool begin_in_background(struct bd_steps *steps)
{
    steps->background = (struct bd_background){.user = steps,
                                               .lane = steps->step->lane,
                                               .begun = background_begun,
                                               .run = run_in_background,
                                               .back = background_back};
    bd_background_start(steps->loop, &steps->background);
    return false;
}

static bool drop_waiting(struct bd_steps *steps)
{
    return bd_background_drop(&steps->background);
}

const struct bd_step_executor bd_on_background = {.begin = begin_in_background,
                                                  .stop = drop_waiting};
