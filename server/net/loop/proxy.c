#include "net/loop/proxy.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define V4_BITS 32
#define V6_BITS 128

static const uint8_t mapped[12] = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff};

// --- who is one -----------------------------------------------------------------------------

static bool parse_bits(const char *text, unsigned most, unsigned *out)
{
    char *end;
    unsigned long bits = strtoul(text, &end, 10);
    if (*text < '0' || *text > '9' || *end || bits > most) return false;
    *out = (unsigned)bits;
    return true;
}

static bool parse_range(const char *text, struct bd_proxy_range *out)
{
    char host[64];
    const size_t length = strcspn(text, "/");
    if (length >= sizeof host) return false;
    memcpy(host, text, length);
    host[length] = 0;
    bool is_v4 = inet_pton(AF_INET, host, out->address + sizeof mapped) == 1;
    if (is_v4)
        memcpy(out->address, mapped, sizeof mapped);
    else if (inet_pton(AF_INET6, host, out->address) != 1)
        return false;
    const unsigned most = is_v4 ? V4_BITS : V6_BITS;
    out->bits = most;
    if (text[length] && !parse_bits(text + length + 1, most, &out->bits)) return false;
    if (is_v4) out->bits += V6_BITS - V4_BITS;
    return true;
}

enum bd_err bd_proxy_parse(const char *text, struct bd_proxy_range *out,
                           struct bd_err_detail *detail)
{
    *out = (struct bd_proxy_range){.is_unix = strncmp(text, "unix:", 5) == 0};
    const bool fits = !out->is_unix || (text[5] && strlen(text + 5) < sizeof out->path);
    if (out->is_unix && fits) snprintf(out->path, sizeof out->path, "%s", text + 5);
    if (out->is_unix ? fits : parse_range(text, out)) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_USAGE, "proxy",
                      "--proxy takes ADDRESS, ADDRESS/BITS, or unix:PATH of a --listen, not "
                      "\"%.60s\"",
                      text);
}

static bool same_bits(const uint8_t *a, const uint8_t *b, unsigned bits)
{
    if (memcmp(a, b, bits / 8) != 0) return false;
    const unsigned rest = bits % 8;
    return rest == 0 || (a[bits / 8] ^ b[bits / 8]) >> (8 - rest) == 0;
}

static void as_v6(const struct sockaddr_storage *address, uint8_t out[16])
{
    if (address->ss_family == AF_INET6) {
        memcpy(out, &((const struct sockaddr_in6 *)address)->sin6_addr, 16);
        return;
    }
    memcpy(out, mapped, sizeof mapped);
    memcpy(out + sizeof mapped, &((const struct sockaddr_in *)address)->sin_addr, 4);
}

bool bd_proxy_has_address(const struct bd_proxy_range *ranges, size_t count,
                          const struct sockaddr_storage *address)
{
    uint8_t bytes[16];
    as_v6(address, bytes);
    for (size_t i = 0; i < count; i++)
        if (!ranges[i].is_unix && same_bits(ranges[i].address, bytes, ranges[i].bits)) return true;
    return false;
}

bool bd_proxy_has_path(const struct bd_proxy_range *ranges, size_t count, const char *path)
{
    for (size_t i = 0; i < count; i++)
        if (ranges[i].is_unix && strcmp(ranges[i].path, path) == 0) return true;
    return false;
}

// --- the header -----------------------------------------------------------------------------

enum { COMMAND_LOCAL = 0x20, COMMAND_PROXY = 0x21 };
enum { FAMILY_UNSPECIFIED = 0, FAMILY_V4 = 1, FAMILY_V6 = 2, FAMILY_UNIX = 3 };
enum { TRANSPORT_UNSPECIFIED = 0, TRANSPORT_STREAM = 1 };

static const uint8_t signature[12] = {'\r', '\n', '\r', '\n', 0,   '\r',
                                      '\n', 'Q',  'U',  'I',  'T', '\n'};

