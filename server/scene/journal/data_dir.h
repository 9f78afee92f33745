// The data directory: made if need be, for its owner alone, and held by one daemon at a time.
//
// Thread: any, one at a time.

#ifndef BD_SCENE_JOURNAL_DATA_DIR_H
#define BD_SCENE_JOURNAL_DATA_DIR_H

#include <stdbool.h>

#include "base/err.h"

struct bd_data_dir {
    char path[4096];
    int lock; // held for as long as it is open
    bool is_temporary;
};

// `path` NULL: $XDG_DATA_HOME/bounced or ~/.local/share/bounced. Made with mode 0700, parents too;
// one that others may enter is refused. BD_ERR_CONFLICT if another daemon holds it.
BD_MUST_CHECK
enum bd_err bd_data_dir_open(const char *path, struct bd_data_dir *out,
                             struct bd_err_detail *detail);

// A new one that nobody knows, gone with bd_data_dir_close.
BD_MUST_CHECK
enum bd_err bd_data_dir_open_temporary(struct bd_data_dir *out, struct bd_err_detail *detail);

void bd_data_dir_close(struct bd_data_dir *dir);

#endif
