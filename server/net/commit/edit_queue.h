// Edits in the order in which they came: of one scene, one at a time is checked and staged, however
// long its files took to read; of different scenes, side by side.
//
// Thread: the event loop's.

#ifndef BD_NET_COMMIT_EDIT_QUEUE_H
#define BD_NET_COMMIT_EDIT_QUEUE_H

#include <stdbool.h>

#include "base/err.h"
#include "scene/store/store.h"

struct bd_commits;

// Part of whoever waits for the turn of a scene.
struct bd_edit_place {
    char scene_id[BD_SCENE_ID_BYTES];
    // On the loop, once everything of the scene that came before has left the queue. False: not
    // now; asked again after the next commit.
    bool (*begin)(struct bd_edit_place *place);
    bool has_begun;
    struct bd_edit_place *next;
};

// At the end of the queue; may begin before this returns.
void bd_edit_queue_join(struct bd_commits *commits, struct bd_edit_place *place);
// Whatever became of it: whoever comes after it on the scene may begin.
void bd_edit_queue_leave(struct bd_commits *commits, struct bd_edit_place *place);

// Something was committed: those who waited for that are asked again.
void bd_edits_go_on(struct bd_commits *commits);

#endif
