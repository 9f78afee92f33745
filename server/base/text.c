#include "base/text.h"

#include <stdbool.h>

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

// Those of C1, U+0080 to U+009F, too: to some terminals they are what an escape sequence is.
static bool is_control(const unsigned char *at)
{
    return at[0] < 0x20 || at[0] == 0x7f || (at[0] == 0xc2 && at[1] < 0xa0);
}

void bd_text_make_plain(char *text)
{
    unsigned char *at = (unsigned char *)text;
    while (*at) {
        size_t size = bd_text_character_bytes(at);
        if (size == 0 || is_control(at))
            *at++ = '?'; // what is left of a character is replaced next
        else
            at += size;
    }
}
