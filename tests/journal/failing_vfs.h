// SQLite's own file layer, on real files, whose calls can be made to fail: for what also links and
// renames files, which the disk of powercut_vfs.h knows nothing of. What it syncs, it does not.
//
// Thread: one.

#ifndef BD_TESTS_JOURNAL_FAILING_VFS_H
#define BD_TESTS_JOURNAL_FAILING_VFS_H

#include <stdint.h>

#include "tests/journal/powercut_vfs.h"

// The default VFS of this process from now on.
void failing_register(void);

// As disk_fail_at, disk_call_count and disk_failed_count.
void failing_at(enum disk_detail detail, uint64_t at, uint64_t count);
uint64_t failing_call_count(void);
uint64_t failing_failed_count(void);

#endif
