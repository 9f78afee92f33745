#include "net/commit/journal_turn.h"

#include "base/assert.h"
#include "net/commit/commits.h"

static void begin_next(struct bd_commits *commits);

static void on_pool(uv_work_t *work)
{
    struct bd_journal_turn *turn = work->data;
    turn->on_pool(turn);
}

static void back(uv_work_t *work, int status)
{
    struct bd_journal_turn *turn = work->data;
    struct bd_commits *commits = turn->commits;
    BD_ASSERT_CMP(status, ==, 0);
    commits->turns = turn->next;
    turn->back(turn); // it may be gone after this
    begin_next(commits);
}

static void begin_next(struct bd_commits *commits)
{
    struct bd_journal_turn *turn = commits->turns;
    if (!turn || turn->work.data) return;
    turn->work.data = turn;
    int result = uv_queue_work(&commits->loop->uv, &turn->work, on_pool, back);
    BD_ASSERT_CMP(result, ==, 0);
}

void bd_journal_turn_take(struct bd_commits *commits, struct bd_journal_turn *turn)
{
    turn->commits = commits;
    turn->next = NULL;
    turn->work.data = NULL; // not begun
    struct bd_journal_turn **last = &commits->turns;
    while (*last) last = &(*last)->next;
    *last = turn;
    begin_next(commits);
}

bool bd_journal_turn_is_taken(const struct bd_commits *commits)
{
    return commits->turns != NULL;
}
