#include "frame/memo.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/hash.h"

struct entry {
    uint64_t key, rests_on; // 0: on nothing
    void *output;
    uint64_t bytes;
    uint64_t made_in_frame, used_in_frame;
    uint32_t users;    // a bit for each frame under way that uses it, the outermost's first
    bool is_forgotten; // found no more
    bd_memo_destroy_fn destroy;
};

// What a hundred views of a few scenes reuse from frame to frame. Small pictures stay far below the
// budget's bytes, and every entry is looked at in every lookup, microseconds up to here.
#define ENTRIES_MAX 4096

// A linear array.
struct bd_memo {
    void *owner;
    uint64_t budget_bytes, used_bytes;
    uint64_t last_frame_bytes_max, last_frame; // that ended
    uint64_t frame_count;                      // begun so far
    uint64_t frames[BD_MEMO_FRAMES_MAX];       // under way, the outermost first
    uint32_t depth;                            // how many those are
    size_t count, capacity;
    struct entry *entries;
};

struct bd_memo *bd_memo_create(void *owner, uint64_t budget_bytes)
{
    struct bd_memo *memo = calloc(1, sizeof *memo);
    BD_ASSERT(memo);
    memo->owner = owner;
    memo->budget_bytes = budget_bytes;
    return memo;
}

void bd_memo_keep_last_frame(struct bd_memo *memo, uint64_t bytes_max)
{
    memo->last_frame_bytes_max = bytes_max;
}

static uint64_t current_frame(const struct bd_memo *memo)
{
    return memo->depth ? memo->frames[memo->depth - 1] : 0;
}

static uint32_t current_user(const struct bd_memo *memo)
{
    return memo->depth ? 1u << (memo->depth - 1) : 0;
}

static void remove_at(struct bd_memo *memo, size_t index)
{
    struct entry gone = memo->entries[index];
    memo->entries[index] = memo->entries[--memo->count];
    memo->used_bytes -= gone.bytes;
    gone.destroy(memo->owner, gone.output);
}

void bd_memo_destroy(struct bd_memo **memo)
{
    if (!*memo) return;
    while ((*memo)->count > 0) remove_at(*memo, (*memo)->count - 1);
    free((*memo)->entries);
    free(*memo);
    *memo = NULL;
}

// No frame that goes on may use it again, but the current one has it no more.
static void forget_at(struct bd_memo *memo, size_t index)
{
    struct entry *entry = &memo->entries[index];
    entry->users &= ~current_user(memo);
    entry->is_forgotten = true;
    if (!entry->users) remove_at(memo, index);
}

// Index of the least recently used entry that no frame under way uses; count if none.
static size_t oldest_unused(const struct bd_memo *memo)
{
    size_t oldest = memo->count;
    for (size_t i = 0; i < memo->count; i++) {
        if (memo->entries[i].users) continue;
        if (oldest == memo->count ||
            memo->entries[i].used_in_frame < memo->entries[oldest].used_in_frame)
            oldest = i;
    }
    return oldest;
}

// The next frame is likely to ask for it.
static bool stays(const struct bd_memo *memo, const struct entry *entry)
{
    return entry->used_in_frame >= memo->last_frame && memo->count <= ENTRIES_MAX &&
           memo->used_bytes <= memo->last_frame_bytes_max;
}

static void evict_to_budget(struct bd_memo *memo)
{
    while (memo->used_bytes > memo->budget_bytes || memo->count > ENTRIES_MAX) {
        size_t index = oldest_unused(memo);
        if (index == memo->count || stays(memo, &memo->entries[index])) return;
        remove_at(memo, index);
    }
}

void bd_memo_begin_frame(struct bd_memo *memo)
{
    BD_ASSERT_CMP(memo->depth, <, BD_MEMO_FRAMES_MAX);
    memo->frames[memo->depth++] = ++memo->frame_count;
    evict_to_budget(memo);
}

void bd_memo_end_frame(struct bd_memo *memo)
{
    BD_ASSERT(memo->depth > 0);
    const uint32_t user = current_user(memo);
    memo->last_frame = current_frame(memo);
    memo->depth--;
    for (size_t i = memo->count; i-- > 0;) {
        memo->entries[i].users &= ~user;
        if (memo->entries[i].is_forgotten && !memo->entries[i].users) remove_at(memo, i);
    }
    evict_to_budget(memo);
}

