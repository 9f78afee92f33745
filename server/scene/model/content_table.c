#include "scene/model/content_table.h"

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"

void bd_content_table_finish(struct bd_content_table *table)
{
    for (uint32_t i = 0; i < table->size; i++) bd_content_release(&table->items[i]);
    free(table->items);
    *table = (struct bd_content_table){0};
}

// The item of this name, or the empty place where it would be. The bytes of a SHA-256 are as good
// as a hash of themselves.
static struct bd_content *find_place(const struct bd_content_table *table, const uint8_t sha256[32])
{
    uint32_t at;
    memcpy(&at, sha256, sizeof at);
    for (;; at++) {
        struct bd_content *item = &table->items[at & (table->size - 1)];
        const uint8_t *name = bd_content_sha256(item);
        if (!name || memcmp(name, sha256, 32) == 0) return item;
    }
}

static void grow(struct bd_content_table *table)
{
    struct bd_content_table old = *table;
    table->size = old.size ? 2 * old.size : 64;
    table->items = calloc(table->size, sizeof *table->items);
    BD_ASSERT(table->items);
    for (uint32_t i = 0; i < old.size; i++) {
        const uint8_t *name = bd_content_sha256(&old.items[i]);
        if (name) *find_place(table, name) = old.items[i];
    }
    free(old.items);
}

void bd_content_table_put(struct bd_content_table *table, const struct bd_content *content)
{
    const uint8_t *name = bd_content_sha256(content);
    if (!name) return;
    if (2 * (table->count + 1) > table->size) grow(table);
    struct bd_content *place = find_place(table, name);
    if (bd_content_sha256(place)) return;
    *place = bd_content_retain(content);
    table->count++;
}

const struct bd_content *bd_content_table_get(const struct bd_content_table *table,
                                              const uint8_t sha256[32])
{
    if (table->size == 0) return NULL;
    const struct bd_content *place = find_place(table, sha256);
    return bd_content_sha256(place) ? place : NULL;
}
