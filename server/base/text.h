// Text that others wrote, made fit for a line that people read. Thread: any.

#ifndef BD_BASE_TEXT_H
#define BD_BASE_TEXT_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

// Control characters, which are commands to a terminal, and bytes that are no UTF-8, as where a
// text was cut inside a character, become '?', in place.
void bd_text_make_plain(char *text);

// The bytes of the character at `at`, of a text that ends in a zero; 0 if it is no UTF-8 (overlong
// forms, surrogates and all beyond U+10FFFF included).
size_t bd_text_character_bytes(const unsigned char *at);

#ifdef __cplusplus
}
#endif

#endif
