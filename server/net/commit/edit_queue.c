#include "net/commit/edit_queue.h"

#include <string.h>

#include "base/assert.h"
#include "net/commit/commits.h"

// --- the turn of a scene --------------------------------------------------------------------

static bool is_first_of_scene(const struct bd_commits *commits, const struct bd_edit_place *place)
{
    const struct bd_edit_place *at = commits->edit_places;
    while (at != place && strcmp(at->scene_id, place->scene_id) != 0) at = at->next;
    return at == place;
}

// Its edit may leave the queue at once, and others with it.
static bool begin(struct bd_commits *commits, struct bd_edit_place *place)
{
    const uint64_t change = ++commits->edit_changes;
    place->has_begun = true;
    bd_steps_go_on(place->steps);
    return commits->edit_changes != change;
}

// Begins every edit whose turn it is, from the front anew when the queue has changed under it.
void bd_edits_go_on(struct bd_commits *commits)
{
    if (commits->edits_wait) return;
    commits->edits_wait = true;
    struct bd_edit_place *place = commits->edit_places;
    while (place) {
        struct bd_edit_place *next = place->next;
        const bool may_begin = !place->has_begun && is_first_of_scene(commits, place);
        if (may_begin && begin(commits, place)) next = commits->edit_places;
        place = next;
    }
    commits->edits_wait = false;
}

static bool wait_for_scene(struct bd_steps *steps)
{
    struct bd_commits *commits = steps->commits;
    struct bd_edit_place *place = steps->place;
    struct bd_edit_place **last = &commits->edit_places;
    bd_steps_pass(steps); // to what its turn begins with
    while (*last) last = &(*last)->next;
    place->next = NULL;
    place->has_begun = false;
    place->is_queued = true;
    *last = place;
    commits->edit_changes++;
    bd_edits_go_on(commits);
    return false;
}

const struct bd_step_executor bd_on_scene = {.begin = wait_for_scene};

void bd_edit_queue_wait(struct bd_edit_place *place)
{
    place->has_begun = false;
    place->steps->waits = true;
}

bool bd_edit_queue_leave(struct bd_edit_place *place)
{
    if (!place->is_queued) return false;
    struct bd_commits *commits = place->steps->commits;
    struct bd_edit_place **at = &commits->edit_places;
    while (*at && *at != place) at = &(*at)->next;
    BD_ASSERT(*at);
    *at = place->next;
    place->is_queued = false;
    commits->edit_changes++;
    return true;
}

// --- on the disk ----------------------------------------------------------------------------

// Runs while a commit is published, which asks the queue itself once all is told. An edit that kept
// its turn is asked then, too.
static void on_disk(struct bd_commit_waiter *waiter, const struct bd_batch *batch, enum bd_err err,
                    const struct bd_err_detail *detail)
{
    struct bd_edit_place *place = BD_STEPS_OWNER(waiter, struct bd_edit_place, waiter);
    struct bd_steps *steps = place->steps;
    const bool is_held = steps->step->on == &bd_on_disk_held;
    place->batch = NULL;
    if (err) steps->detail = *detail;
    bd_steps_record(steps, err);
    if (!err) memcpy(place->scene_id, batch->scene_id, sizeof place->scene_id);
    if (is_held && !err) {
        bd_steps_pass(steps);
        place->has_begun = false;
        return;
    }
    bd_steps_back(steps);
}

static bool wait_for_disk(struct bd_steps *steps)
{
    struct bd_edit_place *place = steps->place;
    place->waiter.done = on_disk;
    place->batch->user = &place->waiter;
    bd_commit_soon(steps->commits);
    return false;
}

static bool leave_for_disk(struct bd_steps *steps)
{
    steps->place->is_staged = true;
    wait_for_disk(steps);
    if (bd_edit_queue_leave(steps->place)) bd_edits_go_on(steps->commits);
    return false;
}

const struct bd_step_executor bd_on_disk = {.begin = leave_for_disk};
const struct bd_step_executor bd_on_disk_held = {.begin = wait_for_disk};
