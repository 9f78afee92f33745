#include "sched/check_views.h"

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/hash.h"

// A pixel takes 0.6 KB: at most 40 MB in all, and no more than was traced.
#define VIEW_MAX        4
#define VIEW_PIXELS_MAX 16384

struct entry {
    uint64_t key; // 0: free
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

static uint64_t hash_integrand(const struct bd_integrand *integrand, uint64_t seed)
{
    // Field by field: what lies between them is not defined.
    const double fields[] = {
        integrand->bounces_max,  integrand->indirect_visibility,
        integrand->lights,       integrand->filter,
        integrand->alpha,        integrand->clamp_per_m2,
        integrand->lambert,      integrand->lambert_senders,
        integrand->transmission, integrand->light_vertices,
    };
    return bd_hash64(fields, sizeof fields, seed);
}

static uint64_t key_of(const struct bd_scene *scene, const struct bd_integrand *integrand,
                       const struct bd_reference_view *view, uint64_t seed)
{
    uint64_t key = hash_integrand(integrand, seed);
    const uint32_t picture[] = {view->width_px, view->height_px, view->camera};
    key = bd_hash64(picture, sizeof picture, key);
    key = bd_hash64(scene->content_sha256, sizeof scene->content_sha256, key);
    return key ? key : 1;
}

// Snapshots built by hand have no hash: nothing says that two of them are the same.
static bool has_name(const struct bd_scene *scene)
{
    static const uint8_t none[BD_SHA256_BYTES] = {0};
    return memcmp(scene->content_sha256, none, sizeof none) != 0;
}

struct bd_check_cache *bd_check_views_find(struct bd_check_views *views,
                                           const struct bd_scene *scene,
                                           const struct bd_integrand *integrand,
                                           const struct bd_reference_view *view, uint64_t seed)
{
    uint64_t key = key_of(scene, integrand, view, seed);
    struct entry *chosen = &views->entries[0];
    for (int i = 0; i < VIEW_MAX; i++) {
        struct entry *entry = &views->entries[i];
        if (entry->key == key && has_name(scene)) {
            chosen = entry;
            break;
        }
        if (entry->used_at < chosen->used_at) chosen = entry;
    }
    if (chosen->key != key || !has_name(scene)) {
        bd_check_cache_destroy(&chosen->cache);
        chosen->key = key;
        chosen->cache = bd_check_cache_create(VIEW_PIXELS_MAX);
    }
    chosen->used_at = ++views->clock;
    return chosen->cache;
}
