#include "net/loop/peer.h"

#include <errno.h>
#include <stdlib.h>
#include <sys/socket.h>

#include "base/assert.h"

// The groups besides its own; a system without SO_PEERGROUPS tells of none.
static bool read_groups(int fd, struct bd_peer *peer)
{
    socklen_t bytes = 0;
    if (getsockopt(fd, SOL_SOCKET, SO_PEERGROUPS, NULL, &bytes) == 0 || errno != ERANGE)
        return true;
    gid_t *groups = realloc(peer->groups, sizeof *groups + bytes);
    BD_ASSERT(groups);
    peer->groups = groups;
    if (getsockopt(fd, SOL_SOCKET, SO_PEERGROUPS, groups + 1, &bytes) != 0) return false;
    peer->group_count = 1 + bytes / sizeof *groups;
    return true;
}

bool bd_peer_read(int fd, struct bd_peer *out)
{
    struct ucred credentials;
    socklen_t bytes = sizeof credentials;
    *out = (struct bd_peer){0};
    if (getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &credentials, &bytes) != 0) return false;
    if (credentials.uid == (uid_t)-1) return false; // nobody has connected
    out->groups = malloc(sizeof *out->groups);
    BD_ASSERT(out->groups);
    out->uid = credentials.uid;
    out->groups[0] = credentials.gid;
    out->group_count = 1;
    if (read_groups(fd, out)) return true;
    bd_peer_finish(out);
    return false;
}

void bd_peer_finish(struct bd_peer *peer)
{
    free(peer->groups);
    *peer = (struct bd_peer){0};
}

bool bd_peer_is_in(const struct bd_peer *peer, gid_t group)
{
    for (size_t i = 0; i < peer->group_count; i++)
        if (peer->groups[i] == group) return true;
    return false;
}
