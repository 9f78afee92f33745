// A connected descriptor to a daemon: by address, on the default socket, or to a private one.
//
// Thread: main.

#ifndef BD_CLI_TRANSPORT_H
#define BD_CLI_TRANSPORT_H

#include <stdbool.h>
#include <stddef.h>
#include <sys/types.h>

#include "base/err.h"

// Connects to "unix:PATH" or "tcp:HOST:PORT" ("tcp:[::1]:7481" for IPv6). BD_ERR_USAGE for other
// addresses, BD_ERR_UNREACHABLE if nobody answers.
BD_MUST_CHECK
enum bd_err bd_transport_connect(const char *server, int *fd, struct bd_err_detail *detail);

// $XDG_RUNTIME_DIR/bounced.sock, where a daemon without --listen waits. False if there is
// no such folder variable, or the path does not fit a socket address.
bool bd_transport_default_path(char *path, size_t size);

// Connects to the default socket. False if nobody is there.
bool bd_transport_connect_default(int *fd);

#define BD_TRANSPORT_PATH_BYTES 4096

// The daemon's executable: $BOUNCED, or beside ours, or where a build tree has it, or on PATH.
// BD_ERR_UNREACHABLE names what was tried.
BD_MUST_CHECK
enum bd_err bd_transport_find_daemon(char path[BD_TRANSPORT_PATH_BYTES],
                                     struct bd_err_detail *detail);

struct bd_private_options {
    const char *device; // NULL: the daemon's default
    bool quick_code;    // it renders little: bounced --code quick
    bool quiet;
};

// Starts `bounced --private 3` with one end of a socket pair as its descriptor 3, in a process
// group of its own, so that the terminal's Ctrl-C reaches only us.
BD_MUST_CHECK
enum bd_err bd_transport_start_private(const struct bd_private_options *options, int *fd,
                                       pid_t *child, struct bd_err_detail *detail);

// Waits for the private daemon's end, once its descriptor is closed: `patience_ms` for it to go by
// itself, then SIGTERM, 2 s later SIGKILL. Returns waitpid's status.
int bd_transport_reap(pid_t child, int patience_ms);

#endif
