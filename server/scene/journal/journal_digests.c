#include "scene/journal/journal_digests.h"

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"

#define SLOTS_LEAST 64u

// Digests are evenly spread already: their first bytes are as good as any hash of them.
static struct bd_digest_slot *find(const struct bd_digests *set, const uint8_t *sha256)
{
    uint64_t key;
    memcpy(&key, sha256, sizeof key);
    uint32_t at = (uint32_t)key & (set->slot_count - 1);
    while (set->slots[at].is_used && memcmp(set->slots[at].sha256, sha256, BD_SHA256_BYTES) != 0)
        at = (at + 1) & (set->slot_count - 1);
    return &set->slots[at];
}

static uint32_t live_count(const struct bd_digests *set)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < set->slot_count; i++) count += set->slots[i].count > 0;
    return count;
}

// Larger only if those that count fill half of its room: the others are left behind.
static void renew(struct bd_digests *set)
{
    struct bd_digests old = *set;
    const bool is_full = 4 * live_count(set) >= old.slot_count;
    set->slot_count = is_full ? 2 * old.slot_count : old.slot_count;
    if (set->slot_count == 0) set->slot_count = SLOTS_LEAST;
    set->slots = calloc(set->slot_count, sizeof *set->slots);
    BD_ASSERT(set->slots);
    set->used_count = 0;
    for (uint32_t i = 0; i < old.slot_count; i++) {
        if (!old.slots[i].count) continue;
        *find(set, old.slots[i].sha256) = old.slots[i];
        set->used_count++;
    }
    free(old.slots);
}

void bd_digests_add(struct bd_digests *set, const uint8_t sha256[BD_SHA256_BYTES])
{
    if (2 * set->used_count >= set->slot_count) renew(set);
    struct bd_digest_slot *slot = find(set, sha256);
    if (!slot->is_used) {
        memcpy(slot->sha256, sha256, BD_SHA256_BYTES);
        slot->is_used = true;
        set->used_count++;
    }
    slot->count++;
}

void bd_digests_take(struct bd_digests *set, const uint8_t sha256[BD_SHA256_BYTES])
{
    if (!set->slot_count) return;
    struct bd_digest_slot *slot = find(set, sha256);
    if (slot->count) slot->count--;
}

bool bd_digests_have(const struct bd_digests *set, const uint8_t sha256[BD_SHA256_BYTES])
{
    return set->slot_count && find(set, sha256)->count > 0;
}

void bd_digests_clear(struct bd_digests *set)
{
    free(set->slots);
    *set = (struct bd_digests){0};
}
