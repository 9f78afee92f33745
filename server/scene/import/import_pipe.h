// The wire between the import's parent and its child. Private to the files import*.c.
//
// The child finds its question on descriptor 0, a memory file that is empty until a byte comes on
// descriptor 3, and sealed then: a head, then for each file a head, its uri with a final zero, its
// bytes padded to eight. Where descriptor 3 ends without a byte, there is nothing to do. It writes
// its answer to descriptor 1, in pieces, each with a head: those of a body, then an end or an
// error.

#ifndef BD_SCENE_IMPORT_IMPORT_PIPE_H
#define BD_SCENE_IMPORT_IMPORT_PIPE_H

#include <stdint.h>

#include "base/err.h"
#include "scene/import/import.h"

#define BD_IMPORT_QUESTION_MAGIC 0x32516442u // "BdQ2"
#define BD_IMPORT_PIECE_MAGIC    0x32416442u // "BdA2"

#define BD_IMPORT_GO_FD 3

// How a child ends that gives no answer.
enum bd_import_exit {
    BD_IMPORT_EXIT_QUESTION = 2, // what it was asked could not be read
    BD_IMPORT_EXIT_CONFINE = 3,  // it could not be confined, and so read nothing
    BD_IMPORT_EXIT_UNSENT = 4,   // the answer was not taken
    BD_IMPORT_EXIT_UNSTARTED = 127,
};

enum bd_import_kind {
    BD_IMPORT_SCENE,   // the body is the flat form of a scene
    BD_IMPORT_PICTURE, // one file; the content of a picture
    BD_IMPORT_SKY_MAP, // one file; a uint64_t (negative texels), then the content of a sky map
};

struct bd_import_question {
    uint32_t magic;
    uint32_t kind; // enum bd_import_kind
    uint32_t file_count;
    uint32_t reserved;
    struct bd_import_limits limits;
};

struct bd_import_question_file {
    uint64_t uri_bytes;  // with the final zero
    uint64_t size_bytes; // of the content
};

enum bd_import_piece_kind {
    BD_IMPORT_BODY,
    BD_IMPORT_END,   // nothing follows
    BD_IMPORT_FAULT, // a struct bd_err_detail, and nothing after it; what came of the body is void
};

struct bd_import_piece {
    uint32_t magic;
    uint32_t kind; // enum bd_import_piece_kind
    uint64_t size_bytes;
};

// Uris and contents start at multiples of this.
static inline uint64_t bd_import_padded(uint64_t bytes)
{
    return (bytes + 7) & ~(uint64_t)7;
}

#endif
