// Commands under way, and what they keep between them: imports and frames that may be asked for
// again.
//
// Owned by net.c. Thread: the event loop's.

#ifndef BD_NET_COMMANDS_H
#define BD_NET_COMMANDS_H

#include "net/commits.h"

struct bd_command;
struct bd_frame_cache;
struct bd_import_cache;
struct bd_import_pool;

struct bd_commands {
    struct bd_loop *loop;
    struct bd_live *live;
    struct bd_commits *commits;
    struct bd_command *list; // under way, newest first
    uint32_t count;
    struct bd_import_cache *import_cache;
    struct bd_frame_cache *frame_cache;
    struct bd_import_pool *import_pool;
};

#endif
