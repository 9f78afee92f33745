// The flat forms of a scene.
//
// The whole: what the import child answers. The index: the same with heavy objects (streams of
// meshes, pictures, sky maps) named by their SHA-256 (content.h), which is what a journal keeps of
// a snapshot and what the snapshot's own hash is taken of. Empty slots behind the last object of a
// kind are in neither: taking back an addition gives back the hash.
//
// Little-endian, no pointers, no padding, one layout for writing and reading (flat_objects.c
// describes each struct once). They hold what an importer or an edit fills; everything that
// bd_scene_finish derives, and the bounds and hashes of what is read whole, are computed by the
// reader's side, which trusts nothing: each count is checked against the bytes that are left before
// anything is allocated, each enum, index and float before it is kept, and what nodes, materials
// and textures refer to.
//
// Thread: any.

#ifndef BD_SCENE_MODEL_FLAT_H
#define BD_SCENE_MODEL_FLAT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/err.h"
#include "scene/model/scene.h"

// Takes the next bytes of the flat form; false ends the writing.
typedef bool (*bd_flat_sink)(void *user, const void *bytes, size_t size);

// Sinks: behind the last of a struct bd_bytes, false without memory; into a struct bd_sha256.
bool bd_flat_to_bytes(void *user, const void *bytes, size_t size);
bool bd_flat_to_sha256(void *user, const void *bytes, size_t size);

// False if the sink said so. The sink gets pieces of 64 KiB or less, and whole streams.
BD_MUST_CHECK
bool bd_flat_write(const struct bd_scene *scene, bd_flat_sink sink, void *user);

// On success the caller owns an unfinished scene (call bd_scene_finish). On failure
// BD_ERR_BAD_INPUT, and `detail` names the part and the byte offset; or BD_ERR_NO_MEMORY.
BD_MUST_CHECK
enum bd_err bd_flat_read(const void *bytes, size_t size, struct bd_scene **out,
                         struct bd_err_detail *detail);

// The texels of the next picture, in order, for free(); NULL ends the writing.
typedef uint8_t *(*bd_flat_texels)(void *user);

// As bd_flat_write, of a scene whose pictures have sizes and no texels yet: each gets them when its
// turn comes, and loses them again, so that one at a time is held.
BD_MUST_CHECK
bool bd_flat_write_fetching(const struct bd_scene *scene, bd_flat_texels texels, void *texels_user,
                            bd_flat_sink sink, void *user);

// The next `size` bytes; false where there are no more.
typedef bool (*bd_flat_source)(void *user, void *bytes, size_t size);

// As bd_flat_read, while the bytes come: nothing is held twice. `size_max` bounds what a length
// may promise; of a stream that costs address space until the bytes come, of a list nothing. What
// follows the scene is not looked at.
BD_MUST_CHECK
enum bd_err bd_flat_receive(bd_flat_source source, void *user, uint64_t size_max,
                            struct bd_scene **out, struct bd_err_detail *detail);

struct bd_content;
// Finds content of `out->kind` by its SHA-256 and gives a reference to it; false if there is none.
typedef bool (*bd_content_find)(void *user, const uint8_t sha256[32], struct bd_content *out);

// As above, for the index. Its heavy objects have to be sealed.
BD_MUST_CHECK
bool bd_flat_write_index(const struct bd_scene *scene, bd_flat_sink sink, void *user);

// Content that `find` does not find: BD_ERR_NOT_FOUND, and `detail` names it. The scene that is
// read has its content_sha256 set.
BD_MUST_CHECK
enum bd_err bd_flat_read_index(const void *bytes, size_t size, bd_content_find find, void *user,
                               struct bd_scene **out, struct bd_err_detail *detail);

// Sets content_sha256: the SHA-256 of the index.
void bd_scene_set_hash(struct bd_scene *scene);

#endif
