#include "net/command/import_cache.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"

#define ENTRY_COUNT 4
// A scene in memory is a few times its file.
#define FILE_BYTES_MAX (512ull << 20)

struct entry {
    uint8_t key[BD_SHA256_BYTES];
    uint64_t file_bytes, used_at;
    struct bd_scene *scene; // NULL: free
};

struct bd_import_cache {
    pthread_mutex_t lock;
    uint64_t clock;
    struct entry entries[ENTRY_COUNT];
};

struct bd_import_cache *bd_import_cache_create(void)
{
    struct bd_import_cache *cache = calloc(1, sizeof *cache);
    BD_ASSERT(cache);
    pthread_mutex_init(&cache->lock, NULL);
    return cache;
}

void bd_import_cache_destroy(struct bd_import_cache **cache)
{
    if (!*cache) return;
    for (int i = 0; i < ENTRY_COUNT; i++) bd_scene_release(&(*cache)->entries[i].scene);
    pthread_mutex_destroy(&(*cache)->lock);
    free(*cache);
    *cache = NULL;
}

// Neither no environment nor any two of them read alike.
static void add_environment(struct bd_sha256 *sha, const struct bd_environment *environment)
{
    if (!environment) return;
    const struct bd_sky_map *map = environment->map;
    uint64_t size[2] = {map ? map->width_px : 0, map ? map->height_px : 0};
    bd_sha256_update(sha, environment->radiance, sizeof environment->radiance);
    bd_sha256_update(sha, environment->rotation, sizeof environment->rotation);
    bd_sha256_update(sha, size, sizeof size);
    if (map) bd_sha256_update(sha, map->rgb, (size_t)(size[0] * size[1]) * 3 * sizeof *map->rgb);
}

void bd_import_cache_key(const struct bd_import_file *files, uint32_t file_count,
                         const struct bd_environment *environment, uint8_t key[BD_SHA256_BYTES])
{
    struct bd_sha256 *sha = bd_sha256_create();
    for (uint32_t i = 0; i < file_count; i++) {
        // With both lengths in front, no two tables read alike.
        uint64_t lengths[2] = {strlen(files[i].uri), files[i].size_bytes};
        // The main file's uri is its name, for messages only.
        if (i == 0) lengths[0] = 0;
        bd_sha256_update(sha, lengths, sizeof lengths);
        bd_sha256_update(sha, files[i].uri, lengths[0]);
        bd_sha256_update(sha, files[i].bytes, files[i].size_bytes);
    }
    add_environment(sha, environment);
    bd_sha256_finish(&sha, key);
}

static struct entry *find(struct bd_import_cache *cache, const uint8_t key[BD_SHA256_BYTES])
{
    for (int i = 0; i < ENTRY_COUNT; i++)
        if (cache->entries[i].scene && memcmp(cache->entries[i].key, key, BD_SHA256_BYTES) == 0)
            return &cache->entries[i];
    return NULL;
}

struct bd_scene *bd_import_cache_get(struct bd_import_cache *cache,
                                     const uint8_t key[BD_SHA256_BYTES])
{
    pthread_mutex_lock(&cache->lock);
    struct entry *entry = find(cache, key);
    struct bd_scene *scene = entry ? bd_scene_retain(entry->scene) : NULL;
    if (entry) entry->used_at = ++cache->clock;
    pthread_mutex_unlock(&cache->lock);
    return scene;
}

static uint64_t total_bytes(const struct bd_import_cache *cache)
{
    uint64_t bytes = 0;
    for (int i = 0; i < ENTRY_COUNT; i++)
        if (cache->entries[i].scene) bytes += cache->entries[i].file_bytes;
    return bytes;
}

// A free entry, or else the one that nobody asked for the longest.
static struct entry *oldest(struct bd_import_cache *cache)
{
    struct entry *oldest = &cache->entries[0];
    for (int i = 0; i < ENTRY_COUNT && oldest->scene; i++)
        if (!cache->entries[i].scene || cache->entries[i].used_at < oldest->used_at)
            oldest = &cache->entries[i];
    return oldest;
}

static struct entry *oldest_in_use(struct bd_import_cache *cache)
{
    struct entry *oldest = NULL;
    for (int i = 0; i < ENTRY_COUNT; i++)
        if (cache->entries[i].scene && (!oldest || cache->entries[i].used_at < oldest->used_at))
            oldest = &cache->entries[i];
    return oldest;
}

void bd_import_cache_put(struct bd_import_cache *cache, const uint8_t key[BD_SHA256_BYTES],
                         uint64_t file_bytes, struct bd_scene *scene)
{
    if (file_bytes > FILE_BYTES_MAX) return;
    pthread_mutex_lock(&cache->lock);
    // Two imports of one file may have run at once: the first one stays.
    if (!find(cache, key)) {
        while (total_bytes(cache) + file_bytes > FILE_BYTES_MAX)
            bd_scene_release(&oldest_in_use(cache)->scene);
        struct entry *entry = oldest(cache);
        bd_scene_release(&entry->scene);
        *entry = (struct entry){
            .file_bytes = file_bytes, .used_at = ++cache->clock, .scene = bd_scene_retain(scene)};
        memcpy(entry->key, key, BD_SHA256_BYTES);
    }
    pthread_mutex_unlock(&cache->lock);
}
