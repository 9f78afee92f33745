// Sessions of all faces that speak in envelopes, and what they have from below.
//
// Owned by net.c. Thread: the event loop's.

#ifndef BD_NET_SESSIONS_H
#define BD_NET_SESSIONS_H

#include "net/access.h"
#include "net/commands.h"

struct bd_session;

struct bd_sessions {
    struct bd_loop *loop;
    struct bd_access *access;
    struct bd_commands *commands;
    struct bd_session *list; // those that have ended too, until they are swept
    uint64_t kept_bytes;     // of answers, for sessions that may be resumed
};

#endif
