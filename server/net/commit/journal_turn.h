// Turns at the journal: what touches the disk runs on libuv's pool, one after the other, in order.
//
// Thread: the event loop's; `on_pool` runs on the pool.

#ifndef BD_NET_COMMIT_JOURNAL_TURN_H
#define BD_NET_COMMIT_JOURNAL_TURN_H

#include <stdbool.h>
#include <uv.h>

struct bd_commits;

// Part of whoever takes the turn, who keeps it until `back`.
struct bd_journal_turn {
    struct bd_commits *commits;
    void (*on_pool)(struct bd_journal_turn *turn);
    void (*back)(struct bd_journal_turn *turn); // on the loop; may free it, or take it again
    uv_work_t work;
    struct bd_journal_turn *next;
};

// Queues it behind those that wait.
void bd_journal_turn_take(struct bd_commits *commits, struct bd_journal_turn *turn);

// Whether anything waits or runs.
bool bd_journal_turn_is_taken(const struct bd_commits *commits);

#endif
