// The way to the disk, with the loop.

#include "net/commit/commits.h"

#include "net/commit/commit.h"
#include "net/commit/journal_turn.h"

void bd_commits_begin(struct bd_commits *commits, struct bd_loop *loop, struct bd_live *live)
{
    commits->loop = loop;
    commits->live = live;
    uv_timer_init(&loop->uv, &commits->idle_timer);
    commits->idle_timer.data = commits;
    bd_commit_begin(commits);
    bd_disk_watch_begin(commits);
}

void bd_commits_close(struct bd_commits *commits)
{
    uv_close((uv_handle_t *)&commits->idle_timer, NULL);
    bd_commit_close(commits);
    bd_disk_watch_close(commits);
}

void bd_commits_finish(struct bd_commits *commits)
{
    bd_commit_finish(commits);
}

bool bd_commits_are_idle(const struct bd_commits *commits)
{
    return !bd_commit_is_pending(commits) && !bd_journal_turn_is_taken(commits);
}
