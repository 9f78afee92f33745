#include "net/loop/address.h"

#include <arpa/inet.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static enum bd_err bad_address(const char *text, struct bd_err_detail *detail)
{
    return bd_err_set(detail, BD_ERR_USAGE, "listen",
                      "\"%s\" is no address: unix:PATH, tcp:HOST:PORT with a numeric host "
                      "(IPv6 in brackets) or localhost",
                      text);
}

static enum bd_err parse_unix(const char *path, const char *text, struct bd_address *out,
                              struct bd_err_detail *detail)
{
    if (*path == 0) return bad_address(text, detail);
    out->is_unix = true;
    if ((size_t)snprintf(out->path, sizeof out->path, "%s", path) >= sizeof out->path)
        return bd_err_set(detail, BD_ERR_USAGE, "listen",
                          "the path of a Unix socket has at most %zu bytes", sizeof out->path - 1);
    return BD_ERR_OK;
}

static bool parse_port(const char *text, in_port_t *out)
{
    char *end;
    unsigned long port = strtoul(text, &end, 10);
    if (*text < '0' || *text > '9' || *end || port > 65535) return false;
    *out = htons((uint16_t)port);
    return true;
}

static bool parse_host(const char *host, in_port_t port, struct bd_address *out)
{
    struct sockaddr_in *v4 = (struct sockaddr_in *)&out->inet;
    struct sockaddr_in6 *v6 = (struct sockaddr_in6 *)&out->inet;
    if (host[0] == '[') {
        v6->sin6_family = AF_INET6;
        v6->sin6_port = port;
        return inet_pton(AF_INET6, host + 1, &v6->sin6_addr) == 1;
    }
    v4->sin_family = AF_INET;
    v4->sin_port = port;
    return inet_pton(AF_INET, strcmp(host, "localhost") == 0 ? "127.0.0.1" : host, &v4->sin_addr) ==
           1;
}

enum bd_err bd_address_parse(const char *text, struct bd_address *out, struct bd_err_detail *detail)
{
    *out = (struct bd_address){0};
    if (strncmp(text, "unix:", 5) == 0) return parse_unix(text + 5, text, out, detail);
    const char *host = strncmp(text, "tcp:", 4) == 0 ? text + 4 : text;
    const char *colon = strrchr(host, ':');
    char copy[64];
    in_port_t port;
    if (!colon || (size_t)(colon - host) >= sizeof copy || !parse_port(colon + 1, &port))
        return bad_address(text, detail);
    size_t length = (size_t)(colon - host);
    memcpy(copy, host, length);
    copy[length] = 0;
    if (copy[0] == '[') {
        if (length < 2 || copy[length - 1] != ']') return bad_address(text, detail);
        copy[length - 1] = 0;
    }
    return parse_host(copy, port, out) ? BD_ERR_OK : bad_address(text, detail);
}

bool bd_address_is_local(const struct bd_address *address)
{
    if (address->is_unix) return true;
    if (address->inet.ss_family == AF_INET6)
        return IN6_IS_ADDR_LOOPBACK(&((const struct sockaddr_in6 *)&address->inet)->sin6_addr);
    const struct sockaddr_in *v4 = (const struct sockaddr_in *)&address->inet;
    return ntohl(v4->sin_addr.s_addr) >> 24 == 127;
}

void bd_sockaddr_host(const struct sockaddr_storage *address, char *out, size_t size)
{
    const void *bytes = address->ss_family == AF_INET6
                            ? (const void *)&((const struct sockaddr_in6 *)address)->sin6_addr
                            : (const void *)&((const struct sockaddr_in *)address)->sin_addr;
    if (!inet_ntop(address->ss_family, bytes, out, (socklen_t)size)) snprintf(out, size, "?");
}

void bd_sockaddr_stranger(const struct sockaddr_storage *address, char *out, size_t size)
{
    const struct in6_addr *v6 = &((const struct sockaddr_in6 *)address)->sin6_addr;
    if (address->ss_family != AF_INET6 || IN6_IS_ADDR_LOOPBACK(v6)) {
        bd_sockaddr_host(address, out, size);
    } else if (IN6_IS_ADDR_V4MAPPED(v6)) {
        if (!inet_ntop(AF_INET, v6->s6_addr + 12, out, (socklen_t)size)) snprintf(out, size, "?");
    } else {
        struct sockaddr_in6 net = {.sin6_family = AF_INET6};
        struct sockaddr_storage whole = {0};
        memcpy(net.sin6_addr.s6_addr, v6->s6_addr, 8);
        memcpy(&whole, &net, sizeof net);
        bd_sockaddr_host(&whole, out, size);
        const size_t used = strlen(out);
        snprintf(out + used, size - used, "/64");
    }
}

void bd_address_text(const struct bd_address *address, char *out, size_t size)
{
    char host[64];
    if (address->is_unix) {
        snprintf(out, size, "unix:%s", address->path);
        return;
    }
    bd_sockaddr_host(&address->inet, host, sizeof host);
    bool v6 = address->inet.ss_family == AF_INET6;
    in_port_t port = v6 ? ((const struct sockaddr_in6 *)&address->inet)->sin6_port
                        : ((const struct sockaddr_in *)&address->inet)->sin_port;
    snprintf(out, size, v6 ? "[%s]:%u" : "%s:%u", host, ntohs(port));
}
