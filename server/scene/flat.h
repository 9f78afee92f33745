// The flat form of a scene: what the import child answers, and what a scene's content hash names.
//
// Little-endian, no pointers, no padding, one layout for writing and reading (flat.c describes each
// struct once). It holds what an importer fills; everything that bd_scene_finish derives, and the
// bounds and hashes of meshes and pictures, are computed by the reader's side, which trusts
// nothing: each count is checked against the bytes that are left before anything is allocated,
// each enum, index and float before it is kept, and the node hierarchy for loops.
//
// Thread: any.

#ifndef BD_SCENE_FLAT_H
#define BD_SCENE_FLAT_H

#include <stdbool.h>
#include <stddef.h>

#include "base/err.h"
#include "scene/scene.h"

// Takes the next bytes of the flat form; false ends the writing.
typedef bool (*bd_flat_sink)(void *user, const void *bytes, size_t size);

// False if the sink said so. The sink gets pieces of 64 KiB or less, and whole streams.
BD_MUST_CHECK
bool bd_flat_write(const struct bd_scene *scene, bd_flat_sink sink, void *user);

// On success the caller owns an unfinished scene (call bd_scene_finish). On failure
// BD_ERR_BAD_INPUT, and `fault` names the part and the byte offset; or BD_ERR_NO_MEMORY.
BD_MUST_CHECK
enum bd_err bd_flat_read(const void *bytes, size_t size, struct bd_scene **out,
                         struct bd_fault *fault);

#endif
