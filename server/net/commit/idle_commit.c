// What lies transient becomes durable by itself, once nobody has added to it for a second.

#include "net/commit/idle_commit.h"

#include "base/clock.h"
#include "base/log.h"
#include "net/commit/commit.h"
#include "net/commit/commits.h"

#define QUIET_NS 1000000000ull

static void on_quiet(uv_timer_t *timer)
{
    bd_idle_commit_run(timer->data, false);
}

static void look_in(struct bd_commits *commits, uint64_t wait_ns)
{
    uv_timer_start(&commits->idle_timer, on_quiet, wait_ns / 1000000 + 1, 0);
}

// One timer for all scenes: a drag that put it off would do so for everybody.
void bd_idle_commit_watch(struct bd_commits *commits)
{
    if (!uv_is_active((uv_handle_t *)&commits->idle_timer)) look_in(commits, QUIET_NS);
}

// What goes by itself is not worth a word: an edit on its way to the disk, a scene that leaves.
static void warn(const char *scene_id, const struct bd_err_detail *detail)
{
    if (detail->err == BD_ERR_BUSY || detail->err == BD_ERR_NOT_FOUND) return;
    bd_log(BD_LOG_WARN, "net", "%s: transient changes stay so for now: %s", scene_id,
           detail->message);
}

// How long until the scene is to be looked at again; UINT64_MAX: there is no need. Each author's is
// a batch by itself.
static uint64_t commit_one(struct bd_commits *commits, const struct bd_store_entry *entry, bool all)
{
    while (entry->transient_ns > 0) {
        struct bd_batch *batch = NULL;
        struct bd_err_detail detail = {0};
        const uint64_t quiet_ns = bd_clock_ns() - entry->transient_ns;
        if (!all && quiet_ns < QUIET_NS) return QUIET_NS - quiet_ns;
        if (bd_store_stage_commit(commits->loop->serving->store, entry->id, NULL, NULL, &batch,
                                  &detail)) {
            warn(entry->id, &detail);
            return QUIET_NS;
        }
        bd_commit_soon(commits);
    }
    return UINT64_MAX;
}

void bd_idle_commit_run(struct bd_commits *commits, bool all)
{
    const struct bd_store *store = commits->loop->serving->store;
    uint64_t soonest_ns = UINT64_MAX;
    for (uint32_t i = 0; i < bd_store_count(store); i++) {
        uint64_t wait_ns = commit_one(commits, bd_store_at(store, i), all);
        if (wait_ns < soonest_ns) soonest_ns = wait_ns;
    }
    if (soonest_ns != UINT64_MAX && !all) look_in(commits, soonest_ns);
}
