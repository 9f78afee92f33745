// What is asked for: method and path to a route, query to a frame, a command's path (a column of
// its row, net/command/command.h) and body to its envelope.
//
// Thread: any.

#ifndef BD_NET_HTTP_HTTP_ROUTE_H
#define BD_NET_HTTP_HTTP_ROUTE_H

#include <stdbool.h>

#include "base/err.h"
#include "base/hash.h"
#include "net/http/http_guard.h"
#include "net/wire/answer.h"
#include "protocol/bounced.pb-c.h"

enum bd_http_route {
    BD_HTTP_ROUTE_NONE,
    BD_HTTP_ROUTE_HEALTH,
    BD_HTTP_ROUTE_READY,
    BD_HTTP_ROUTE_METRICS,
    BD_HTTP_ROUTE_BLOB,
    BD_HTTP_ROUTE_COMMAND, // by its row
    BD_HTTP_ROUTE_FRAME,
    BD_HTTP_ROUTE_RENDER,
    BD_HTTP_ROUTE_SESSION,
    BD_HTTP_ROUTE_SOCKET,
    BD_HTTP_ROUTE_MJPEG,
    BD_HTTP_ROUTE_EVENTS, // of a scene; of all, where the id is empty
    BD_HTTP_ROUTE_VIEWER,
};

enum bd_http_method { BD_HTTP_GET, BD_HTTP_HEAD, BD_HTTP_POST, BD_HTTP_PUT, BD_HTTP_DELETE };

struct bd_command_row;
struct bd_http;
struct bd_viewer_file;

struct bd_http_target {
    enum bd_http_route route;
    char id[72];                       // of a scene, or a blob's hexadecimal name
    char extension[8];                 // of a frame
    const struct bd_command_row *command; // the first with that path
    const struct bd_viewer_file *file; // of the viewer
    const char *query;                 // in the url, behind '?'; "" if there is none
};

// The route alone, before any check: health is asked for without a token.
void bd_http_route_find(const char *url, struct bd_http_target *out);

// Path unknown: 404. Method not offered there, or unknown (`method` < 0): 405. A query where none
// is read: 400, with the name that it begins with.
BD_MUST_CHECK
enum bd_err bd_http_route_check(const struct bd_http_target *target, int method,
                                struct bd_http_refusal *refusal);

// Percent-decodes a part of a query in place. False for a broken escape, and for a zero byte, at
// which a string would end early.
BD_MUST_CHECK
bool bd_http_query_decode(char *text);

// The query of a frame or a one-shot render into a new message without a scene, to be freed by
// free_unpacked with NULL. `extension` "" : from `encoding=`. Unknown names and bad numbers are
// refused by name.
BD_MUST_CHECK
enum bd_err bd_http_query_read(const char *query, const char *extension, Bounced__Render **out,
                               struct bd_err_detail *detail);

// The same for a stream of pictures: without `encoding`, and with fps=NUMBER (0: as many as go).
BD_MUST_CHECK
enum bd_err bd_http_query_read_stream(const char *query, Bounced__Render **out,
                                      double *frames_per_second, struct bd_err_detail *detail);

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
                                 struct bd_answer *out, struct bd_err_detail *detail);

#endif
