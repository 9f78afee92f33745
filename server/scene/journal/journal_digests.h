// A set of SHA-256 digests with counts, in memory.

#ifndef BD_SCENE_JOURNAL_JOURNAL_DIGESTS_H
#define BD_SCENE_JOURNAL_JOURNAL_DIGESTS_H

#include <stdbool.h>
#include <stdint.h>

#include "base/hash.h"

// All zeros is the empty set.
struct bd_digests {
    struct bd_digest_slot {
        uint8_t sha256[BD_SHA256_BYTES];
        uint32_t count; // 0: free, or was taken out
        bool is_used;   // something stands here or stood here
    } * slots;
    uint32_t slot_count, used_count; // a power of two, or 0
};

void bd_digests_add(struct bd_digests *set, const uint8_t sha256[BD_SHA256_BYTES]);
// Takes one off its count; nothing if it is not there.
void bd_digests_take(struct bd_digests *set, const uint8_t sha256[BD_SHA256_BYTES]);
bool bd_digests_have(const struct bd_digests *set, const uint8_t sha256[BD_SHA256_BYTES]);
void bd_digests_clear(struct bd_digests *set);

#endif
