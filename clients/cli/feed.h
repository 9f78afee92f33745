// JSON documents from a file or a pipe, one after the other, as they come: none is waited for
// longer than its own last byte. Thread: main.

#ifndef BD_CLI_FEED_H
#define BD_CLI_FEED_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>

#include "base/err.h"
#include "clients/cli/conn.h"

struct bd_cli_feed {
    int fd;
    const char *name;         // of what is read, for people
    struct bd_cli_conn *conn; // kept while nothing comes
    bool has_ended;
    unsigned char bytes[16384];
    size_t used, taken;
    // What ended it; jansson's reader has no room for it.
    enum bd_err err;
    struct bd_err_detail detail;
};

// Skips space. Whether nothing is behind it: the end, or what went wrong.
BD_MUST_CHECK
enum bd_err bd_cli_feed_at_end(struct bd_cli_feed *feed, bool *out, struct bd_err_detail *detail);

// The next document, whatever kind of value it is; NULL and `error` if it is none. An error: of
// reading, of the connection, Ctrl-C.
BD_MUST_CHECK
enum bd_err bd_cli_feed_next(struct bd_cli_feed *feed, json_t **out, json_error_t *error,
                             struct bd_err_detail *detail);

#endif
