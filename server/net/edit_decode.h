// Operations of a batch from the wire's form to scene/edit.h's. What is light is decoded here;
// what is heavy (vertex data, pictures, files) is filled in by edit_heavy.h.
//
// Thread: any.

#ifndef BD_NET_EDIT_DECODE_H
#define BD_NET_EDIT_DECODE_H

#include <stdbool.h>

#include "base/err.h"
#include "protocol/bounced.pb-c.h"
#include "scene/edit.h"

// The path of an operation: "ops[3].set_light".
struct bd_edit_path {
    char text[96];
};
struct bd_edit_path bd_edit_path(size_t index, const Bounced__EditOp *op);

// Texts are borrowed from `op`. BD_ERR_USAGE, naming the field: a word that is none of its choices,
// a list of the wrong length, an operation without its object; BD_ERR_UNSUPPORTED: an operation
// that this server does not know.
BD_MUST_CHECK
enum bd_err bd_edit_decode(size_t index, const Bounced__EditOp *op, struct bd_edit_op *out,
                           struct bd_fault *fault);

// Whether something of it has to be read or made off the event loop.
bool bd_edit_is_heavy(const Bounced__EditOp *op);

#endif
