// Turns at libuv's pool for what blocks a thread of it long: imports and exports. Never all of its
// four, so that encoding, uploads and the journal go on.
//
// Thread: the event loop's.

#ifndef BD_NET_POOL_TURN_H
#define BD_NET_POOL_TURN_H

#include <stdbool.h>
#include <uv.h>

struct bd_command;
struct bd_net;

// Queues the command behind those that wait. When its turn comes, the stage begins: `on_pool` runs
// on the pool, then `then` on the loop, unless the command was cancelled or failed: it has ended
// then.
void bd_pool_turn_take(struct bd_command *command, const char *stage,
                       void (*on_pool)(struct bd_command *command),
                       void (*then)(struct bd_command *command));

// Takes it out of the queue if it waits there; false if it does not.
bool bd_pool_turn_leave(struct bd_command *command);

#endif
