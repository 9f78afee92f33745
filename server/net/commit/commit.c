// From staged to acknowledged.

#include "net/commit/commit.h"

#include <stdlib.h>

#include "base/assert.h"
#include "base/log.h"
#include "net/commit/commits.h"
#include "net/commit/edit_queue.h"
#include "net/commit/idle_commit.h"
#include "net/commit/journal_turn.h"
#include "net/commit/upkeep.h"
#include "net/loop/release.h"
#include "scene/store/store_journal.h"

struct bd_commit {
    struct bd_steps steps;    // first
    struct bd_batch *first;   // what is on its way
    struct bd_batch *refused; // what of it cannot be kept, by an error of its own
    bool is_under_way;
    uv_check_t after_poll; // when all that has arrived was looked at
    uv_idle_t no_sleep;    // so that the poll before it does not wait
};

// --- what becomes of a batch ----------------------------------------------------------------

static void tell(const struct bd_batch *batch, enum bd_err err, const struct bd_err_detail *detail)
{
    struct bd_commit_waiter *waiter = batch->user;
    if (waiter) waiter->done(waiter, batch, err, detail);
}

static struct bd_scene *retain_shown(const struct bd_commits *commits, const char *scene_id)
{
    const struct bd_store_entry *entry;
    if (bd_store_get(commits->loop->serving->store, scene_id, &entry, NULL)) return NULL;
    return bd_scene_retain(entry->scene);
}

// First everybody can see it, then whoever asked hears so.
static void publish(struct bd_commits *commits, struct bd_batch *batch)
{
    struct bd_scene *removed = NULL;
    if (batch->kind == BD_BATCH_REMOVE) {
        bd_live_changed(commits->live, batch->scene_id,
                        &(struct bd_live_change){.kind = "removed"});
        removed = retain_shown(commits, batch->scene_id);
    }
    bd_store_publish(commits->loop->serving->store, batch);
    bd_release_scene(commits->loop, &removed);
    const struct bd_live_change change = {.kind = batch->kind == BD_BATCH_ADD ? "added" : "edited",
                                          .delta = &batch->forward,
                                          .author = batch->author,
                                          .batch = bd_batch_kind_name(batch->kind),
                                          .of = batch->of};
    if (batch->after) bd_live_changed(commits->live, batch->scene_id, &change);
    tell(batch, BD_ERR_OK, NULL);
    bd_upkeep_after(commits, batch);
    bd_batch_free(&batch);
}

// The store hears of all of them before any client does: whoever hears it may stage the next edit
// at once, which has to find heads that nothing else will take back. Each batch carries its error.
static void fail_list(struct bd_commits *commits, struct bd_batch *first)
{
    bool was_transient = false;
    for (struct bd_batch *batch = first; batch; batch = batch->next) {
        bd_store_fail(commits->loop->serving->store, batch);
        was_transient |= batch->was_transient;
    }
    if (was_transient && !commits->loop->draining)
        bd_idle_commit_watch(commits); // it lies there again
    while (first) {
        struct bd_batch *batch = first;
        first = batch->next;
        tell(batch, batch->detail.err, &batch->detail);
        bd_batch_free(&batch);
    }
}

static struct bd_batch **end_of(struct bd_batch **list)
{
    while (*list) list = &(*list)->next;
    return list;
}

// What was staged on top of what cannot be kept cannot stand either.
static void fail_all(struct bd_commits *commits, struct bd_batch *first,
                     const struct bd_err_detail *detail)
{
    *end_of(&first) = bd_store_take_staged(commits->loop->serving->store);
    for (struct bd_batch *batch = first; batch; batch = batch->next) batch->detail = *detail;
    fail_list(commits, first);
}

// --- the turn -------------------------------------------------------------------------------

