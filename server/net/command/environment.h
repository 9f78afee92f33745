// The schema's Environment as the scene's: numbers checked, a map's blob decoded.
//
// Thread: any but the event loop's, since a map takes its time.

#ifndef BD_NET_COMMAND_ENVIRONMENT_H
#define BD_NET_COMMAND_ENVIRONMENT_H

#include "base/err.h"
#include "protocol/bounced.pb-c.h"
#include "protocol/limits.h"
#include "scene/blobs/blobs.h"
#include "scene/model/scene.h"

struct bd_import_pool;

struct bd_net_environment {
    struct bd_environment environment; // with a reference to its map
    double rotation[4];                // as it was given; all 0: none
    bool turns_alone;                  // neither numbers nor a map
    uint64_t negative_count;           // texels of the map that were raised to 0
};

// Without numbers a map counts as it is; it is decoded by a child of `pool`, within the limits of
// imports. BD_ERR_USAGE names the field. Finish `out` either way.
BD_MUST_CHECK
enum bd_err bd_net_environment_read(const Bounced__Environment *message, struct bd_blobs *blobs,
                                    struct bd_import_pool *pool, const struct bd_limits *limits,
                                    struct bd_net_environment *out, struct bd_err_detail *detail);
void bd_net_environment_finish(struct bd_net_environment *environment);

#endif
