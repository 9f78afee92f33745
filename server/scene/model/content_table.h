// Content by its SHA-256: what is in memory already need not be read again, and is shared.
//
// Thread: whoever owns the struct.

#ifndef BD_SCENE_MODEL_CONTENT_TABLE_H
#define BD_SCENE_MODEL_CONTENT_TABLE_H

#include <stdint.h>

#include "scene/model/content.h"

// All zero is the empty table. Holds references.
struct bd_content_table {
    uint32_t count, size; // size: a power of two, or 0
    struct bd_content *items;
};

void bd_content_table_finish(struct bd_content_table *table);

// Takes a reference of its own; one that is there already stays as it is.
void bd_content_table_put(struct bd_content_table *table, const struct bd_content *content);

// Borrowed; NULL if it is not there.
const struct bd_content *bd_content_table_get(const struct bd_content_table *table,
                                              const uint8_t sha256[32]);

#endif
