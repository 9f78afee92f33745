// What the HTTP face has from below.
//
// Owned by net.c. Thread: the event loop's.

#ifndef BD_NET_WEB_H
#define BD_NET_WEB_H

#include "net/sessions.h"

struct bd_web {
    struct bd_sessions *sessions;
    const char *const *public_names; // Host names beside our addresses, up to a NULL
};

#endif
