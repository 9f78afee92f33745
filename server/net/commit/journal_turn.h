// Turns at the journal: what touches the disk runs on libuv's pool, one after the other, in order.
//
// Thread: the event loop's; a step's function runs on the pool.

#ifndef BD_NET_COMMIT_JOURNAL_TURN_H
#define BD_NET_COMMIT_JOURNAL_TURN_H

#include <stdbool.h>

#include "net/loop/steps.h"

struct bd_commits;

// Queues behind those that wait; of steps.commits.
extern const struct bd_step_executor bd_on_journal;

// Whether anything waits or runs.
bool bd_journal_turn_is_taken(const struct bd_commits *commits);

#endif
