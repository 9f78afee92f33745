// HTTP's way to edits: POST /v1/scenes/ID/{edits,undo,revert,commit,names}, GET .../log.
//
// Thread: the event loop's.

#ifndef BD_NET_HTTP_EDITS_H
#define BD_NET_HTTP_EDITS_H

#include "net/answer.h"
#include "net/http_internal.h"

enum bd_http_edit {
    BD_HTTP_EDIT_EDITS,
    BD_HTTP_EDIT_UNDO,
    BD_HTTP_EDIT_REVERT,
    BD_HTTP_EDIT_COMMIT,
    BD_HTTP_EDIT_NAMES,
    BD_HTTP_EDIT_LOG,
    BD_HTTP_EDIT_EXPORT,
    BD_HTTP_EDIT_COUNT
};

// BD_HTTP_EDIT_COUNT: `word` is none of them.
enum bd_http_edit bd_http_edit_find(const char *word);
bool bd_http_edit_is_get(enum bd_http_edit edit);

// The request's body, or query, as a command's envelope. An operation that the schema does not know
// is refused by its name, which protobuf's form cannot tell.
BD_MUST_CHECK
enum bd_err bd_http_edit_read(const struct bd_http *http, struct bd_answer *out,
                              struct bd_fault *fault);

// `objects=1` of GET /v1/scenes/ID.
BD_MUST_CHECK
enum bd_err bd_http_scene_query(const char *query, bool *objects, struct bd_fault *fault);

#endif
