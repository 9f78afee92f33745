#include "scene/history.h"

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/hash.h"

static uint64_t hash_of(const char *client_edit_id)
{
    return bd_hash64(client_edit_id, strlen(client_edit_id), 0);
}

void bd_history_finish(struct bd_history *history)
{
    free(history->undo);
    free(history->redo);
    free(history->known);
    *history = (struct bd_history){0};
}

static void push(uint64_t **stack, uint32_t *count, uint64_t revision)
{
    if (!*stack) *stack = malloc(BD_HISTORY_UNDO_MAX * sizeof **stack);
    BD_ASSERT(*stack);
    if (*count == BD_HISTORY_UNDO_MAX) memmove(*stack, *stack + 1, --*count * sizeof **stack);
    (*stack)[(*count)++] = revision;
}

static void pop(uint32_t *count)
{
    if (*count > 0) --*count;
}

static void remember(struct bd_history *history, const struct bd_store_past *past)
{
    if (!past->client_edit_id[0]) return;
    if (!history->known) history->known = malloc(BD_HISTORY_KNOWN_MAX * sizeof *history->known);
    BD_ASSERT(history->known);
    history->known[history->known_next] =
        (struct bd_known_edit){hash_of(past->client_edit_id), past->revision};
    history->known_next = (history->known_next + 1) % BD_HISTORY_KNOWN_MAX;
    if (history->known_count < BD_HISTORY_KNOWN_MAX) history->known_count++;
}

void bd_history_add(struct bd_history *history, const struct bd_store_past *past)
{
    remember(history, past);
    switch (past->kind) {
    case BD_BATCH_UNDO:
        pop(&history->undo_count);
        push(&history->redo, &history->redo_count, past->revision);
        break;
    case BD_BATCH_REDO:
        pop(&history->redo_count);
        push(&history->undo, &history->undo_count, past->revision);
        break;
    case BD_BATCH_EDIT:
    case BD_BATCH_REVERT:
        history->redo_count = 0;
        push(&history->undo, &history->undo_count, past->revision);
        break;
    case BD_BATCH_ADD:
    case BD_BATCH_REMOVE:
    case BD_BATCH_NAME:
    case BD_BATCH_UNNAME:
        break;
    }
}

uint64_t bd_history_undo_target(const struct bd_history *history, bool redo)
{
    uint32_t count = redo ? history->redo_count : history->undo_count;
    if (count == 0) return 0;
    return (redo ? history->redo : history->undo)[count - 1];
}

uint64_t bd_history_find(const struct bd_history *history, const char *client_edit_id)
{
    uint64_t hash = hash_of(client_edit_id), found = 0;
    for (uint32_t i = 0; i < history->known_count; i++)
        if (history->known[i].hash == hash && history->known[i].revision > found)
            found = history->known[i].revision;
    return found;
}
