// The net: its rooms, in the order in which they are opened. Only net.c, listen.c and reload.c
// include this.

#ifndef BD_NET_INTERNAL_H
#define BD_NET_INTERNAL_H

#include "net/http/http.h"
#include "net/net.h"
#include "net/options.h"

struct bd_listener;

struct bd_net {
    struct bd_net_options options;
    struct bd_loop loop;
    struct bd_access access;
    struct bd_live live;
    struct bd_commits commits;
    struct bd_commands commands;
    struct bd_sessions sessions;
    struct bd_web web;
    struct bd_listener *listeners;

    uv_timer_t tick;
    uv_signal_t sigterm, sigint, sighup;
    struct bd_options reloaded; // that `options` points into since the last SIGHUP
    bool has_committed_rest;
    uint64_t drain_until_ns;
};

// Stops listening; what is under way may end.
void bd_net_begin_drain(struct bd_net *net);

#endif
