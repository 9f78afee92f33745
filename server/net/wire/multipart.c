#include "net/wire/multipart.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "base/assert.h"
#include "base/text.h"

#define BOUNDARY_LENGTH_MAX 70
#define PART_HEADERS_MAX    4096

int bd_multipart_boundary(const char *content_type, char *out, size_t size)
{
    static const char type[] = "multipart/form-data";
    if (strncasecmp(content_type, type, sizeof type - 1) != 0) return 0;
    const char *parameter = strcasestr(content_type + sizeof type - 1, "boundary=");
    if (!parameter) return 0;
    const char *start = parameter + strlen("boundary=");
    size_t length = *start == '"' ? strcspn(++start, "\"") : strcspn(start, "; \t");
    if (length == 0 || length > BOUNDARY_LENGTH_MAX || length >= size) return 0;
    memcpy(out, start, length);
    out[length] = 0;
    return 1;
}

struct cursor {
    const char *at, *end;
    char delimiter[BOUNDARY_LENGTH_MAX + 8]; // "\r\n--boundary"
    size_t delimiter_length;
    struct bd_err_detail *detail;
};

static enum bd_err malformed(struct cursor *cursor, const char *what)
{
    return bd_err_set(cursor->detail, BD_ERR_BAD_INPUT, "body", "the multipart body %s", what);
}

// Copies the value of `name="..."` out of the part's headers.
static bool find_name(const char *headers, size_t size, char *out, size_t out_size)
{
    static const char key[] = " name=\"";
    const char *start = memmem(headers, size, key, sizeof key - 1);
    if (!start) return false;
    start += sizeof key - 1;
    const char *quote = memchr(start, '"', (size_t)(headers + size - start));
    if (!quote || quote == start || (size_t)(quote - start) >= out_size) return false;
    const size_t bytes = (size_t)(quote - start);
    if (bd_text_bad_at(start, bytes) != bytes) return false;
    memcpy(out, start, (size_t)(quote - start));
    out[quote - start] = 0;
    return true;
}

static enum bd_err read_part(struct cursor *cursor, struct bd_multipart_part *part)
{
    size_t left = (size_t)(cursor->end - cursor->at);
    size_t searched = left < PART_HEADERS_MAX ? left : PART_HEADERS_MAX;
    const char *blank = memmem(cursor->at, searched, "\r\n\r\n", 4);
    if (!blank) return malformed(cursor, "has a part whose headers do not end");
    if (!find_name(cursor->at, (size_t)(blank - cursor->at), part->name, sizeof part->name))
        return malformed(cursor, "has a part without a name, or with one that is too long");
    const char *content = blank + 4;
    // An empty part's delimiter shares the line end of the headers.
    const char *search = blank + 2;
    const char *stop =
        memmem(search, (size_t)(cursor->end - search), cursor->delimiter, cursor->delimiter_length);
    if (!stop) return malformed(cursor, "ends inside a part");
    part->bytes = content;
    part->size_bytes = stop < content ? 0 : (size_t)(stop - content);
    cursor->at = stop + cursor->delimiter_length;
    return BD_ERR_OK;
}

// Behind a boundary: "--" ends the body, a line end begins a part.
static enum bd_err after_boundary(struct cursor *cursor, bool *is_last)
{
    if (cursor->end - cursor->at < 2) return malformed(cursor, "is cut off at a boundary");
    *is_last = memcmp(cursor->at, "--", 2) == 0;
    if (!*is_last && memcmp(cursor->at, "\r\n", 2) != 0)
        return malformed(cursor, "has something behind a boundary");
    // The part's headers are searched from the line end on, so that " name=" finds its first line.
    return BD_ERR_OK;
}

static bool name_is_taken(const struct bd_multipart_part *parts, uint32_t count, const char *name)
{
    for (uint32_t i = 0; i < count; i++)
        if (strcmp(parts[i].name, name) == 0) return true;
    return false;
}

static enum bd_err read_parts(struct cursor *cursor, uint32_t part_count_max,
                              struct bd_multipart_part **parts, uint32_t *count)
{
    for (;;) {
        bool is_last;
        enum bd_err err = after_boundary(cursor, &is_last);
        if (err) return err;
        if (is_last) break;
        if (*count == part_count_max)
            return bd_err_set(cursor->detail, BD_ERR_LIMIT, "scene_files",
                              "the body has more than %u parts (limit scene_files)",
                              part_count_max);
        struct bd_multipart_part *grown = realloc(*parts, (*count + 1) * sizeof **parts);
        BD_ASSERT(grown);
        *parts = grown;
        err = read_part(cursor, &grown[*count]);
        if (err) return err;
        if (name_is_taken(grown, *count, grown[*count].name))
            return malformed(cursor, "has two parts of one name");
        ++*count;
    }
    return *count > 0 ? BD_ERR_OK : malformed(cursor, "has no parts");
}

enum bd_err bd_multipart_parse(const void *bytes, size_t size, const char *boundary,
                               uint32_t part_count_max, struct bd_multipart_part **parts,
                               uint32_t *part_count, struct bd_err_detail *detail)
{
    struct cursor cursor = {.at = bytes, .end = (const char *)bytes + size, .detail = detail};
    cursor.delimiter_length =
        (size_t)snprintf(cursor.delimiter, sizeof cursor.delimiter, "\r\n--%s", boundary);
    BD_ASSERT_CMP(cursor.delimiter_length, <, sizeof cursor.delimiter);
    // The first boundary has no line end before it.
    size_t first = cursor.delimiter_length - 2;
    if (size < first || memcmp(bytes, cursor.delimiter + 2, first) != 0)
        return malformed(&cursor, "does not begin with its boundary");
    cursor.at += first;
    *parts = NULL;
    *part_count = 0;
    enum bd_err err = read_parts(&cursor, part_count_max, parts, part_count);
    if (!err) return BD_ERR_OK;
    free(*parts);
    *parts = NULL;
    return err;
}
