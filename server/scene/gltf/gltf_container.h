// The container of a .glb, and where the JSON is. Private to gltf_scan.c.

#ifndef BD_SCENE_GLTF_GLTF_CONTAINER_H
#define BD_SCENE_GLTF_GLTF_CONTAINER_H

#include "scene/gltf/gltf_scan.h"

struct bd_gltf_json_range {
    size_t offset, size_bytes;
};

// Checks header and chunks, and cuts off what tinygltf would stumble over: an empty BIN chunk, and
// chunks of unknown type, which the specification says to ignore. A .gltf is all JSON.
BD_MUST_CHECK
enum bd_err bd_gltf_open_container(struct bd_gltf_text *text, struct bd_gltf_json_range *json,
                                   struct bd_err_detail *detail);

// Makes a .glb of a .gltf, with a BIN chunk of zeros: tinygltf reads buffers without uri from
// there.
BD_MUST_CHECK
enum bd_err bd_gltf_wrap(struct bd_gltf_text *text, size_t zero_bytes,
                         struct bd_err_detail *detail);

#endif
