#include "net/http_head.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"

static const char *const names[BD_HTTP_HEADER_COUNT] = {
    [BD_HTTP_ACCEPT] = "accept",
    [BD_HTTP_AUTHORIZATION] = "authorization",
    [BD_HTTP_BOUNCED_CLIENT] = "bounced-client",
    [BD_HTTP_CONNECTION] = "connection",
    [BD_HTTP_CONTENT_LENGTH] = "content-length",
    [BD_HTTP_CONTENT_TYPE] = "content-type",
    [BD_HTTP_COOKIE] = "cookie",
    [BD_HTTP_EXPECT] = "expect",
    [BD_HTTP_HOST] = "host",
    [BD_HTTP_IF_NONE_MATCH] = "if-none-match",
    [BD_HTTP_ORIGIN] = "origin",
    [BD_HTTP_TRANSFER_ENCODING] = "transfer-encoding",
    [BD_HTTP_UPGRADE] = "upgrade",
    [BD_HTTP_WS_KEY] = "sec-websocket-key",
    [BD_HTTP_WS_PROTOCOL] = "sec-websocket-protocol",
    [BD_HTTP_WS_VERSION] = "sec-websocket-version",
};

void bd_http_head_finish(struct bd_http_head *head)
{
    free(head->url);
    for (int i = 0; i < BD_HTTP_HEADER_COUNT; i++) free(head->values[i]);
    *head = (struct bd_http_head){.current = -1};
}

void bd_http_head_begin(struct bd_http_head *head, size_t bytes_max)
{
    bd_http_head_finish(head);
    head->bytes_max = bytes_max;
}

static bool count_bytes(struct bd_http_head *head, size_t size)
{
    head->bytes += size;
    return head->bytes <= head->bytes_max;
}

static void append(char **text, const char *bytes, size_t size)
{
    size_t used = *text ? strlen(*text) : 0;
    char *grown = realloc(*text, used + size + 1);
    BD_ASSERT(grown);
    memcpy(grown + used, bytes, size);
    grown[used + size] = 0;
    *text = grown;
}

// The parser is lenient about characters; where a name or a value ends must not be a matter of
// opinion between us and a proxy.
static bool all_of(const char *bytes, size_t size, bool (*allowed)(unsigned char c))
{
    for (size_t i = 0; i < size; i++)
        if (!allowed((unsigned char)bytes[i])) return false;
    return true;
}

static bool is_url(unsigned char c)
{
    return c > 0x20 && c < 0x7f;
}

static bool is_token(unsigned char c)
{
    return isalnum(c) || (c != 0 && strchr("!#$%&'*+-.^_`|~", c));
}

static bool is_value(unsigned char c)
{
    return c == '\t' || (c >= 0x20 && c != 0x7f);
}

bool bd_http_head_url(struct bd_http_head *head, const char *bytes, size_t size)
{
    if (!count_bytes(head, size) || !all_of(bytes, size, is_url)) return false;
    append(&head->url, bytes, size);
    return true;
}

static void begin_name(struct bd_http_head *head)
{
    head->name[0] = 0;
    head->current = -1;
    head->in_value = false;
}

bool bd_http_head_name(struct bd_http_head *head, const char *bytes, size_t size)
{
    if (!count_bytes(head, size) || !all_of(bytes, size, is_token)) return false;
    if (head->in_value) begin_name(head);
    size_t used = strlen(head->name);
    // A name too long for the buffer is none of ours; cut, it equals none of ours either.
    for (size_t i = 0; i < size && used + 1 < sizeof head->name; i++)
        head->name[used++] = (char)tolower((unsigned char)bytes[i]);
    head->name[used] = 0;
    return true;
}

bool bd_http_head_value(struct bd_http_head *head, const char *bytes, size_t size)
{
    if (!count_bytes(head, size) || !all_of(bytes, size, is_value)) return false;
    if (!head->in_value) {
        head->in_value = true;
        for (int i = 0; i < BD_HTTP_HEADER_COUNT; i++)
            if (strcmp(head->name, names[i]) == 0) head->current = i;
        if (head->current >= 0 && head->seen[head->current]++)
            append(&head->values[head->current], ", ", 2);
    }
    if (head->current >= 0) append(&head->values[head->current], bytes, size);
    return true;
}
