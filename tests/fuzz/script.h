// An input as a script: bytes are gathered, a mark ends them and says what becomes of them. Two
// bytes that no text has, so that inserting, deleting and splicing leave the rest of a script what
// it was.

#ifndef BD_TESTS_FUZZ_SCRIPT_H
#define BD_TESTS_FUZZ_SCRIPT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define SCRIPT_MARK 0xff // behind it the command's letter; twice: the byte itself

struct script {
    const uint8_t *at, *end;
    // What was gathered before the last command; `bytes` has room for all of the input.
    uint8_t *bytes;
    size_t size;
};

void script_begin(struct script *script, const uint8_t *bytes, size_t size);
void script_finish(struct script *script);

// The next command; 0 at the end of the input, where the rest was gathered; -1 past it.
int script_next(struct script *script);

// The first gathered byte as a number below `count`, 0 if nothing was gathered.
uint32_t script_number(const struct script *script, uint32_t count);

#endif
