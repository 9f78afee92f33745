// The heavy part of a batch: vertex data, pictures, maps and files, decoded, checked and sealed
// before the batch itself is looked at.
//
// Thread: libuv's pool, or one of background.h's for what is a blob.

#ifndef BD_NET_COMMAND_EDIT_HEAVY_H
#define BD_NET_COMMAND_EDIT_HEAVY_H

#include "base/err.h"
#include "net/command/edit_budget.h"
#include "protocol/bounced.pb-c.h"
#include "protocol/limits.h"
#include "scene/blobs/blobs.h"
#include "scene/edit/edit.h"

struct bd_import_pool;

struct bd_edit_heavy_inputs {
    struct bd_blobs *blobs;
    const struct bd_limits *limits;
    struct bd_edit_budget *budget; // of the batch; each operation takes from it
    struct bd_import_pool *import_pool;
    const struct bd_scene *base; // what the batch is for: meshes to be deformed are taken from it
    const uint8_t *payload;      // of the message
    size_t payload_bytes;
};

// Flags of what was repaired.
#define BD_EDIT_FLAG_MAX   16
#define BD_EDIT_FLAG_BYTES 96
struct bd_edit_flags {
    uint32_t count;
    char text[BD_EDIT_FLAG_MAX][BD_EDIT_FLAG_BYTES];
};

// Fills what is heavy of operation `index` in `ops`, those before it being done. References in
// `ops` are to be released with bd_edit_heavy_release, whatever this says.
BD_MUST_CHECK
enum bd_err bd_edit_heavy_read(const struct bd_edit_heavy_inputs *inputs, size_t index,
                               const Bounced__EditOp *op, struct bd_edit_op *ops,
                               struct bd_edit_flags *flags, struct bd_err_detail *detail);
void bd_edit_heavy_release(struct bd_edit_op *op);

#endif
