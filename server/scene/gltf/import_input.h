// What an import is given: files, and what it may take. For the import and for who parses in it.
//
// Thread: any.

#ifndef BD_SCENE_GLTF_IMPORT_INPUT_H
#define BD_SCENE_GLTF_IMPORT_INPUT_H

#include <stddef.h>
#include <stdint.h>

// One file of the table that the client resolved. Borrowed for the duration of the call.
struct bd_import_file {
    const char *uri; // as written in the .gltf; for the main file its name, for messages only
    const void *bytes;
    size_t size_bytes;
};

struct bd_import_limits {
    uint64_t memory_bytes;        // the child's data segment
    uint32_t cpu_seconds;         // the child's processor time
    uint32_t wall_seconds;        // then it is killed
    uint64_t scene_bytes;         // the flat form
    uint64_t triangle_count;      // instanced
    uint32_t picture_side_px;     // of one texture picture
    uint64_t picture_texels_kept; // of a scene's pictures together: beyond, the largest are halved
    uint64_t picture_texels;      // of what is left of them: beyond, they are refused
};

#endif
