// A request's head as the HTTP transport keeps it: the line and the few headers that it looks at.
//
// Thread: any.

#ifndef BD_NET_HTTP_HTTP_HEAD_H
#define BD_NET_HTTP_HTTP_HEAD_H

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

// The head's bytes before anybody reads them: where a line, a name or the head itself ends must not
// be a matter of opinion between us and a proxy. Lines end in CR LF and in nothing else, no line
// goes on with a space in the next, the first has two spaces and three words, names are tokens and
// end at their colon, and there is no zero. llhttp 8.1 ends lines at a bare line feed or carriage
// return, takes folded headers, and several spaces in the request line: this looks first.
struct bd_http_lines {
    enum {
        BD_HTTP_AT_START, // an empty line may come before a request
        BD_HTTP_IN_START,
        BD_HTTP_AT_NAME,
        BD_HTTP_IN_NAME,
        BD_HTTP_IN_VALUE,
        BD_HTTP_AT_END, // of the empty line
        BD_HTTP_IS_OVER,
    } place;
    bool saw_cr;
    uint8_t spaces; // of the request line, and whether the last character was one
    bool at_space;
};

// Looks at bytes up to the head's end and says how many these are. NULL, or what is wrong.
const char *bd_http_lines_check(struct bd_http_lines *lines, const uint8_t *bytes, size_t size,
                                size_t *looked);

// Frees what is there and begins anew; the first time on zeroes.
void bd_http_head_begin(struct bd_http_head *head, size_t bytes_max);
void bd_http_head_finish(struct bd_http_head *head);

// Pieces as they come. False if the head is too large or has a character that does not belong.
bool bd_http_head_url(struct bd_http_head *head, const char *bytes, size_t size);
bool bd_http_head_name(struct bd_http_head *head, const char *bytes, size_t size);
bool bd_http_head_value(struct bd_http_head *head, const char *bytes, size_t size);

// Makes "http://HOST/PATH" into the path, of that Host whatever the header says (RFC 9112, 3.2.2).
void bd_http_head_resolve(struct bd_http_head *head);

#endif