static size_t length_of(const struct bd_proxy_header *header)
{
    return (size_t)header->bytes[14] << 8 | header->bytes[15];
}

// Two addresses and two ports; of Unix two paths, which say nothing here.
static size_t address_bytes_of(unsigned family)
{
    static const size_t sizes[] = {0, 12, 36, 216};
    return sizes[family];
}

static enum bd_err bad(struct bd_err_detail *detail, const char *why)
{
    return bd_err_set(detail, BD_ERR_BAD_INPUT, "proxy", "a proxy's connection %s", why);
}

static enum bd_err check_first(const struct bd_proxy_header *header, struct bd_err_detail *detail)
{
    const uint8_t command = header->bytes[12];
    const unsigned family = header->bytes[13] >> 4, transport = header->bytes[13] & 15;
    if (command != COMMAND_LOCAL && command != COMMAND_PROXY)
        return bad(detail, "begins with a PROXY header of another version or command");
    if (length_of(header) > BD_PROXY_BYTES_MAX)
        return bad(detail, "begins with a PROXY header that is too long");
    if (command == COMMAND_LOCAL) return BD_ERR_OK;
    if (family > FAMILY_UNIX || transport > TRANSPORT_STREAM ||
        (transport == TRANSPORT_UNSPECIFIED) != (family == FAMILY_UNSPECIFIED))
        return bad(detail, "begins with a PROXY header of no stream");
    if (length_of(header) < address_bytes_of(family))
        return bad(detail, "begins with a PROXY header that is too short for its addresses");
    return BD_ERR_OK;
}

static void read_source(struct bd_proxy_header *header)
{
    const uint8_t *at = header->bytes + BD_PROXY_FIRST_BYTES;
    const unsigned family = header->bytes[13] >> 4;
    struct sockaddr_in *v4 = (struct sockaddr_in *)&header->source;
    struct sockaddr_in6 *v6 = (struct sockaddr_in6 *)&header->source;
    if (header->bytes[12] == COMMAND_LOCAL) return;
    if (family == FAMILY_V4) {
        v4->sin_family = AF_INET;
        memcpy(&v4->sin_addr, at, 4);
        memcpy(&v4->sin_port, at + 8, 2);
    } else if (family == FAMILY_V6) {
        v6->sin6_family = AF_INET6;
        memcpy(&v6->sin6_addr, at, 16);
        memcpy(&v6->sin6_port, at + 32, 2);
    }
    header->has_source = family == FAMILY_V4 || family == FAMILY_V6;
}

static enum bd_err take_first(struct bd_proxy_header *header, uint8_t byte,
                              struct bd_err_detail *detail)
{
    if (header->used < sizeof signature && byte != signature[header->used])
        return bad(detail, "does not begin with a PROXY header of version 2");
    header->bytes[header->used++] = byte;
    return header->used == BD_PROXY_FIRST_BYTES ? check_first(header, detail) : BD_ERR_OK;
}

enum bd_err bd_proxy_feed(struct bd_proxy_header *header, const uint8_t *bytes, size_t size,
                          size_t *taken, struct bd_err_detail *detail)
{
    *taken = 0;
    while (*taken < size && header->used < BD_PROXY_FIRST_BYTES) {
        enum bd_err err = take_first(header, bytes[(*taken)++], detail);
        if (err) return err;
    }
    if (header->used < BD_PROXY_FIRST_BYTES) return BD_ERR_OK;
    const size_t whole = BD_PROXY_FIRST_BYTES + length_of(header);
    while (*taken < size && header->used < whole) {
        if (header->used < sizeof header->bytes) header->bytes[header->used] = bytes[*taken];
        header->used++;
        ++*taken;
    }
    if (header->used < whole) return BD_ERR_OK;
    header->is_complete = true;
    read_source(header);
    return BD_ERR_OK;
}
