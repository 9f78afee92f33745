#include "base/text.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define ESCAPE_BYTES 12 // of \ud83d\ude00

size_t bd_text_character_bytes(const unsigned char *at)
{
    if (at[0] < 0x80) return 1;
    const size_t size = at[0] >= 0xf0 ? 4 : at[0] >= 0xe0 ? 3 : 2;
    if (at[0] < 0xc2 || at[0] > 0xf4) return 0;
    for (size_t i = 1; i < size; i++)
        if ((at[i] & 0xc0) != 0x80) return 0;
    if (at[0] == 0xe0 && at[1] < 0xa0) return 0;
    if (at[0] == 0xed && at[1] > 0x9f) return 0;
    if (at[0] == 0xf0 && at[1] < 0x90) return 0;
    return at[0] == 0xf4 && at[1] > 0x8f ? 0 : size;
}

size_t bd_text_bad_at(const void *bytes, size_t size)
{
    const unsigned char *all = bytes;
    size_t at = 0, step = 1;
    while (at < size && step > 0) {
        // A character is asked for with its end in sight: the last may be cut.
        unsigned char character[5] = {0};
        memcpy(character, all + at, size - at < 4 ? size - at : 4);
        step = all[at] ? bd_text_character_bytes(character) : 0;
        at += step;
    }
    return at;
}

static uint32_t code_of(const unsigned char *at, size_t size)
{
    static const unsigned char first_bits[5] = {0, 0x7f, 0x1f, 0x0f, 0x07};
    uint32_t code = at[0] & first_bits[size];
    for (size_t i = 1; i < size; i++) code = code << 6 | (at[i] & 0x3fu);
    return code;
}

// By Unicode's general categories Cc, Zl, Zp and Cf (less the signs among these that are seen, as
// U+0600), and its property Default_Ignorable (less U+FE00 to U+FE0F, which ask for a letter's or
// an emoji's other look). C1, U+0080 to U+009F, is to some terminals what an escape sequence is.
static const struct {
    uint32_t first, last;
} unseen[] = {
    {0x0000, 0x001f},   {0x007f, 0x009f},   {0x00ad, 0x00ad},   {0x034f, 0x034f},
    {0x061c, 0x061c},   {0x115f, 0x1160},   {0x17b4, 0x17b5},   {0x180b, 0x180f},
    {0x200b, 0x200f},   {0x2028, 0x202e},   {0x2060, 0x206f},   {0x3164, 0x3164},
    {0xfeff, 0xfeff},   {0xffa0, 0xffa0},   {0xfff0, 0xfffb},   {0x13430, 0x1343f},
    {0x1bca0, 0x1bca3}, {0x1d173, 0x1d17a}, {0xe0000, 0xe0fff},
};

static bool is_unseen(uint32_t code)
{
    if (code >= 0x20 && code < 0x7f) return false;
    for (size_t i = 0; i < sizeof unseen / sizeof unseen[0]; i++)
        if (code >= unseen[i].first && code <= unseen[i].last) return true;
    return false;
}

void bd_text_make_plain(char *text)
{
    unsigned char *at = (unsigned char *)text;
    while (*at) {
        size_t size = bd_text_character_bytes(at);
        if (size == 0 || is_unseen(code_of(at, size)))
            *at++ = '?'; // what is left of a character is replaced next
        else
            at += size;
    }
}

bool bd_text_is_plain(const char *text)
{
    const unsigned char *at = (const unsigned char *)text;
    while (*at) {
        const size_t size = bd_text_character_bytes(at);
        if (size == 0 || is_unseen(code_of(at, size))) return false;
        at += size;
    }
    return true;
}

// --- in JSON --------------------------------------------------------------------------------

// Line ends and tabs stand between values, where they are JSON's own, and nowhere else.
static bool needs_escape(const unsigned char *at, size_t size)
{
    return size > 0 && at[0] >= 0x20 && is_unseen(code_of(at, size));
}

static size_t write_escape(char out[ESCAPE_BYTES + 1], uint32_t code)
{
    if (code < 0x10000) return (size_t)snprintf(out, ESCAPE_BYTES + 1, "\\u%04x", code);
    code -= 0x10000;
    return (size_t)snprintf(out, ESCAPE_BYTES + 1, "\\u%04x\\u%04x", 0xd800 + (code >> 10),
                            0xdc00 + (code & 0x3ff));
}

char *bd_text_escape_json(char *json)
{
    size_t count = 0, used = 0;
    if (!json) return NULL;
    for (const unsigned char *at = (const unsigned char *)json; *at;) {
        const size_t size = bd_text_character_bytes(at);
        count += needs_escape(at, size);
        at += size ? size : 1;
    }
    if (count == 0) return json;
    char *out = malloc(strlen(json) + count * ESCAPE_BYTES + 1);
    for (const unsigned char *at = (const unsigned char *)json; out && *at;) {
        const size_t size = bd_text_character_bytes(at);
        if (needs_escape(at, size)) {
            used += write_escape(out + used, code_of(at, size));
        } else {
            memcpy(out + used, at, size ? size : 1);
            used += size ? size : 1;
        }
        at += size ? size : 1;
    }
    if (out) out[used] = 0;
    free(json);
    return out;
}
