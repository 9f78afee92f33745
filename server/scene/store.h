// The scenes that the daemon holds, by id. For now in memory only: a restart forgets them.
//
// Thread: one, the event loop's, for every call. Snapshots that it hands out are for any thread.

#ifndef BD_SCENE_STORE_H
#define BD_SCENE_STORE_H

#include <stdint.h>

#include "base/err.h"
#include "scene/scene.h"

#define BD_SCENE_ID_BYTES 17 // sixteen hexadecimal digits and the final zero

struct bd_store;

struct bd_store *bd_store_create(uint32_t scene_count_max);
void bd_store_destroy(struct bd_store **store);

// One scene as the store knows it. Borrowed: until the next call that changes the store.
struct bd_store_entry {
    char id[BD_SCENE_ID_BYTES];
    char name[128];
    uint64_t revision;
    struct bd_scene *scene;
};

// Takes a reference of its own. The id is random: knowing one says nothing about others.
// BD_ERR_LIMIT, naming `scenes`, when the store is full.
BD_MUST_CHECK
enum bd_err bd_store_add(struct bd_store *store, struct bd_scene *scene, const char *name,
                         const struct bd_store_entry **out, struct bd_fault *fault);

// BD_ERR_NOT_FOUND.
BD_MUST_CHECK
enum bd_err bd_store_get(const struct bd_store *store, const char *id,
                         const struct bd_store_entry **out, struct bd_fault *fault);
BD_MUST_CHECK
enum bd_err bd_store_remove(struct bd_store *store, const char *id, struct bd_fault *fault);

// In order of addition. The entry of `index`, NULL past the end.
uint32_t bd_store_count(const struct bd_store *store);
const struct bd_store_entry *bd_store_at(const struct bd_store *store, uint32_t index);

#endif
