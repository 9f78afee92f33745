#include "tests/journal/failing_vfs.h"

#include <sqlite3.h>
#include <stddef.h>

#include "base/assert.h"

// SQLite's own file lies behind it.
struct failing_file {
    sqlite3_file base;
};

static struct {
    sqlite3_vfs *own;
    enum disk_detail detail;
    uint64_t call_count, failed_count, fail_at, fail_count;
} failing;

void failing_at(enum disk_detail detail, uint64_t at, uint64_t count)
{
    failing.detail = detail;
    failing.call_count = failing.failed_count = 0;
    failing.fail_at = at;
    failing.fail_count = count;
}

uint64_t failing_call_count(void)
{
    return failing.call_count;
}

uint64_t failing_failed_count(void)
{
    return failing.failed_count;
}

// SQLITE_OK if the call goes through.
static int count_call(bool is_write, int io)
{
    failing.call_count++;
    if (failing.detail == DISK_FAULT_NONE || failing.call_count < failing.fail_at) return SQLITE_OK;
    if (failing.detail == DISK_FAULT_FULL && !is_write) return SQLITE_OK;
    if (failing.fail_count && failing.failed_count >= failing.fail_count) return SQLITE_OK;
    failing.failed_count++;
    return failing.detail == DISK_FAULT_FULL ? SQLITE_FULL : io;
}

// --- files

static sqlite3_file *own_of(sqlite3_file *file)
{
    return (sqlite3_file *)((struct failing_file *)file + 1);
}

static int file_close(sqlite3_file *file)
{
    return own_of(file)->pMethods->xClose(own_of(file));
}

static int file_read(sqlite3_file *file, void *out, int size, sqlite3_int64 at)
{
    int result = count_call(false, SQLITE_IOERR_READ);
    return result ? result : own_of(file)->pMethods->xRead(own_of(file), out, size, at);
}

static int file_write(sqlite3_file *file, const void *data, int size, sqlite3_int64 at)
{
    int result = count_call(true, SQLITE_IOERR_WRITE);
    return result ? result : own_of(file)->pMethods->xWrite(own_of(file), data, size, at);
}

static int file_truncate(sqlite3_file *file, sqlite3_int64 size)
{
    int result = count_call(false, SQLITE_IOERR_TRUNCATE);
    return result ? result : own_of(file)->pMethods->xTruncate(own_of(file), size);
}

static int file_sync(sqlite3_file *file, int flags)
{
    (void)file;
    (void)flags;
    return count_call(true, SQLITE_IOERR_FSYNC);
}

static int file_size(sqlite3_file *file, sqlite3_int64 *size)
{
    int result = count_call(false, SQLITE_IOERR_FSTAT);
    return result ? result : own_of(file)->pMethods->xFileSize(own_of(file), size);
}

static int file_lock(sqlite3_file *file, int level)
{
    return own_of(file)->pMethods->xLock(own_of(file), level);
}

static int file_unlock(sqlite3_file *file, int level)
{
    return own_of(file)->pMethods->xUnlock(own_of(file), level);
}

static int file_is_reserved(sqlite3_file *file, int *out)
{
    return own_of(file)->pMethods->xCheckReservedLock(own_of(file), out);
}

static int file_control(sqlite3_file *file, int what, void *argument)
{
    return own_of(file)->pMethods->xFileControl(own_of(file), what, argument);
}

static int file_sector_size(sqlite3_file *file)
{
    return own_of(file)->pMethods->xSectorSize(own_of(file));
}

static int file_characteristics(sqlite3_file *file)
{
    return own_of(file)->pMethods->xDeviceCharacteristics(own_of(file));
}

static const sqlite3_io_methods methods = {
    .iVersion = 1, // no shared memory, no mapping
    .xClose = file_close,
    .xRead = file_read,
    .xWrite = file_write,
    .xTruncate = file_truncate,
    .xSync = file_sync,
    .xFileSize = file_size,
    .xLock = file_lock,
    .xUnlock = file_unlock,
    .xCheckReservedLock = file_is_reserved,
    .xFileControl = file_control,
    .xSectorSize = file_sector_size,
    .xDeviceCharacteristics = file_characteristics,
};

// --- the file system

static int vfs_open(sqlite3_vfs *vfs, const char *name, sqlite3_file *file, int flags,
                    int *out_flags)
{
    (void)vfs;
    file->pMethods = NULL;
    int result = count_call(flags & SQLITE_OPEN_CREATE, SQLITE_CANTOPEN);
    if (!result) result = failing.own->xOpen(failing.own, name, own_of(file), flags, out_flags);
    if (!result) file->pMethods = &methods;
    return result;
}

static int vfs_delete(sqlite3_vfs *vfs, const char *name, int syncs_directory)
{
    (void)vfs;
    (void)syncs_directory;
    int result = count_call(true, SQLITE_IOERR_DELETE);
    return result ? result : failing.own->xDelete(failing.own, name, 0);
}

static int vfs_access(sqlite3_vfs *vfs, const char *name, int flags, int *out)
{
    (void)vfs;
    int result = count_call(false, SQLITE_IOERR_ACCESS);
    return result ? result : failing.own->xAccess(failing.own, name, flags, out);
}

void failing_register(void)
{
    static sqlite3_vfs vfs;
    failing.own = sqlite3_vfs_find(NULL);
    BD_ASSERT(failing.own);
    vfs = *failing.own;
    vfs.szOsFile += (int)sizeof(struct failing_file);
    vfs.pNext = NULL;
    vfs.zName = "failing";
    vfs.xOpen = vfs_open;
    vfs.xDelete = vfs_delete;
    vfs.xAccess = vfs_access;
    int result = sqlite3_vfs_register(&vfs, 1);
    BD_ASSERT_CMP(result, ==, SQLITE_OK);
}
