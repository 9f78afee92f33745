// What lies transient becomes durable by itself, once nobody has added to it for a second.
//
// Thread: the event loop's.

#ifndef BD_NET_COMMIT_IDLE_COMMIT_H
#define BD_NET_COMMIT_IDLE_COMMIT_H

#include <stdbool.h>

struct bd_commits;

// Something was laid transient: to be looked at once it is quiet.
void bd_idle_commit_watch(struct bd_commits *commits);

// Commits what has been quiet for long enough, or `all`.
void bd_idle_commit_run(struct bd_commits *commits, bool all);

#endif
