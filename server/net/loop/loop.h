// The event loop, and what everybody of net/ has of it: connections, those who ask, work beside it,
// its heartbeat, and what it counts.
//
// Owned by net.c, which opens the rooms above it. Thread: the event loop's, for everything that
// takes it.

#ifndef BD_NET_LOOP_LOOP_H
#define BD_NET_LOOP_LOOP_H

#include <uv.h>

#include "net/loop/background.h"
#include "net/loop/counts.h"
#include "net/loop/heartbeat.h"
#include "net/loop/serving.h"

struct bd_clients;
struct bd_conn;

struct bd_loop {
    uv_loop_t uv;
    const struct bd_serving *serving;
    struct bd_clients *clients;
    struct bd_conn *conns; // newest first
    uint32_t conn_count;
    bool draining; // takes no new work
    struct bd_counts counts;
    struct bd_background_state background;
    struct bd_heartbeat heart;
    void (*conn_left)(struct bd_loop *loop); // NULL: nobody asks
};

#endif
