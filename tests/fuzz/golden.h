// A journal with something of everything, written by the store: two scenes, a history with undo,
// redo and revert, names, a snapshot, meshes, a picture and a sky. The same whenever it is made.

#ifndef BD_TESTS_FUZZ_GOLDEN_H
#define BD_TESTS_FUZZ_GOLDEN_H

#include <stdint.h>

#include "base/hash.h"
#include "scene/store/store.h"
#include "tests/journal/files.h"

#define GOLDEN_SCENES        2
#define GOLDEN_REVISIONS_MAX 16

struct golden_scene {
    char id[BD_SCENE_ID_BYTES];
    uint64_t revision;
    uint8_t sha256[GOLDEN_REVISIONS_MAX][BD_SHA256_BYTES]; // by revision, from 1
};

struct golden {
    struct golden_scene scenes[GOLDEN_SCENES];
    struct file_bytes whole;       // the file as it lies there after an orderly end
    struct file_bytes logged, log; // and while it is open, with all of it still in the log
};

// Made at the first call, which may not come between machine_begin and machine_end. Lives as long
// as the process.
const struct golden *golden_get(void);

#endif
