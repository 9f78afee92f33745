// The loop's heartbeat: a timer every 5 ms while anybody is connected. How late it comes is how
// long the loop was deaf to everybody, for whatever reason: a long callback, or a machine that had
// no processor for it. /metrics tells of it (net/command/stats.c).
//
// What the loop itself did meanwhile, in processor time, tells the one from the other.
//
// Two hundred wakings a second cost about a thousandth of a core; an idle daemon has none.
//
// Thread: the event loop's.

#ifndef BD_NET_LOOP_HEARTBEAT_H
#define BD_NET_LOOP_HEARTBEAT_H

#include <stdbool.h>
#include <stdint.h>
#include <uv.h>

#include "base/stalls.h"

#define BD_HEARTBEAT_MS 5

struct bd_heartbeat {
    uv_timer_t timer;
    uint64_t due_ns, worked_ns;
    struct bd_stalls stalls; // how late each beat came
    struct bd_stalls work;   // the loop's processor time from each beat to the next
};

void bd_heartbeat_init(struct bd_heartbeat *heart, uv_loop_t *loop);
// While there is somebody who could notice.
void bd_heartbeat_set(struct bd_heartbeat *heart, bool beats);
void bd_heartbeat_close(struct bd_heartbeat *heart);

#endif
