#include "net/commit/upkeep.h"

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/log.h"
#include "net/commit/commits.h"
#include "net/commit/journal_turn.h"
#include "net/loop/release.h"
#include "scene/store/store_journal.h"

struct bd_upkeep {
    struct bd_steps steps;  // first
    struct bd_upkeep *next; // that waits for the end of this one
    char scene_id[BD_SCENE_ID_BYTES];
    uint64_t revision;
    struct bd_scene *scene; // NULL: nothing but collecting
};

static struct bd_journal *journal_of(const struct bd_upkeep *upkeep)
{
    return upkeep->steps.loop->serving->journal;
}

static enum bd_err save_snapshot(struct bd_upkeep *upkeep)
{
    return bd_store_snapshot(journal_of(upkeep), upkeep->scene_id, upkeep->revision, upkeep->scene,
                             &upkeep->steps.detail);
}

// Each part a turn of its own, so that commits get theirs between them.
static void repeat_unless(bool is_done, struct bd_upkeep *upkeep)
{
    if (!is_done) bd_steps_branch(&upkeep->steps, upkeep->steps.step);
}

static enum bd_err compact(struct bd_upkeep *upkeep)
{
    bool is_done = true;
    enum bd_err err = bd_journal_compact(journal_of(upkeep), upkeep->scene_id, BD_STORE_KEEP_EDITS,
                                         &is_done, &upkeep->steps.detail);
    repeat_unless(is_done, upkeep);
    return err;
}

static enum bd_err collect(struct bd_upkeep *upkeep)
{
    bool is_done = true;
    enum bd_err err = bd_journal_collect(journal_of(upkeep), &is_done, &upkeep->steps.detail);
    repeat_unless(is_done, upkeep);
    return err;
}

#define STEP(function)                                                                             \
    {                                                                                              \
        .on = &bd_on_journal, .run.upkeep = function                                               \
    }
static const struct bd_step collect_steps[] = {STEP(collect), {0}};
static const struct bd_step snapshot_steps[] = {
    STEP(save_snapshot), STEP(compact), STEP(collect), {0}};

static void begin(struct bd_upkeep *upkeep)
{
    bd_steps_begin(&upkeep->steps, upkeep->scene ? snapshot_steps : collect_steps);
}

static void drop_first(struct bd_commits *commits)
{
    struct bd_upkeep *first = commits->upkeep;
    commits->upkeep = first->next;
    bd_release_scene(commits->loop, &first->scene);
    free(first);
}

// A scene that was removed meanwhile has no history to look after; what the daemon's end stops is
// done by the next one.
static bool is_worth_a_word(const struct bd_err_detail *detail)
{
    const bool is_removed = detail->err == BD_ERR_NOT_FOUND && strcmp(detail->field, "scene") == 0;
    return detail->err && detail->err != BD_ERR_CANCELLED && !is_removed;
}

static void end(struct bd_steps *steps)
{
    struct bd_commits *commits = steps->commits;
    if (is_worth_a_word(&steps->detail))
        bd_log(BD_LOG_WARN, "net", "upkeep of the journal put off: %s", steps->detail.message);
    drop_first(commits);
    while (commits->upkeep && commits->loop->draining) drop_first(commits); // theirs never begin
    if (commits->upkeep) begin(commits->upkeep);
}

static enum bd_err run_step(struct bd_steps *steps)
{
    return steps->step->run.upkeep((struct bd_upkeep *)steps);
}

static const struct bd_steps_kind kind = {.run = run_step, .end = end, .stops_with_daemon = true};

static bool is_due(const struct bd_batch *batch)
{
    return batch->kind == BD_BATCH_REMOVE ||
           (batch->after && batch->revision % BD_STORE_SNAPSHOT_EDITS == 0);
}

static struct bd_upkeep *create(struct bd_commits *commits, const struct bd_batch *batch)
{
    struct bd_upkeep *upkeep = calloc(1, sizeof *upkeep);
    BD_ASSERT(upkeep);
    upkeep->steps = (struct bd_steps){.kind = &kind, .loop = commits->loop, .commits = commits};
    upkeep->revision = batch->revision;
    memcpy(upkeep->scene_id, batch->scene_id, sizeof upkeep->scene_id);
    if (batch->after) upkeep->scene = bd_scene_retain(batch->after);
    return upkeep;
}

// Of one scene the last snapshot, and one collection after removals, which each upkeep ends with.
static bool has_waiting(struct bd_commits *commits, const struct bd_batch *batch)
{
    for (struct bd_upkeep *u = commits->upkeep->next; u; u = u->next) {
        if (!batch->after) return true;
        if (!u->scene || strcmp(u->scene_id, batch->scene_id) != 0) continue;
        bd_release_scene(commits->loop, &u->scene);
        u->scene = bd_scene_retain(batch->after);
        u->revision = batch->revision;
        return true;
    }
    return false;
}

void bd_upkeep_after(struct bd_commits *commits, const struct bd_batch *batch)
{
    if (!is_due(batch) || commits->loop->draining) return;
    if (!commits->upkeep) {
        commits->upkeep = create(commits, batch);
        begin(commits->upkeep);
    } else if (!has_waiting(commits, batch)) {
        struct bd_upkeep *last = commits->upkeep;
        while (last->next) last = last->next;
        last->next = create(commits, batch);
    }
}
