// The last few imports, by the content that they were made of: four of them, of at most 512 MiB of
// files together.
//
// The same file twice gives the same snapshot, and so everything that the renderer has kept for
// it: a second one-shot render costs no upload and no light-side pass, and leaves nothing new
// behind on the GPU.
//
// Thread: any.

#ifndef BD_NET_COMMAND_IMPORT_CACHE_H
#define BD_NET_COMMAND_IMPORT_CACHE_H

#include <stdint.h>

#include "base/hash.h"
#include "scene/import/import.h"
#include "scene/model/scene.h"

struct bd_import_cache;

struct bd_import_cache *bd_import_cache_create(void);
void bd_import_cache_destroy(struct bd_import_cache **cache);

// Names the files by their uris and bytes, and the environment (or NULL) that they are put under.
void bd_import_cache_key(const struct bd_import_file *files, uint32_t file_count,
                         const struct bd_environment *environment, uint8_t key[BD_SHA256_BYTES]);

// A new reference, or NULL.
struct bd_scene *bd_import_cache_get(struct bd_import_cache *cache,
                                     const uint8_t key[BD_SHA256_BYTES]);
// Takes a reference of its own. Old entries go; a file beyond the cache's size is not kept.
void bd_import_cache_put(struct bd_import_cache *cache, const uint8_t key[BD_SHA256_BYTES],
                         uint64_t file_bytes, struct bd_scene *scene);

#endif
