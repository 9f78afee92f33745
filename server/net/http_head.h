// A request's head as the HTTP face keeps it: the line and the few headers that it looks at.
//
// Thread: any.

#ifndef BD_NET_HTTP_HEAD_H
#define BD_NET_HTTP_HEAD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/err.h"

enum bd_http_header {
    BD_HTTP_ACCEPT,
    BD_HTTP_AUTHORIZATION,
    BD_HTTP_BOUNCED_CLIENT,
    BD_HTTP_CONNECTION,
    BD_HTTP_CONTENT_LENGTH,
    BD_HTTP_CONTENT_TYPE,
    BD_HTTP_COOKIE,
    BD_HTTP_EXPECT,
    BD_HTTP_HOST,
    BD_HTTP_IF_NONE_MATCH,
    BD_HTTP_ORIGIN,
    BD_HTTP_TRANSFER_ENCODING,
    BD_HTTP_UPGRADE,
    BD_HTTP_WS_KEY,
    BD_HTTP_WS_PROTOCOL,
    BD_HTTP_WS_VERSION,
    BD_HTTP_HEADER_COUNT,
};

struct bd_http_head {
    char *url;                           // as sent; NULL before its first byte
    char *values[BD_HTTP_HEADER_COUNT];  // NULL = not there; malloc'ed; several: a, b, c
    uint32_t seen[BD_HTTP_HEADER_COUNT]; // how often
    size_t bytes;                        // of all of it so far
    size_t bytes_max;                    // the limit head_bytes
    char name[32];                       // of the header that is being read, lower case, cut
    int current;                         // enum bd_http_header, or -1
    bool in_value;
};

// Frees what is there and begins anew; the first time on zeroes.
void bd_http_head_begin(struct bd_http_head *head, size_t bytes_max);
void bd_http_head_finish(struct bd_http_head *head);

// Pieces as they come. False if the head is too large or has a character that does not belong.
bool bd_http_head_url(struct bd_http_head *head, const char *bytes, size_t size);
bool bd_http_head_name(struct bd_http_head *head, const char *bytes, size_t size);
bool bd_http_head_value(struct bd_http_head *head, const char *bytes, size_t size);

#endif
