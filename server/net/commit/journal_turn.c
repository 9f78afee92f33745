#include "net/commit/journal_turn.h"

#include "base/assert.h"
#include "net/commit/commits.h"

static void begin_next(struct bd_commits *commits);

static void run_on_pool(uv_work_t *work)
{
    bd_steps_run(work->data);
}

static void back(uv_work_t *work, int status)
{
    struct bd_steps *steps = work->data;
    struct bd_commits *commits = steps->commits;
    BD_ASSERT_CMP(status, ==, 0);
    commits->turns = steps->next;
    commits->has_turn_begun = false;
    bd_steps_back(steps); // they may be gone after this, or wait for another turn
    begin_next(commits);
}

static void begin_next(struct bd_commits *commits)
{
    struct bd_steps *steps = commits->turns;
    if (!steps || commits->has_turn_begun) return;
    commits->has_turn_begun = true;
    steps->work.data = steps;
    int result = uv_queue_work(&commits->loop->uv, &steps->work, run_on_pool, back);
    BD_ASSERT_CMP(result, ==, 0);
}

static bool take_turn(struct bd_steps *steps)
{
    struct bd_steps **last = &steps->commits->turns;
    while (*last) last = &(*last)->next;
    steps->next = NULL;
    *last = steps;
    begin_next(steps->commits);
    return false;
}

const struct bd_step_executor bd_on_journal = {.begin = take_turn};

bool bd_journal_turn_is_taken(const struct bd_commits *commits)
{
    return commits->turns != NULL;
}
