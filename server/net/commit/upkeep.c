#include "net/commit/upkeep.h"

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/log.h"
#include "net/commit/commits.h"
#include "net/commit/journal_turn.h"
#include "net/loop/release.h"
#include "scene/store/store_journal.h"

enum phase { PHASE_SNAPSHOT, PHASE_COMPACT, PHASE_COLLECT };

struct bd_upkeep {
    struct bd_journal_turn turn; // first
    struct bd_upkeep *next;      // that waits for the end of this one
    enum phase phase;
    char scene_id[BD_SCENE_ID_BYTES];
    uint64_t revision;
    struct bd_scene *scene; // NULL: nothing but collecting
    bool is_done;           // with the phase
    enum bd_err err;
    struct bd_fault fault;
};

static void on_pool(struct bd_journal_turn *turn)
{
    struct bd_upkeep *upkeep = (struct bd_upkeep *)turn;
    struct bd_journal *journal = turn->commits->loop->serving->journal;
    upkeep->is_done = true;
    switch (upkeep->phase) {
    case PHASE_SNAPSHOT:
        upkeep->err = bd_store_snapshot(journal, upkeep->scene_id, upkeep->revision, upkeep->scene,
                                        &upkeep->fault);
        break;
    case PHASE_COMPACT:
        upkeep->err = bd_journal_compact(journal, upkeep->scene_id, BD_STORE_KEEP_EDITS,
                                         &upkeep->is_done, &upkeep->fault);
        break;
    case PHASE_COLLECT:
        upkeep->err = bd_journal_collect(journal, &upkeep->is_done, &upkeep->fault);
        break;
    }
}

static void drop_first(struct bd_commits *commits)
{
    struct bd_upkeep *first = commits->upkeep;
    commits->upkeep = first->next;
    bd_release_scene(commits->loop, &first->scene);
    free(first);
}

// With the one under way those that wait for it, if the daemon ends.
static void finish(struct bd_commits *commits)
{
    drop_first(commits);
    while (commits->upkeep && commits->loop->draining) drop_first(commits);
    if (commits->upkeep) bd_journal_turn_take(commits, &commits->upkeep->turn);
}

// A scene that was removed meanwhile has no history to look after.
static bool is_removed(const struct bd_upkeep *upkeep)
{
    return upkeep->err == BD_ERR_NOT_FOUND && strcmp(upkeep->fault.field, "scene") == 0;
}

// One step after the other, each a turn of its own.
static void back(struct bd_journal_turn *turn)
{
    struct bd_upkeep *upkeep = (struct bd_upkeep *)turn;
    if (upkeep->err && !is_removed(upkeep))
        bd_log(BD_LOG_WARN, "net", "upkeep of the journal put off: %s", upkeep->fault.message);
    bool is_over = upkeep->is_done && upkeep->phase == PHASE_COLLECT;
    if (upkeep->err || is_over || turn->commits->loop->draining) {
        finish(turn->commits);
        return;
    }
    if (upkeep->is_done) upkeep->phase++;
    bd_journal_turn_take(turn->commits, turn);
}

static bool is_due(const struct bd_batch *batch)
{
    return batch->kind == BD_BATCH_REMOVE ||
           (batch->after && batch->revision % BD_STORE_SNAPSHOT_EDITS == 0);
}

static struct bd_upkeep *create(const struct bd_batch *batch)
{
    struct bd_upkeep *upkeep = calloc(1, sizeof *upkeep);
    BD_ASSERT(upkeep);
    upkeep->turn.on_pool = on_pool;
    upkeep->turn.back = back;
    upkeep->phase = batch->after ? PHASE_SNAPSHOT : PHASE_COLLECT;
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
        commits->upkeep = create(batch);
        bd_journal_turn_take(commits, &commits->upkeep->turn);
    } else if (!has_waiting(commits, batch)) {
        struct bd_upkeep *last = commits->upkeep;
        while (last->next) last = last->next;
        last->next = create(batch);
    }
}
