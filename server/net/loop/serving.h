// What is served, and by which rules: what main opens and everybody of net/ borrows.
//
// Thread: made before the loop runs. On the loop a reload (net/reload.h) writes limits and proxies;
// who reads a limit beside the loop reads one number, the old or the new.

#ifndef BD_NET_LOOP_SERVING_H
#define BD_NET_LOOP_SERVING_H

#include "net/loop/proxy.h"
#include "protocol/limits.h"
#include "scene/blobs/blobs.h"
#include "scene/journal/journal.h"
#include "scene/store/store.h"
#include "sched/sched.h"

struct bd_serving {
    struct bd_limits limits;
    struct bd_proxy_range proxies[BD_PROXY_RANGE_MAX]; // whose connections begin with a header
    uint32_t proxy_count;
    // Borrowed for as long as the net lives.
    struct bd_sched *sched;
    struct bd_blobs *blobs;
    struct bd_store *store;
    struct bd_journal *journal;
    // One JSON array of devices, malloc'ed; runs on libuv's pool. NULL: only the one in use.
    char *(*list_devices)(void);
};

#endif
