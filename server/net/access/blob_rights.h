// Whose blobs somebody finds, and whose those are that he sends: a line of the token file finds
// what was sent by that line, and all others' too if it sees every scene; whoever needs no token
// finds all and is nobody.
//
// Thread: any.

#ifndef BD_NET_ACCESS_BLOB_RIGHTS_H
#define BD_NET_ACCESS_BLOB_RIGHTS_H

#include "net/access/auth.h"
#include "scene/blobs/blobs.h"

struct bd_blobs *bd_grant_blobs(struct bd_blobs *all, const struct bd_grant *grant);

#endif
