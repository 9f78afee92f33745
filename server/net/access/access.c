// The grant of a user at the other end of a Unix socket.

#include "net/access/access.h"

#include <unistd.h>

#include "net/access/auth.h"
#include "net/loop/conn.h"
#include "net/loop/peer.h"

const struct bd_grant *bd_access_of_user(const struct bd_access *access, const struct bd_conn *conn)
{
    struct bd_peer peer;
    if (!bd_conn_peer(conn, &peer)) return NULL;
    const struct bd_grant *grant = bd_tokens_find_peer(access->tokens, &peer, geteuid());
    bd_peer_finish(&peer);
    return grant;
}
