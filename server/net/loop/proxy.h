// Proxies that are named (--proxy): their connections begin with a PROXY header of version 2
// (haproxy.org/download/2.6/doc/proxy-protocol.txt), which says for whom they ask. haproxy says so
// at a connection's beginning only, and uses a connection for requests of others of its clients
// unless it sends this header: with send-proxy-v2 each client has one of its own.
//
// Nobody else's does: to whoever is not named, those bytes are a request that makes no sense.
//
// Thread: any, one at a time for each object.

#ifndef BD_NET_LOOP_PROXY_H
#define BD_NET_LOOP_PROXY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/socket.h>

#include "base/err.h"

#define BD_PROXY_RANGE_MAX 16

// Addresses, or a Unix socket of ours of which nobody else has the path.
struct bd_proxy_range {
    bool is_unix;
    char path[108];
    uint8_t address[16]; // of IPv4 as IPv6 maps it
    unsigned bits;       // of the address that count
};

// "ADDRESS", "ADDRESS/BITS" or "unix:PATH".
BD_MUST_CHECK
enum bd_err bd_proxy_parse(const char *text, struct bd_proxy_range *out,
                           struct bd_err_detail *detail);

bool bd_proxy_has_address(const struct bd_proxy_range *ranges, size_t count,
                          const struct sockaddr_storage *address);
bool bd_proxy_has_path(const struct bd_proxy_range *ranges, size_t count, const char *path);

#define BD_PROXY_FIRST_BYTES   16 // signature, command, family, length
#define BD_PROXY_ADDRESS_BYTES 36 // of two IPv6 addresses and ports: the longest that is looked at
#define BD_PROXY_BYTES_MAX     4096 // behind the first: what a proxy adds is skipped, up to here

// A header on its way in. Zeroed at first.
struct bd_proxy_header {
    uint8_t bytes[BD_PROXY_FIRST_BYTES + BD_PROXY_ADDRESS_BYTES];
    size_t used; // bytes that came, those included that are skipped
    bool is_complete;
    bool has_source; // otherwise the proxy asks for itself (LOCAL), or does not say for whom
    struct sockaddr_storage source;
};

// Takes bytes up to the header's end. BD_ERR_BAD_INPUT as soon as it can be no such header.
BD_MUST_CHECK
enum bd_err bd_proxy_feed(struct bd_proxy_header *header, const uint8_t *bytes, size_t size,
                          size_t *taken, struct bd_err_detail *detail);

#endif
