// The children of an import, from their start to their death. Private to the files import*.c.
//
// Thread: any; a child belongs to one thread at a time.

#ifndef BD_SCENE_IMPORT_IMPORT_POOL_H
#define BD_SCENE_IMPORT_IMPORT_POOL_H

#include <stdbool.h>
#include <stdint.h>
#include <sys/types.h>

#include "base/err.h"
#include "scene/import/import_pipe.h"

struct bd_import_child {
    pid_t pid;
    int question;  // the memory file
    int go;        // a byte, and it begins
    int answer;    // the pipe
    bool is_spare; // it has waited
    bool was_told; // to go
};

// A child that waits, or a new one. `is_small`: others like it may come soon, so spares are kept.
BD_MUST_CHECK
enum bd_err bd_import_child_take(struct bd_import_pool *pool, bool is_small,
                                 struct bd_import_child *out, struct bd_err_detail *detail);

// Hands over the question and says go. False without memory for it, errno set.
BD_MUST_CHECK
bool bd_import_child_ask(struct bd_import_child *child, const struct bd_import_question *question,
                         const struct bd_import_file *files);

struct bd_import_end {
    int status; // of waitpid
    double cpu_seconds;
    bool was_late;  // it had until the wall clock ran out
    bool has_begun; // it took the question
};

// Waits for the child's end, which `kills` brings at once, and closes what is left of it. Its
// answer may have ended before it did.
void bd_import_child_reap(struct bd_import_child *child, bool kills, uint64_t start_ns,
                          uint32_t wall_seconds, struct bd_import_end *out);

#endif
