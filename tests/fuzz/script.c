#include "tests/fuzz/script.h"

#include <stdlib.h>

#include "base/assert.h"

void script_begin(struct script *script, const uint8_t *bytes, size_t size)
{
    *script = (struct script){.at = bytes, .end = bytes + size, .bytes = malloc(size + 1)};
    BD_ASSERT(script->bytes);
}

void script_finish(struct script *script)
{
    free(script->bytes);
}

int script_next(struct script *script)
{
    script->size = 0;
    if (!script->at) return -1;
    while (script->at < script->end) {
        uint8_t byte = *script->at++;
        bool is_mark = byte == SCRIPT_MARK && script->at < script->end;
        if (is_mark && *script->at != SCRIPT_MARK) return *script->at++;
        if (is_mark) script->at++;
        script->bytes[script->size++] = byte;
    }
    script->at = NULL;
    return 0;
}

uint32_t script_number(const struct script *script, uint32_t count)
{
    return script->size > 0 ? script->bytes[0] % count : 0;
}
