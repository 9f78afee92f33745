// Rows of a journal changed by somebody who knows its sums: what is wrong with them only the
// decoders of their bytes can find.

#ifndef BD_TESTS_FUZZ_FORGE_H
#define BD_TESTS_FUZZ_FORGE_H

#include <stddef.h>
#include <stdint.h>

// Changes the journal in `directory`, which nobody has open. Each six bytes are one change: column,
// row, where in the value (two bytes), how, and by what. Afterwards all sums are right again,
// content has the name of its bytes, and whoever named it names it so.
void forge(const char *directory, const uint8_t *changes, size_t size);

#endif
