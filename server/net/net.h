// The network: listeners, connections, and one layer of commands behind all transports.
//
// Owns the libuv loop's work. A socket's callback decodes, checks limits, starts a command and
// returns; disk and encoding run on libuv's pool, imports and exports on threads of low priority,
// frames on the scheduler's thread, and all of them come back to the loop with their result.
//
// Thread: the one that calls bd_net_run, for everything here.

#ifndef BD_NET_NET_H
#define BD_NET_NET_H

#include <stdbool.h>
#include <stdint.h>
#include <sys/types.h>

#include "base/err.h"
#include "net/loop/serving.h"

#define BD_NET_LISTEN_MAX      8
#define BD_NET_PUBLIC_NAME_MAX 16
#define BD_NET_CONFIG_MAX      8
#define BD_NET_SOCKET_MODE     0600 // without a word about it

struct bd_net_options {
    const char *http;                       // HOST:PORT; NULL = no HTTP transport
    const char *listens[BD_NET_LISTEN_MAX]; // framed: "unix:PATH", "tcp:HOST:PORT"; up to a NULL
    int private_fd;                         // serve this one connection and nothing else; -1 = no
    const char *token_file;                 // NULL = none
    mode_t socket_mode;                     // of the files of Unix sockets
    bool has_socket_group;                  // they belong to socket_group, not to our own
    gid_t socket_group;
    const char *public_names[BD_NET_PUBLIC_NAME_MAX]; // Host names beside our addresses
    struct bd_serving serving;
    const char *import_program; // for bd_import; NULL = this one
    // What main was given, to be read again at SIGHUP; NULL: SIGHUP changes nothing.
    int argc;
    char **argv;
    struct {
        const char *data, *device;
        uint32_t gpu_memory_mib;
        bool log_json;
        int sandbox; // enum bd_sandbox
        bool quick_code;
    } fixed; // what others were given, for a word about what a reload cannot change
};

struct bd_net;

// Opens the listeners. Refused: an address beyond this machine without tokens. The options are
// copied, what they point at is borrowed.
BD_MUST_CHECK
enum bd_err bd_net_create(const struct bd_net_options *options, struct bd_net **out,
                          struct bd_err_detail *detail);

// Serves until SIGTERM or SIGINT; reads options and tokens again at SIGHUP (net/reload.h). Then
// drains: takes no new work, ends or (after drain_seconds, or at a second signal) cancels what is
// under way, and a second later closes what connections are left, whatever they still have to send.
// With private_fd: until the peer closes. Every command has ended when it returns.
void bd_net_run(struct bd_net *net);

void bd_net_destroy(struct bd_net **net);

#endif
