// The wire between import.c and its child. Private to the two.
//
// The child finds its question on descriptor 0, a sealed memory file: a head, then for each file a
// head, its uri with a final zero, its bytes padded to eight. It writes its answer to descriptor
// 1: a head, then the flat form of a scene, or a fault.

#ifndef BD_SCENE_IMPORT_PIPE_H
#define BD_SCENE_IMPORT_PIPE_H

#include <stdint.h>

#include "base/err.h"
#include "scene/import.h"

#define BD_IMPORT_QUESTION_MAGIC 0x31516442u // "BdQ1"
#define BD_IMPORT_ANSWER_MAGIC   0x31416442u // "BdA1"

struct bd_import_question {
    uint32_t magic;
    uint32_t file_count;
    struct bd_import_limits limits;
};

struct bd_import_question_file {
    uint64_t uri_bytes;  // with the final zero
    uint64_t size_bytes; // of the content
};

// After it: the flat form (err BD_ERR_OK), or a struct bd_fault.
struct bd_import_answer {
    uint32_t magic;
    uint32_t err; // enum bd_err
};

// Uris and contents start at multiples of this.
static inline uint64_t bd_import_padded(uint64_t bytes)
{
    return (bytes + 7) & ~(uint64_t)7;
}

#endif
