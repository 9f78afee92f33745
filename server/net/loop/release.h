// The last reference to a large scene, given up on the pool: giving a hundred megabytes back to the
// system takes some ten milliseconds, in which nobody would be heard.
//
// Thread: the event loop's.

#ifndef BD_NET_LOOP_RELEASE_H
#define BD_NET_LOOP_RELEASE_H

struct bd_loop;
struct bd_scene;

// Nulls; takes NULL.
void bd_release_scene(struct bd_loop *loop, struct bd_scene **scene);

#endif
