// What lies transient becomes durable by itself, once nobody has added to it for a second.

#include "base/clock.h"
#include "net/commit.h"
#include "net/edit_step.h"
#include "net/edit_work.h"

#define QUIET_NS 1000000000ull

static void on_quiet(uv_timer_t *timer)
{
    bd_edit_commit_quiet(timer->data, false);
}

void bd_edit_watch_quiet(struct bd_net *net)
{
    net->quiet_timer.data = net;
    uv_timer_start(&net->quiet_timer, on_quiet, QUIET_NS / 1000000, 0);
}

void bd_edit_commit_quiet(struct bd_net *net, bool all)
{
    struct bd_store *store = net->options.store;
    bool ask_again = false;
    for (uint32_t i = 0; i < bd_store_count(store); i++) {
        const struct bd_store_entry *entry = bd_store_at(store, i);
        struct bd_batch *batch = NULL;
        struct bd_fault fault;
        if (entry->transient == 0) continue;
        bool is_quiet = bd_clock_ns() - entry->transient_ns >= QUIET_NS * 9 / 10;
        enum bd_err err = BD_ERR_OK;
        if (all || is_quiet) err = bd_store_stage_commit(store, entry->id, NULL, &batch, &fault);
        if (batch) bd_commit_soon(net);
        ask_again |= !is_quiet || err == BD_ERR_BUSY;
    }
    if (ask_again && !all) bd_edit_watch_quiet(net);
}
