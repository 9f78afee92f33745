// The journal's upkeep while serving: now and then a snapshot, so that start-ups and going back
// stay short; then what lies too far behind is forgotten, in steps between which commits get their
// turn.
//
// Thread: the event loop's.

#ifndef BD_NET_COMMIT_UPKEEP_H
#define BD_NET_COMMIT_UPKEEP_H

#include "scene/store/store.h"

struct bd_commits;

// A batch has been published: begins what is due after it, or has it wait for those under way.
void bd_upkeep_after(struct bd_commits *commits, const struct bd_batch *batch);

#endif
