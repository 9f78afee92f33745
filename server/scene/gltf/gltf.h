// Reads a glTF document into an unfinished scene. Runs in the import child; tests and the fuzzer
// call it in their own process.
//
// Thread: any.

#ifndef BD_SCENE_GLTF_GLTF_H
#define BD_SCENE_GLTF_GLTF_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/err.h"
#include "scene/gltf/gltf_shim.h"
#include "scene/gltf/import_input.h"
#include "scene/model/scene.h"

// files[0] is the .gltf or .glb; its bytes are copied, the others' are only read. On success the
// caller owns the scene (bd_scene_finish is still to be called). On failure `detail` names the JSON
// path or the limit.
BD_MUST_CHECK
enum bd_err bd_gltf_read(const struct bd_import_file *files, uint32_t file_count,
                         const struct bd_import_limits *limits, struct bd_scene **out,
                         struct bd_err_detail *detail);

struct bd_picture_queue;

// The same, for whoever only passes it on: without bounds and hashes, and with pictures that have
// sizes and no texels, which come out of `pictures` (picture_queue.h) one by one. That lives no
// longer than the document and the files, so destroy it before
// `document`, which is the caller's either way (bd_gltf_document_destroy).
BD_MUST_CHECK
enum bd_err bd_gltf_read_waiting(const struct bd_import_file *files, uint32_t file_count,
                                 const struct bd_import_limits *limits,
                                 struct bd_picture_queue *pictures,
                                 struct bd_gltf_document **document, struct bd_scene **out,
                                 struct bd_err_detail *detail);

#endif
