// Operations of a batch from the wire's form to scene/edit/edit.h's. What is light is decoded here;
// what is heavy (vertex data, pictures, files) is filled in by edit_heavy.h.
//
// Thread: any.

#ifndef BD_NET_WIRE_EDIT_DECODE_H
#define BD_NET_WIRE_EDIT_DECODE_H

#include <stdbool.h>

#include "base/err.h"
#include "protocol/bounced.pb-c.h"
#include "scene/edit/edit.h"

// The path of an operation: "ops[3].set_light".
struct bd_edit_path {
    char text[96];
};
struct bd_edit_path bd_edit_path(size_t index, const Bounced__EditOp *op);

// Texts and numbers are borrowed from `op`; what `out` has of its own goes with
// bd_edit_heavy_release, whatever this says. BD_ERR_USAGE, naming the field: a transform's list of
// the wrong length, an operation without its object; BD_ERR_UNSUPPORTED: an operation that this
// server does not know.
BD_MUST_CHECK
enum bd_err bd_edit_decode(size_t index, const Bounced__EditOp *op, struct bd_edit_op *out,
                           struct bd_err_detail *detail);

// What has to be read or made off the event loop, and how long that may take.
enum bd_edit_weight {
    BD_EDIT_LIGHT,   // nothing
    BD_EDIT_STREAM,  // numbers that came with the request
    BD_EDIT_CONTENT, // pictures, maps, streams: blobs of any size
    BD_EDIT_FILES,   // an import
};
enum bd_edit_weight bd_edit_weight(const Bounced__EditOp *op);
// Of its heaviest operation.
enum bd_edit_weight bd_edit_batch_weight(const Bounced__EditBatch *batch);

#endif
