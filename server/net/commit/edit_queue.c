#include "net/commit/edit_queue.h"

#include <string.h>

#include "base/assert.h"
#include "net/commit/commits.h"

static bool is_first_of_scene(const struct bd_commits *commits, const struct bd_edit_place *place)
{
    const struct bd_edit_place *at = commits->edit_places;
    while (at != place && strcmp(at->scene_id, place->scene_id) != 0) at = at->next;
    return at == place;
}

// An edit that begins may leave the queue at once, and others with it: so the walk starts at the
// front again.
void bd_edits_go_on(struct bd_commits *commits)
{
    struct bd_edit_place *place = commits->edit_places;
    while (place) {
        bool may_begin = !place->has_begun && is_first_of_scene(commits, place);
        place->has_begun = place->has_begun || may_begin;
        struct bd_edit_place *next = place->next;
        if (may_begin) {
            uint64_t change = ++commits->edit_changes;
            if (!place->begin(place))
                place->has_begun = false;
            else if (commits->edit_changes != change)
                next = commits->edit_places;
        }
        place = next;
    }
}

void bd_edit_queue_join(struct bd_commits *commits, struct bd_edit_place *place)
{
    struct bd_edit_place **last = &commits->edit_places;
    while (*last) last = &(*last)->next;
    place->next = NULL;
    place->has_begun = false;
    *last = place;
    bd_edits_go_on(commits);
}

void bd_edit_queue_leave(struct bd_commits *commits, struct bd_edit_place *place)
{
    struct bd_edit_place **at = &commits->edit_places;
    while (*at && *at != place) at = &(*at)->next;
    BD_ASSERT(*at);
    *at = place->next;
    commits->edit_changes++;
}
