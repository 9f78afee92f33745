#include "net/edit_queue.h"

#include <string.h>

#include "base/assert.h"
#include "net/net_internal.h"

static bool is_first_of_scene(const struct bd_net *net, const struct bd_edit_place *place)
{
    const struct bd_edit_place *at = net->edit_places;
    while (at != place && strcmp(at->scene_id, place->scene_id) != 0) at = at->next;
    return at == place;
}

// Whoever begins may leave at once, and others with it: so it is looked at from the front again.
void bd_edits_go_on(struct bd_net *net)
{
    struct bd_edit_place *place = net->edit_places;
    while (place) {
        bool may_begin = !place->has_begun && is_first_of_scene(net, place);
        place->has_begun = place->has_begun || may_begin;
        struct bd_edit_place *next = place->next;
        if (may_begin) {
            uint64_t change = ++net->edit_changes;
            if (!place->begin(place))
                place->has_begun = false;
            else if (net->edit_changes != change)
                next = net->edit_places;
        }
        place = next;
    }
}

void bd_edit_queue_join(struct bd_net *net, struct bd_edit_place *place)
{
    struct bd_edit_place **last = &net->edit_places;
    while (*last) last = &(*last)->next;
    place->next = NULL;
    place->has_begun = false;
    *last = place;
    bd_edits_go_on(net);
}

void bd_edit_queue_leave(struct bd_net *net, struct bd_edit_place *place)
{
    struct bd_edit_place **at = &net->edit_places;
    while (*at && *at != place) at = &(*at)->next;
    BD_ASSERT(*at);
    *at = place->next;
    net->edit_changes++;
}
