#include "net/http/http_head.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

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

// --- targets that name their host -----------------------------------------------------------

void bd_http_head_resolve(struct bd_http_head *head)
{
    const char *url = head->url;
    if (!url) return;
    const size_t scheme = strncasecmp(url, "http://", 7) == 0    ? 7
                          : strncasecmp(url, "https://", 8) == 0 ? 8
                                                                 : 0;
    if (scheme == 0) return;
    const size_t length = strcspn(url + scheme, "/?#");
    const char *rest = url + scheme + length;
    char *path = NULL;
    if (*rest != '/') append(&path, "/", 1);
    append(&path, rest, strlen(rest));
    // A request without the header is none, and stays so.
    if (head->values[BD_HTTP_HOST]) {
        free(head->values[BD_HTTP_HOST]);
        head->values[BD_HTTP_HOST] = NULL;
        append(&head->values[BD_HTTP_HOST], url + scheme, length);
    }
    free(head->url);
    head->url = path;
}

// --- lines ----------------------------------------------------------------------------------

static const char *end_line(struct bd_http_lines *lines)
{
    lines->saw_cr = false;
    if (lines->place == BD_HTTP_IN_START && (lines->spaces != 2 || lines->at_space))
        return "a request line is METHOD TARGET HTTP/1.1";
    lines->place = lines->place == BD_HTTP_AT_START ? BD_HTTP_AT_START
                   : lines->place == BD_HTTP_AT_END ? BD_HTTP_IS_OVER
                                                    : BD_HTTP_AT_NAME;
    return NULL;
}

static const char *look_at_name(struct bd_http_lines *lines, unsigned char c)
{
    const bool is_first = lines->place == BD_HTTP_AT_NAME;
    if (is_first && (c == ' ' || c == '\t')) return "a header is folded into the next line";
    if (c == ':' && !is_first) {
        lines->place = BD_HTTP_IN_VALUE;
        return NULL;
    }
    lines->place = BD_HTTP_IN_NAME;
    return is_token(c) ? NULL : "a header's name is no name";
}

static const char *look_at_start(struct bd_http_lines *lines, unsigned char c)
{
    const bool is_extra = c == ' ' && (lines->at_space || lines->spaces == 2);
    const bool is_first = lines->place == BD_HTTP_AT_START;
    if (is_extra || c == '\t' || (c == ' ' && is_first))
        return "a request line has two single spaces";
    lines->place = BD_HTTP_IN_START;
    lines->at_space = c == ' ';
    lines->spaces += c == ' ';
    return NULL;
}

static const char *look_at(struct bd_http_lines *lines, unsigned char c)
{
    if (c == 0) return "there is a zero in the head";
    if (c == '\n') return lines->saw_cr ? end_line(lines) : "a line ends without a carriage return";
    if (lines->saw_cr) return "a carriage return is not the end of a line";
    if (c == '\r') {
        // Now, and not at the line's end: that may come later, and the parser would answer first.
        if (lines->place == BD_HTTP_IN_NAME) return "a header has no colon";
        lines->saw_cr = true;
        if (lines->place == BD_HTTP_AT_NAME) lines->place = BD_HTTP_AT_END;
        return NULL;
    }
    if (lines->place <= BD_HTTP_IN_START) return look_at_start(lines, c);
    if (lines->place == BD_HTTP_AT_NAME || lines->place == BD_HTTP_IN_NAME)
        return look_at_name(lines, c);
    return NULL;
}

const char *bd_http_lines_check(struct bd_http_lines *lines, const uint8_t *bytes, size_t size,
                                size_t *looked)
{
    const char *breach = NULL;
    *looked = 0;
    while (!breach && *looked < size && lines->place != BD_HTTP_IS_OVER)
        breach = look_at(lines, bytes[(*looked)++]);
    return breach;
}