// A name that is not there is one client's mistake and no reason to refuse everybody's edits. What
// makes revisions was checked against the head: if the journal does not agree, none of it can
// stand.
static bool set_aside(struct bd_commit *commit, const struct bd_batch *faulty)
{
    if (!faulty || faulty->after) return false;
    struct bd_batch **at = &commit->first;
    while (*at != faulty) at = &(*at)->next;
    struct bd_batch *batch = *at;
    *at = batch->next;
    batch->detail = commit->steps.detail;
    batch->next = commit->refused;
    commit->refused = batch;
    return true;
}

static enum bd_err write_batches(struct bd_commit *commit)
{
    struct bd_journal *journal = commit->steps.loop->serving->journal;
    const struct bd_batch *faulty;
    enum bd_err err;
    do {
        faulty = NULL;
        err = bd_store_write(journal, commit->first, &faulty, &commit->steps.detail);
    } while (err && set_aside(commit, faulty));
    return err;
}

static enum bd_err run_step(struct bd_steps *steps)
{
    return steps->step->run.commit((struct bd_commit *)steps);
}

static void end(struct bd_steps *steps)
{
    struct bd_commit *commit = (struct bd_commit *)steps;
    struct bd_commits *commits = steps->commits;
    struct bd_batch *batch = commit->first, *refused = commit->refused;
    commit->first = commit->refused = NULL;
    commit->is_under_way = false;
    commits->edits_wait = true; // until all is told
    if (steps->detail.err) {
        bd_log(BD_LOG_ERROR, "net", "edits refused: %s", steps->detail.message);
        fail_all(commits, batch, &steps->detail);
        batch = NULL;
    }
    fail_list(commits, refused);
    while (batch) {
        struct bd_batch *next = batch->next;
        publish(commits, batch);
        batch = next;
    }
    if (bd_store_has_staged(commits->loop->serving->store)) bd_commit_soon(commits);
    commits->edits_wait = false;
    bd_edits_go_on(commits);
}

static const struct bd_step to_disk[] = {{.on = &bd_on_journal, .run.commit = write_batches}, {0}};
static const struct bd_steps_kind kind = {.run = run_step, .end = end};

static void on_idle(uv_idle_t *idle)
{
    (void)idle;
}

static void write_staged(uv_check_t *check)
{
    struct bd_commits *commits = check->data;
    struct bd_commit *commit = commits->commit;
    uv_check_stop(&commit->after_poll);
    uv_idle_stop(&commit->no_sleep);
    if (commit->is_under_way) return; // its end looks again
    commit->first = bd_store_take_staged(commits->loop->serving->store);
    if (!commit->first) return;
    commit->is_under_way = true;
    commit->steps.detail.err = BD_ERR_OK;
    bd_steps_begin(&commit->steps, to_disk);
}

void bd_commit_soon(struct bd_commits *commits)
{
    uv_check_start(&commits->commit->after_poll, write_staged);
    uv_idle_start(&commits->commit->no_sleep, on_idle);
}

bool bd_commit_is_pending(const struct bd_commits *commits)
{
    return commits->commit->is_under_way || bd_store_has_staged(commits->loop->serving->store);
}

void bd_commit_begin(struct bd_commits *commits)
{
    commits->commit = calloc(1, sizeof *commits->commit);
    BD_ASSERT(commits->commit);
    commits->commit->steps =
        (struct bd_steps){.kind = &kind, .loop = commits->loop, .commits = commits};
    uv_check_init(&commits->loop->uv, &commits->commit->after_poll);
    uv_idle_init(&commits->loop->uv, &commits->commit->no_sleep);
    commits->commit->after_poll.data = commits;
}

void bd_commit_close(struct bd_commits *commits)
{
    BD_ASSERT(!commits->commit->is_under_way);
    uv_close((uv_handle_t *)&commits->commit->after_poll, NULL);
    uv_close((uv_handle_t *)&commits->commit->no_sleep, NULL);
}

void bd_commit_finish(struct bd_commits *commits)
{
    free(commits->commit);
    commits->commit = NULL;
}

// --- the room ------------------------------------------------------------------------------------

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