// NULL where nobody finds it.
static struct entry *entry_of(struct bd_memo *memo, uint64_t key)
{
    for (size_t i = 0; i < memo->count; i++)
        if (memo->entries[i].key == key && !memo->entries[i].is_forgotten) return &memo->entries[i];
    return NULL;
}

static void use(struct bd_memo *memo, struct entry *entry)
{
    entry->used_in_frame = current_frame(memo);
    entry->users |= current_user(memo);
}

void *bd_memo_find(struct bd_memo *memo, uint64_t key)
{
    struct entry *entry = entry_of(memo, key);
    if (!entry) return NULL;
    use(memo, entry);
    struct entry *below = entry->rests_on ? entry_of(memo, entry->rests_on) : NULL;
    if (below) use(memo, below);
    return entry->output;
}

static bool is_younger(const struct entry *a, const struct entry *b)
{
    return a->used_in_frame != b->used_in_frame ? a->used_in_frame > b->used_in_frame
                                                : a->made_in_frame > b->made_in_frame;
}

void *bd_memo_find_fitting(struct bd_memo *memo, bd_memo_destroy_fn destroy,
                           bool (*fits)(const void *output, void *user), void *user, uint64_t *key)
{
    struct entry *last = NULL;
    for (size_t i = 0; i < memo->count; i++) {
        struct entry *entry = &memo->entries[i];
        if (entry->destroy != destroy || entry->is_forgotten) continue;
        if (last && !is_younger(entry, last)) continue;
        if (fits(entry->output, user)) last = entry;
    }
    if (!last) return NULL;
    last->users |= current_user(memo);
    *key = last->key;
    return last->output;
}

void bd_memo_rest_on(struct bd_memo *memo, uint64_t key, uint64_t other)
{
    struct entry *entry = entry_of(memo, key), *below = entry_of(memo, other);
    if (!entry || !below) return;
    entry->rests_on = below->rests_on ? below->rests_on : other;
    below = entry_of(memo, entry->rests_on);
    if (below) use(memo, below);
}

void *bd_memo_take(struct bd_memo *memo, uint64_t key)
{
    for (size_t i = 0; i < memo->count; i++) {
        if (memo->entries[i].key != key || memo->entries[i].is_forgotten) continue;
        void *output = memo->entries[i].output;
        memo->used_bytes -= memo->entries[i].bytes;
        memo->entries[i] = memo->entries[--memo->count];
        return output;
    }
    return NULL;
}

void bd_memo_store(struct bd_memo *memo, uint64_t key, void *output, uint64_t bytes,
                   bd_memo_destroy_fn destroy)
{
    bd_memo_forget(memo, key);
    if (memo->count == memo->capacity) {
        memo->capacity = memo->capacity ? 2 * memo->capacity : 32;
        memo->entries = realloc(memo->entries, memo->capacity * sizeof *memo->entries);
        BD_ASSERT(memo->entries);
    }
    memo->entries[memo->count++] = (struct entry){
        .key = key,
        .output = output,
        .bytes = bytes,
        .made_in_frame = current_frame(memo),
        .used_in_frame = current_frame(memo),
        .users = current_user(memo),
        .destroy = destroy,
    };
    memo->used_bytes += bytes;
    evict_to_budget(memo);
}

void bd_memo_forget(struct bd_memo *memo, uint64_t key)
{
    for (size_t i = 0; i < memo->count; i++) {
        if (memo->entries[i].key != key || memo->entries[i].is_forgotten) continue;
        forget_at(memo, i);
        return;
    }
}

void bd_memo_forget_older(struct bd_memo *memo, uint64_t key)
{
    for (size_t i = memo->count; i-- > 0;) {
        const struct entry *entry = &memo->entries[i];
        if (entry->key == key && !entry->is_forgotten &&
            entry->made_in_frame != current_frame(memo))
            forget_at(memo, i);
    }
}

uint64_t bd_memo_evict_unused(struct bd_memo *memo)
{
    uint64_t before = memo->used_bytes;
    for (size_t i; (i = oldest_unused(memo)) != memo->count;) remove_at(memo, i);
    return before - memo->used_bytes;
}

uint64_t bd_key_begin(const char *pass)
{
    return bd_hash64(pass, strlen(pass), 0);
}

uint64_t bd_key_bytes(uint64_t key, const void *bytes, size_t size_bytes)
{
    return bd_hash64(bytes, size_bytes, key);
}

uint64_t bd_key_number(uint64_t key, uint64_t value)
{
    return bd_hash64(&value, sizeof value, key);
}
