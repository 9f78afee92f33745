#include "net/access/blob_rights.h"

struct bd_blobs *bd_grant_blobs(struct bd_blobs *all, const struct bd_grant *grant)
{
    const bool is_anyone = grant == &bd_grant_of_all;
    return bd_blobs_of(all, is_anyone ? "" : grant->name, grant->scene_prefix[0] == 0);
}
