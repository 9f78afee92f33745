// Import: glTF bytes in, a scene out, through a child process that can do nothing else.
//
// The parser of strangers' files runs in `bounced --import`, with limits on memory and time and
// a seccomp filter; it gets the files as inherited descriptors and answers on one pipe in our own
// flat form (scene/flat.h), which the parent reads with bounds checks. One code path for client,
// daemon and tests.
//
// Thread: any but the event loop (it blocks); several at once are fine.

#ifndef BD_SCENE_IMPORT_H
#define BD_SCENE_IMPORT_H

#include <stddef.h>
#include <stdint.h>

#include "base/err.h"
#include "scene/scene.h"

// One file of the table that the client resolved. Borrowed for the duration of the call.
struct bd_import_file {
    const char *uri; // as written in the .gltf; for the main file its name, for messages only
    const void *bytes;
    size_t size_bytes;
};

struct bd_import_limits {
    uint64_t memory_bytes;      // the child's data segment
    uint32_t cpu_seconds;       // the child's processor time
    uint32_t wall_seconds;      // then it is killed
    uint64_t scene_bytes;       // the flat form
    uint64_t triangle_count;    // instanced
    uint32_t picture_side_px;   // of one texture picture
    uint64_t picture_texels;    // of all pictures together
};

extern const struct bd_import_limits bd_import_default_limits;

// Reads files[0], a .glb or .gltf, with the rest as what its uris mean. `program` is the path of
// the bounced binary (NULL: this very program, /proc/self/exe). On success the caller owns one
// reference to a finished scene. On failure `fault` names the JSON path or the limit.
BD_MUST_CHECK
enum bd_err bd_import(const char *program, const struct bd_import_file *files, uint32_t file_count,
                      const struct bd_import_limits *limits, struct bd_scene **out,
                      struct bd_fault *fault);

// The same under an environment (or NULL for none), which belongs to the snapshot and its hash; its
// map gets a reference of the scene's own.
BD_MUST_CHECK
enum bd_err bd_import_under(const char *program, const struct bd_import_file *files,
                            uint32_t file_count, const struct bd_import_limits *limits,
                            const struct bd_environment *environment, struct bd_scene **out,
                            struct bd_fault *fault);

// The child's whole life: `bounced --import` ends with this. Returns the exit status.
int bd_import_child_main(int argc, char **argv);

#endif
