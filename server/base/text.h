// Text that others wrote, made fit for a line that people read. Thread: any.

#ifndef BD_BASE_TEXT_H
#define BD_BASE_TEXT_H

#include <stdbool.h>
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

// Control characters, which are commands to a terminal, what is not seen and yet changes the line
// (it turns the direction of writing, joins, hides, or ends lines: U+202E, U+200B, U+2028 and
// their kin), and bytes that are no UTF-8, as where a text was cut inside a character, become '?',
// in place.
void bd_text_make_plain(char *text);

// Whether it is plain as it stands.
bool bd_text_is_plain(const char *text);

// JSON that says the same, with the same characters as escapes wherever they stand. Takes `json`,
// malloc'ed UTF-8; the caller frees the result. NULL for NULL, and without memory.
char *bd_text_escape_json(char *json);

// The bytes of the character at `at`, of a text that ends in a zero; 0 if it is no UTF-8 (overlong
// forms, surrogates and all beyond U+10FFFF included).
size_t bd_text_character_bytes(const unsigned char *at);

// Where `size` bytes of a stranger's are no text: a zero byte, or no UTF-8. `size` if they are one.
size_t bd_text_bad_at(const void *bytes, size_t size);

#ifdef __cplusplus
}
#endif

#endif
