// A child's answer, read while it comes: pieces (import_pipe.h), under a wall clock and a limit of
// bytes. What the child says about lengths costs nothing until the bytes are here. Private to the
// files import*.c.
//
// Thread: whoever owns the struct.

#ifndef BD_SCENE_IMPORT_IMPORT_ANSWER_H
#define BD_SCENE_IMPORT_IMPORT_ANSWER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/err.h"

// How an answer ended.
enum bd_import_verdict {
    BD_IMPORT_OPEN,    // it has not
    BD_IMPORT_WHOLE,   // as it should
    BD_IMPORT_REFUSED, // with `detail`
    BD_IMPORT_CUT,     // the pipe ended
    BD_IMPORT_DAMAGED, // this is no answer
    BD_IMPORT_LATE,    // the wall clock ran out
    BD_IMPORT_LONG,    // more bytes than there may be
};

struct bd_import_answer {
    int fd;
    uint64_t start_ns;
    uint32_t wall_seconds;
    uint64_t bytes_left; // that the body may still have
    uint64_t piece_left; // of the piece under way
    enum bd_import_verdict verdict;
    bool has_body; // some of it came
    struct bd_err_detail detail;
    size_t at, filled;
    uint8_t buffer[65536]; // last: it is not set to anything
};

void bd_import_answer_begin(struct bd_import_answer *answer, int fd, uint64_t start_ns,
                            uint32_t wall_seconds, uint64_t most_bytes);

// A bd_flat_source: the next bytes of the body. False where it is over.
bool bd_import_answer_body(void *answer, void *bytes, size_t size);

// Behind the last byte of the body: reads the end, or what else there is.
void bd_import_answer_end(struct bd_import_answer *answer);

#endif
