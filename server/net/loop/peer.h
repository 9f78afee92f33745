// Who is at the other end of a Unix socket, as the system tells it: what the peer was when it
// connected, whatever it says of itself.
//
// Thread: any.

#ifndef BD_NET_LOOP_PEER_H
#define BD_NET_LOOP_PEER_H

#include <stdbool.h>
#include <stddef.h>
#include <sys/types.h>

struct bd_peer {
    uid_t uid;
    gid_t *groups; // the first is its own group, then those that it belongs to besides
    size_t group_count;
};

// False if `fd` is no connected Unix socket. A peer of another user namespace without a user here
// is the system's overflow user, 65534. Free with bd_peer_finish if true.
bool bd_peer_read(int fd, struct bd_peer *out);
void bd_peer_finish(struct bd_peer *peer);

bool bd_peer_is_in(const struct bd_peer *peer, gid_t group);

#endif
