#include "clients/cli/sets.h"

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"

// Takes `key`, malloc'ed, with its value somewhere behind it in the same block.
static enum bd_err append(struct bd_cli_sets *sets, char *key, char *value, struct bd_fault *fault)
{
    if (!key || sets->count == BD_CLI_SETS_MAX) {
        free(key);
        return bd_fault_set(fault, key ? BD_ERR_USAGE : BD_ERR_NO_MEMORY, "set",
                            key ? "--set: more parameters than any technique has"
                                : "no memory for --set");
    }
    Bounced__KeyValue *item = &sets->items[sets->count];
    bounced__key_value__init(item);
    item->key = key;
    item->value = value;
    sets->pointers[sets->count++] = item;
    return BD_ERR_OK;
}

enum bd_err bd_cli_sets_add(struct bd_cli_sets *sets, const char *word, struct bd_fault *fault)
{
    char *key = strdup(word), *equals = key ? strchr(key, '=') : NULL;
    BD_ASSERT(!key || equals);
    if (equals) *equals = 0;
    return append(sets, key, equals ? equals + 1 : NULL, fault);
}

enum bd_err bd_cli_sets_add_pair(struct bd_cli_sets *sets, const char *key, const char *value,
                                 struct bd_fault *fault)
{
    size_t key_bytes = strlen(key) + 1, value_bytes = strlen(value) + 1;
    char *both = malloc(key_bytes + value_bytes);
    if (both) {
        memcpy(both, key, key_bytes);
        memcpy(both + key_bytes, value, value_bytes);
    }
    return append(sets, both, both ? both + key_bytes : NULL, fault);
}

void bd_cli_sets_finish(struct bd_cli_sets *sets)
{
    for (size_t i = 0; i < sets->count; i++) free(sets->items[i].key);
    sets->count = 0;
}

void bd_cli_sets_fill(struct bd_cli_sets *sets, Bounced__FrameRequest *request)
{
    request->n_parameters = sets->count;
    request->parameters = sets->pointers;
}
