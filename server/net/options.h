// The daemon's options, from the command line and from --config files: the same keys in both.
//
// Thread: start of the process.

#ifndef BD_NET_OPTIONS_H
#define BD_NET_OPTIONS_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <sys/types.h>

#include "base/err.h"
#include "confine/confine.h"
#include "net/net.h"

struct bd_options {
    const char *http; // "none" = no HTTP transport
    const char *listens[BD_NET_LISTEN_MAX];
    uint32_t listen_count;
    const char *data; // NULL = the default
    const char *device;
    bool quick_code; // bd_gpu_options
    const char *token_file;
    const char *configs[BD_NET_CONFIG_MAX]; // files that were read
    uint32_t config_count;
    mode_t socket_mode; // of the files of Unix sockets
    bool has_socket_group;
    gid_t socket_group;
    const char *public_names[BD_NET_PUBLIC_NAME_MAX];
    uint32_t public_name_count;
    struct bd_proxy_range proxies[BD_PROXY_RANGE_MAX];
    uint32_t proxy_count;
    enum bd_sandbox sandbox;
    uint32_t gpu_memory_mib; // 0 = by the device
    struct bd_limits limits;
    bool log_json, log_debug, log_errors; // the last: errors alone
    int private_fd;                       // -1 = none
    bool accepts_journal; // whatever is there: bd_journal_open_as_it_is
    bool shows_version, shows_help, lists_devices;
    int argc; // what was read, borrowed
    char **argv;
    char **owned; // every text above
    uint32_t owned_count;
};

// Reads what main was given. `detail` names the option. Free with bd_options_finish either way.
BD_MUST_CHECK
enum bd_err bd_options_read(struct bd_options *options, int argc, char **argv,
                            struct bd_err_detail *detail);
void bd_options_finish(struct bd_options *options);

void bd_options_print_help(FILE *out);

#endif
