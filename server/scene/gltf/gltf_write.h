// Export: a snapshot as one self-contained .glb, glTF 2.0.
//
// What is written is what the importer reads, so that an import of it is the same scene: the same
// bytes of every stream, texel, matrix and factor, hence the same content hash, and the same again
// when that is exported. What differs is told in `notes`, each with a count: what glTF cannot hold,
// and what the importer would leave out (README.md has the list). Ids are not kept where
// objects were removed, and flags of an earlier import are not either: what was repaired is whole.
//
// Thread: any but the event loop: pictures are compressed, some 20 MiB of texels a second.

#ifndef BD_SCENE_GLTF_GLTF_WRITE_H
#define BD_SCENE_GLTF_GLTF_WRITE_H

#include <stdint.h>

#include "base/err.h"
#include "image/bytes.h"
#include "scene/model/scene.h"

// A .glb says its own length in 32 bits.
#define BD_GLB_BYTES_MAX UINT32_MAX

// `scene` is finished and sealed; its default rig is not written. On success `*out`, which has to
// be empty, is the file, to be freed with bd_bytes_finish, and `notes` are added to. The same
// snapshot gives the same bytes. BD_ERR_LIMIT if the file would have more than `bytes_max` (at most
// BD_GLB_BYTES_MAX); BD_ERR_NO_MEMORY.
BD_MUST_CHECK
enum bd_err bd_gltf_write(const struct bd_scene *scene, uint64_t bytes_max, struct bd_bytes *out,
                          struct bd_scene_flags *notes, struct bd_err_detail *detail);

#endif
