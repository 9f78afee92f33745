// Addresses to listen on, and names that a browser may call us by.
//
// Thread: any.

#ifndef BD_NET_LOOP_ADDRESS_H
#define BD_NET_LOOP_ADDRESS_H

#include <netinet/in.h>
#include <stdbool.h>
#include <sys/socket.h>

#include "base/err.h"

struct bd_address {
    bool is_unix;
    char path[108];               // of a Unix socket
    struct sockaddr_storage inet; // otherwise
};

// "unix:PATH" or "tcp:HOST:PORT"; without a scheme, HOST:PORT. HOST is a numeric address, in
// brackets for IPv6, or "localhost". Names are not looked up: what is listened on is what is said.
BD_MUST_CHECK
enum bd_err bd_address_parse(const char *text, struct bd_address *out,
                             struct bd_err_detail *detail);

// A Unix socket, 127.0.0.0/8, ::1: only this machine can reach it.
bool bd_address_is_local(const struct bd_address *address);

// "127.0.0.1:7480", "[::1]:7480", "unix:/run/x"; `size` of 128 holds all.
void bd_address_text(const struct bd_address *address, char *out, size_t size);

// The numeric host of a socket address without its port. `size` of 64 holds all.
void bd_sockaddr_host(const struct sockaddr_storage *address, char *out, size_t size);

// What a stranger of that address is known by: who has one IPv6 address has the 2^64 of its net, so
// that those are one ("2001:db8:1:2::/64"). IPv4 in IPv6 is IPv4. `size` of 64 holds all.
void bd_sockaddr_stranger(const struct sockaddr_storage *address, char *out, size_t size);

#endif
