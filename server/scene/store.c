#include "scene/store.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>

#include "base/assert.h"

struct bd_store {
    uint32_t count, count_max;
    struct bd_store_entry *entries; // in order of addition
};

struct bd_store *bd_store_create(uint32_t scene_count_max)
{
    struct bd_store *store = calloc(1, sizeof *store);
    BD_ASSERT(store);
    store->count_max = scene_count_max;
    return store;
}

void bd_store_destroy(struct bd_store **store)
{
    if (!*store) return;
    for (uint32_t i = 0; i < (*store)->count; i++) bd_scene_release(&(*store)->entries[i].scene);
    free((*store)->entries);
    free(*store);
    *store = NULL;
}

static void make_id(char id[BD_SCENE_ID_BYTES])
{
    uint64_t random;
    ssize_t size = getrandom(&random, sizeof random, 0);
    BD_ASSERT_CMP(size, ==, (ssize_t)sizeof random);
    snprintf(id, BD_SCENE_ID_BYTES, "%016llx", (unsigned long long)random);
}

enum bd_err bd_store_add(struct bd_store *store, struct bd_scene *scene, const char *name,
                         const struct bd_store_entry **out, struct bd_fault *fault)
{
    if (store->count >= store->count_max)
        return bd_fault_set(fault, BD_ERR_LIMIT, "scenes",
                            "%u scenes are held, which is the limit scenes: remove one first",
                            store->count);
    struct bd_store_entry *entries =
        realloc(store->entries, (store->count + 1) * sizeof *store->entries);
    BD_ASSERT(entries);
    store->entries = entries;
    struct bd_store_entry *entry = &entries[store->count++];
    *entry = (struct bd_store_entry){.revision = 1, .scene = bd_scene_retain(scene)};
    make_id(entry->id);
    snprintf(entry->name, sizeof entry->name, "%s", name);
    *out = entry;
    return BD_ERR_OK;
}

static int find(const struct bd_store *store, const char *id)
{
    for (uint32_t i = 0; i < store->count; i++)
        if (strcmp(store->entries[i].id, id) == 0) return (int)i;
    return -1;
}

enum bd_err bd_store_get(const struct bd_store *store, const char *id,
                         const struct bd_store_entry **out, struct bd_fault *fault)
{
    int index = find(store, id);
    if (index < 0)
        return bd_fault_set(fault, BD_ERR_NOT_FOUND, "scene", "there is no scene \"%.64s\"", id);
    *out = &store->entries[index];
    return BD_ERR_OK;
}

enum bd_err bd_store_remove(struct bd_store *store, const char *id, struct bd_fault *fault)
{
    int index = find(store, id);
    if (index < 0)
        return bd_fault_set(fault, BD_ERR_NOT_FOUND, "scene", "there is no scene \"%.64s\"", id);
    bd_scene_release(&store->entries[index].scene);
    store->count--;
    memmove(&store->entries[index], &store->entries[index + 1],
            (store->count - (uint32_t)index) * sizeof *store->entries);
    return BD_ERR_OK;
}

uint32_t bd_store_count(const struct bd_store *store)
{
    return store->count;
}

const struct bd_store_entry *bd_store_at(const struct bd_store *store, uint32_t index)
{
    return index < store->count ? &store->entries[index] : NULL;
}
