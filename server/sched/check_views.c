#include "sched/check_views.h"

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"

// A pixel takes 0.6 KB: at most 40 MB in all, and no more than was traced.
#define VIEW_MAX        4
#define VIEW_PIXELS_MAX 16384

struct entry {
    bool is_named; // false: free, or of a snapshot without a name
    uint8_t name[BD_SHA256_BYTES];
    uint64_t used_at;
    struct bd_check_cache *cache;
};

struct bd_check_views {
    uint64_t clock;
    struct entry entries[VIEW_MAX];
};

struct bd_check_views *bd_check_views_create(void)
{
    struct bd_check_views *views = calloc(1, sizeof *views);
    BD_ASSERT(views);
    return views;
}

void bd_check_views_destroy(struct bd_check_views **views)
{
    if (!*views) return;
    for (int i = 0; i < VIEW_MAX; i++) bd_check_cache_destroy(&(*views)->entries[i].cache);
    free(*views);
    *views = NULL;
}

struct bd_check_cache *bd_check_views_find(struct bd_check_views *views,
                                           const struct bd_reference_subject *subject)
{
    uint8_t name[BD_SHA256_BYTES];
    const bool is_named = bd_reference_subject_name(subject, name);
    struct entry *chosen = &views->entries[0];
    bool is_known = false;
    for (int i = 0; i < VIEW_MAX && !is_known; i++) {
        struct entry *entry = &views->entries[i];
        is_known = is_named && entry->is_named && memcmp(entry->name, name, sizeof name) == 0;
        if (is_known || entry->used_at < chosen->used_at) chosen = entry;
    }
    if (!is_known) {
        bd_check_cache_destroy(&chosen->cache);
        chosen->is_named = is_named;
        if (is_named) memcpy(chosen->name, name, sizeof name);
        chosen->cache = bd_check_cache_create(VIEW_PIXELS_MAX);
    }
    chosen->used_at = ++views->clock;
    return chosen->cache;
}
