// HTTP's way to commands, by the method and path in their rows (net/command/command.h).
//
// Thread: the event loop's.

#ifndef BD_NET_HTTP_HTTP_COMMANDS_H
#define BD_NET_HTTP_HTTP_COMMANDS_H

#include "net/http/http_internal.h"
#include "net/wire/answer.h"

// The first row whose path that is: others of it have other methods. `*id`: the scene's, where the
// path has one. NULL: none.
const struct bd_command_row *bd_http_command_find(const char *path, char *id, size_t id_bytes);
// Of the rows with the path of `first`, that of a method; NULL: none.
const struct bd_command_row *bd_http_command_by(const struct bd_command_row *first,
                                                enum bd_http_method method);

// The request's body, or query, as a command's envelope. An operation of an edit that the schema
// does not know is refused by its name, which protobuf's form cannot tell.
BD_MUST_CHECK
enum bd_err bd_http_command_read(const struct bd_http *http, const struct bd_command_row *row,
                                 struct bd_answer *out, struct bd_fault *fault);

#endif
