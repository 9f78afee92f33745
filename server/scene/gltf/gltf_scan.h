// The scan that comes before any parser: is this container and this JSON fit to be parsed?
//
// Without recursion and without allocation beyond one copy of the file. It refuses what is known to
// hurt parsers (nesting, invalid UTF-8, numbers out of range, more values than the file's size
// justifies), checks types and presence of every property that is read later (gltf_schema.c), so
// that errors name a JSON path, and takes out of the copy what nobody reads (animations, extras,
// unknown extensions), so that what we do not read, tinygltf does not see.
//
// Thread: any; runs in the import child.

#ifndef BD_SCENE_GLTF_GLTF_SCAN_H
#define BD_SCENE_GLTF_GLTF_SCAN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/err.h"

#define BD_GLTF_NESTING_MAX 64

// A copy of the file, to be parsed. Free it in any case.
struct bd_gltf_text {
    uint8_t *bytes;
    size_t size;
    bool is_glb;
    bool is_scanned;                // the scan came to its end
    bool has_scene;                 // a scene, or at least nodes to be shown without one
    uint32_t dataless_buffer_count; // legal buffers without uri: their bytes are all zero here
    char min_version[8]; // asset.minVersion where it is above 2.0: read anyway, and flagged
};

BD_MUST_CHECK
enum bd_err bd_gltf_scan(const void *bytes, size_t size, struct bd_gltf_text *out,
                         struct bd_err_detail *detail);
void bd_gltf_text_free(struct bd_gltf_text *text);

#endif
