#include "net/blob_rights.h"

struct bd_blobs *bd_grant_blobs(const struct bd_net_options *options, const struct bd_grant *grant)
{
    const bool is_anyone = grant == &bd_grant_of_all;
    return bd_blobs_of(options->blobs, is_anyone ? "" : grant->name, grant->scene_prefix[0] == 0);
}
