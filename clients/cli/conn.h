// A conversation with a daemon: requests out, their answers in, one at a time.
//
// Thread: main. Ctrl-C during a call sends `cancel` for it and waits a moment for its end.

#ifndef BD_CLI_CONN_H
#define BD_CLI_CONN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/err.h"
#include "clients/cli/options.h"
#include "protocol/framing.h"
#include "protocol/wire.h"

struct bd_cli_conn;

// Who is asked when no --server is given.
enum bd_cli_conn_kind {
    BD_CLI_CONN_RUNNING,          // the daemon at the default socket, or nobody
    BD_CLI_CONN_RUNNING_OR_START, // the same, else a private one
};

// Connects, or starts a private daemon, and sends `hello`; does not wait for its answer, so that
// a private daemon's start overlaps with what the caller does next. The first call waits.
BD_MUST_CHECK
enum bd_err bd_cli_conn_open(const struct bd_cli_common *common, enum bd_cli_conn_kind kind,
                             struct bd_cli_conn **out, struct bd_err_detail *detail);

// Closes, and sees a private daemon off. Takes NULL.
void bd_cli_conn_close(struct bd_cli_conn **conn);

struct bd_cli_answer {
    Bounced__Envelope *envelope;
    struct bd_message message; // its payload
};
void bd_cli_answer_finish(struct bd_cli_answer *answer);

// What happens while a call waits; any may be NULL.
struct bd_cli_conn_watch {
    void (*stage)(void *user, const char *stage); // a Progress event
    void (*tick)(void *user);                     // ten times a second
    void (*share)(void *user, double share);      // a Progress event that says how far, 0 to 1
    void *user;
};

// Sends `request` (its request_id is set here) with its payload, and waits for the answer, which
// must have the body `want`. An `error` answer becomes the returned error and `detail`, and stays
// in
// `*out` for its details: finish `*out` either way. `watch` may
// be NULL. BD_ERR_UNREACHABLE if the daemon goes away; if a private one ended with an exit code of
// its own (no such device, ...), the error that it stands for.
BD_MUST_CHECK
enum bd_err bd_cli_conn_call(struct bd_cli_conn *conn, Bounced__Envelope *request,
                             const void *payload, size_t payload_bytes,
                             Bounced__Envelope__BodyCase want,
                             const struct bd_cli_conn_watch *watch, struct bd_cli_answer *out,
                             struct bd_err_detail *detail);

// The next event of a request that has been answered (a watch), which must have the body `want`.
// Ctrl-C ends the wait at once, with BD_ERR_CANCELLED. Finish `*out` either way.
BD_MUST_CHECK
enum bd_err bd_cli_conn_event(struct bd_cli_conn *conn, uint64_t request_id,
                              Bounced__Envelope__BodyCase want, struct bd_cli_answer *out,
                              struct bd_err_detail *detail);

// Waits until `fd` can be read from, or has ended, for as long as that takes; the daemon does not
// hang up meanwhile, as it does on the silent (its limit idle_seconds). Ctrl-C: BD_ERR_CANCELLED.
BD_MUST_CHECK
enum bd_err bd_cli_conn_wait_for_input(struct bd_cli_conn *conn, int fd,
                                       struct bd_err_detail *detail);

#endif
