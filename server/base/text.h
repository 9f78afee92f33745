// Text that others wrote, made fit for a line that people read. Thread: any.

#ifndef BD_BASE_TEXT_H
#define BD_BASE_TEXT_H

#ifdef __cplusplus
extern "C" {
#endif

// Control characters, which are commands to a terminal, and bytes that are no UTF-8, as where a
// text was cut inside a character, become '?', in place.
void bd_text_make_plain(char *text);

#ifdef __cplusplus
}
#endif

#endif
