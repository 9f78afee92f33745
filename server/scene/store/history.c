#include "scene/store/history.h"

#include <stdio.h>
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
    free(history->undo.entries);
    free(history->redo.entries);
    free(history->known);
    *history = (struct bd_history){0};
}

// --- lists ----------------------------------------------------------------------------------

static void drop(struct bd_history_list *list, uint32_t index)
{
    struct bd_history_entry *at = list->entries + index;
    memmove(at, at + 1, (--list->count - index) * sizeof *at);
}

static void push(struct bd_history_list *list, uint64_t revision, const char *author,
                 const char *by)
{
    if (!list->entries) list->entries = malloc(BD_HISTORY_UNDO_MAX * sizeof *list->entries);
    BD_ASSERT(list->entries);
    if (list->count == BD_HISTORY_UNDO_MAX) drop(list, 0);
    struct bd_history_entry *entry = &list->entries[list->count++];
    entry->revision = revision;
    snprintf(entry->author, sizeof entry->author, "%s", author);
    snprintf(entry->by, sizeof entry->by, "%s", by);
}

// Takes out the entry of a revision; the newest, where that is forgotten. False: there is none.
static bool take(struct bd_history_list *list, uint64_t revision, struct bd_history_entry *out)
{
    if (list->count == 0) return false;
    uint32_t index = list->count - 1;
    for (uint32_t i = 0; i < list->count; i++)
        if (list->entries[i].revision == revision) index = i;
    *out = list->entries[index];
    drop(list, index);
    return true;
}

// What an undo takes from one list, or a redo from the other, is the same author's in the other.
static void move_over(struct bd_history_list *from, struct bd_history_list *to,
                      const struct bd_store_past *past)
{
    struct bd_history_entry moved;
    const bool is_known = take(from, past->of, &moved);
    push(to, past->revision, is_known ? moved.author : past->author, past->author);
}

static void forget_redos(struct bd_history *history, const char *by)
{
    for (uint32_t i = history->redo.count; i-- > 0;)
        if (strcmp(history->redo.entries[i].by, by) == 0) drop(&history->redo, i);
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
        move_over(&history->undo, &history->redo, past);
        break;
    case BD_BATCH_REDO:
        move_over(&history->redo, &history->undo, past);
        break;
    case BD_BATCH_EDIT:
    case BD_BATCH_REVERT:
        forget_redos(history, past->author);
        history->last_edit = past->revision;
        push(&history->undo, past->revision, past->author, past->author);
        break;
    case BD_BATCH_ADD:
    case BD_BATCH_REMOVE:
    case BD_BATCH_NAME:
    case BD_BATCH_UNNAME:
        break;
    }
}

const struct bd_history_entry *bd_history_target(const struct bd_history *history,
                                                 const char *author, bool redo)
{
    const struct bd_history_list *list = redo ? &history->redo : &history->undo;
    for (uint32_t i = list->count; i-- > 0;) {
        const struct bd_history_entry *entry = &list->entries[i];
        if (!author && redo && entry->revision < history->last_edit) return NULL;
        if (!author || strcmp(redo ? entry->by : entry->author, author) == 0) return entry;
    }
    return NULL;
}

uint64_t bd_history_find(const struct bd_history *history, const char *client_edit_id)
{
    uint64_t hash = hash_of(client_edit_id), found = 0;
    for (uint32_t i = 0; i < history->known_count; i++)
        if (history->known[i].hash == hash && history->known[i].revision > found)
            found = history->known[i].revision;
    return found;
}
