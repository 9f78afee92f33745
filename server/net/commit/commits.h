// The way to the disk: edits in their order, commits, turns at the journal, its upkeep, and a look at
// the data directory.
//
// Owned by net.c. Thread: the event loop's.

#ifndef BD_NET_COMMIT_COMMITS_H
#define BD_NET_COMMIT_COMMITS_H

#include "net/commit/disk_watch.h"
#include "net/live/live.h"

struct bd_commit;
struct bd_edit_place;
struct bd_steps;
struct bd_upkeep;

struct bd_commits {
    struct bd_loop *loop;
    struct bd_live *live; // is told of what was published
    struct bd_commit *commit;
    struct bd_steps *turns;            // at the journal, oldest first
    bool has_turn_begun;               // the first one's
    struct bd_upkeep *upkeep;          // under way; others wait behind it
    struct bd_edit_place *edit_places; // oldest first
    uint64_t edit_changes;             // of that list
    bool edits_wait;                   // further up somebody walks that list, or will at the end
    uv_timer_t idle_timer;
    struct bd_disk_watch disk;
};

void bd_commits_begin(struct bd_commits *commits, struct bd_loop *loop, struct bd_live *live);
void bd_commits_close(struct bd_commits *commits);  // before the loop's last turn
void bd_commits_finish(struct bd_commits *commits); // after it

// Nothing is staged, under way, or waits for its turn.
bool bd_commits_are_idle(const struct bd_commits *commits);

#endif
