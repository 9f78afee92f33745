#include "tests/journal/powercut_vfs.h"

#include <errno.h>
#include <sqlite3.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "tests/journal/kit.h"

#define SECTOR_BYTES 512
#define FILES_MAX    16
#define NAME_BYTES   256

struct bytes {
    uint8_t *data;
    uint64_t size, room;
};

// One write or truncation that is not on the disk yet.
struct pending {
    bool is_truncation;
    uint64_t at, size; // of a truncation: `at` is the new size
    uint8_t *data;
};

struct disk_file {
    char name[NAME_BYTES]; // "": none
    struct bytes cache, disk;
    struct pending *pending;
    uint32_t pending_count, pending_room;
    bool is_listed;         // it has its name, as programs see it
    bool is_listed_on_disk; // and after a power cut
    int open_count;
};

struct disk_handle {
    sqlite3_file base;
    struct disk_file *file;
    bool syncs_directory; // its first sync does, as SQLite does for a new log
};

static struct {
    struct disk_file files[FILES_MAX];
    uint64_t random;
    uint64_t change_count, cut_at;
    bool is_off, waits_for_sync;
    enum disk_detail detail;
    uint64_t call_count, failed_count, fail_at, fail_count;
} disk;

// --- bytes

static void grow(struct bytes *bytes, uint64_t size)
{
    if (size <= bytes->size) return;
    if (size > bytes->room) {
        bytes->room = 2 * size + 4096;
        bytes->data = realloc(bytes->data, bytes->room);
        BD_ASSERT(bytes->data);
    }
    memset(bytes->data + bytes->size, 0, size - bytes->size);
    bytes->size = size;
}

static void put(struct bytes *bytes, uint64_t at, const uint8_t *data, uint64_t size)
{
    grow(bytes, at + size);
    memcpy(bytes->data + at, data, size);
}

static bool coin(void)
{
    return kit_random(&disk.random) & 1;
}

// Each sector that the write touches, or not.
static void put_torn(struct bytes *bytes, const struct pending *write)
{
    for (uint64_t at = write->at; at < write->at + write->size;) {
        uint64_t end = (at / SECTOR_BYTES + 1) * SECTOR_BYTES;
        if (end > write->at + write->size) end = write->at + write->size;
        if (coin()) put(bytes, at, write->data + (at - write->at), end - at);
        at = end;
    }
}

static void apply(struct disk_file *file, const struct pending *change)
{
    if (!change->is_truncation)
        put(&file->disk, change->at, change->data, change->size);
    else if (change->at < file->disk.size)
        file->disk.size = change->at;
    else
        grow(&file->disk, change->at);
}

// What a power cut or a failed sync makes of one change: kept, dropped or torn.
static void apply_by_chance(struct disk_file *file, const struct pending *change, uint32_t bias)
{
    uint32_t chance = bias == 3 ? kit_random(&disk.random) % 3 : bias;
    if (chance == 0)
        apply(file, change);
    else if (chance == 1 && !change->is_truncation)
        put_torn(&file->disk, change);
}

static void forget_pending(struct disk_file *file)
{
    for (uint32_t i = 0; i < file->pending_count; i++) free(file->pending[i].data);
    file->pending_count = 0;
}

static void settle_by_chance(struct disk_file *file)
{
    // Everything kept, torn or dropped alike now and then: mixtures alone never show those.
    uint32_t bias = kit_random(&disk.random) % 6;
    if (bias > 3) bias = 3;
    for (uint32_t i = 0; i < file->pending_count; i++)
        apply_by_chance(file, &file->pending[i], bias);
    forget_pending(file);
}

static void remember(struct disk_file *file, struct pending change, const uint8_t *data)
{
    if (file->pending_count == file->pending_room) {
        file->pending_room = 2 * file->pending_room + 64;
        file->pending = realloc(file->pending, file->pending_room * sizeof *file->pending);
        BD_ASSERT(file->pending);
    }
    if (data) {
        change.data = malloc(change.size ? change.size : 1);
        BD_ASSERT(change.data);
        memcpy(change.data, data, change.size);
    }
    file->pending[file->pending_count++] = change;
}

static void wipe(struct disk_file *file)
{
    forget_pending(file);
    free(file->pending);
    free(file->cache.data);
    free(file->disk.data);
    *file = (struct disk_file){0};
}

// --- power and faults

static void copy_back(struct disk_file *file)
{
    file->cache.size = 0;
    grow(&file->cache, file->disk.size);
    if (file->disk.size) memcpy(file->cache.data, file->disk.data, file->disk.size);
}

// A name that was deleted and made anew since the directory was synced is one of the two.
static void settle_twins(void)
{
    for (int i = 0; i < FILES_MAX; i++)
        for (int j = 0; j < i; j++) {
            struct disk_file *a = &disk.files[i], *b = &disk.files[j];
            if (!a->is_listed || !b->is_listed || strcmp(a->name, b->name) != 0) continue;
            struct disk_file *gone = coin() ? a : b;
            gone->is_listed = gone->is_listed_on_disk = false;
        }
}

void disk_cut_power(void)
{
    for (int i = 0; i < FILES_MAX; i++) {
        struct disk_file *file = &disk.files[i];
        if (!file->name[0]) continue;
        settle_by_chance(file);
        if (file->is_listed != file->is_listed_on_disk && coin())
            file->is_listed_on_disk = file->is_listed;
        file->is_listed = file->is_listed_on_disk;
        copy_back(file);
    }
    settle_twins();
    disk.is_off = true;
    disk.cut_at = 0;
}

// True if the call goes through.
static bool count_change(bool is_sync)
{
    disk.change_count++;
    if (disk.cut_at > 1)
        disk.cut_at--;
    else if (disk.cut_at == 1 && (is_sync || !disk.waits_for_sync))
        disk_cut_power();
    return !disk.is_off;
}

// True if the call fails.
static bool count_call(bool is_write)
{
    if (disk.is_off) return true;
    disk.call_count++;
    if (disk.detail == DISK_FAULT_NONE || disk.call_count < disk.fail_at) return false;
    if (disk.detail == DISK_FAULT_FULL && !is_write) return false;
    if (disk.fail_count && disk.failed_count >= disk.fail_count) return false;
    disk.failed_count++;
    return true;
}

void disk_cut_power_at(uint64_t at, bool waits_for_sync)
{
    disk.waits_for_sync = waits_for_sync;
    disk.cut_at = at;
}

bool disk_has_power(void)
{
    return !disk.is_off;
}

void disk_restore_power(void)
{
    for (int i = 0; i < FILES_MAX; i++) {
        BD_ASSERT_CMP(disk.files[i].open_count, ==, 0);
        if (disk.files[i].name[0] && !disk.files[i].is_listed) wipe(&disk.files[i]);
    }
    disk.is_off = false;
    disk.cut_at = 0;
}

void disk_fail_at(enum disk_detail detail, uint64_t at, uint64_t count)
{
    disk.detail = detail;
    disk.call_count = disk.failed_count = 0;
    disk.fail_at = at;
    disk.fail_count = count;
}

uint64_t disk_call_count(void)
{
    return disk.call_count;
}

uint64_t disk_failed_count(void)
{
    return disk.failed_count;
}

uint64_t disk_change_count(void)
{
    return disk.change_count;
}

void disk_format(uint64_t seed)
{
    for (int i = 0; i < FILES_MAX; i++) wipe(&disk.files[i]);
    memset(&disk, 0, sizeof disk);
    disk.random = seed * 0x9e3779b97f4a7c15u + 1;
}

static struct disk_file *find_file(const char *name)
{
    for (int i = 0; i < FILES_MAX; i++)
        if (disk.files[i].is_listed && strcmp(disk.files[i].name, name) == 0) return &disk.files[i];
    return NULL;
}

static struct disk_file *find_by_end(const char *name_end)
{
    for (int i = 0; i < FILES_MAX; i++) {
        size_t length = strlen(disk.files[i].name), end = strlen(name_end);
        if (disk.files[i].is_listed && length >= end &&
            strcmp(disk.files[i].name + length - end, name_end) == 0)
            return &disk.files[i];
    }
    return NULL;
}

bool disk_flip_bit(const char *name_end, uint64_t byte, int bit)
{
    struct disk_file *file = find_by_end(name_end);
    if (!file || byte >= file->cache.size || byte >= file->disk.size) return false;
    file->cache.data[byte] ^= (uint8_t)(1 << bit);
    file->disk.data[byte] ^= (uint8_t)(1 << bit);
    return true;
}

bool disk_lose_file(const char *name_end)
{
    struct disk_file *file = find_by_end(name_end);
    if (!file || file->open_count || file->cache.size == 0) return false;
    wipe(file);
    return true;
}

uint64_t disk_file_size(const char *name_end)
{
    struct disk_file *file = find_by_end(name_end);
    return file ? file->cache.size : 0;
}

// --- files

static int err_of(int io)
{
    return disk.detail == DISK_FAULT_FULL && !disk.is_off ? SQLITE_FULL : io;
}

static int file_close(sqlite3_file *base)
{
    struct disk_handle *handle = (struct disk_handle *)base;
    struct disk_file *file = handle->file;
    if (--file->open_count == 0 && !file->is_listed && !file->is_listed_on_disk) wipe(file);
    return SQLITE_OK;
}

static int file_read(sqlite3_file *base, void *out, int size, sqlite3_int64 at)
{
    const struct bytes *cache = &((struct disk_handle *)base)->file->cache;
    if (count_call(false)) return SQLITE_IOERR_READ;
    uint64_t there = (uint64_t)at < cache->size ? cache->size - (uint64_t)at : 0;
    uint64_t copied = there < (uint64_t)size ? there : (uint64_t)size;
    if (copied) memcpy(out, cache->data + at, copied);
    if (copied == (uint64_t)size) return SQLITE_OK;
    memset((char *)out + copied, 0, (size_t)size - copied);
    return SQLITE_IOERR_SHORT_READ;
}

static int file_write(sqlite3_file *base, const void *data, int size, sqlite3_int64 at)
{
    struct disk_file *file = ((struct disk_handle *)base)->file;
    struct pending write = {.at = (uint64_t)at, .size = (uint64_t)size};
    if (disk.is_off) return SQLITE_IOERR_WRITE;
    if (count_call(true)) {
        // A part of it may have gone through.
        write.size =
            (write.size / SECTOR_BYTES) * (kit_random(&disk.random) % 3) / 2 * SECTOR_BYTES;
        if (write.size) put(&file->cache, write.at, data, write.size);
        if (write.size) remember(file, write, data);
        return err_of(SQLITE_IOERR_WRITE);
    }
    put(&file->cache, write.at, data, write.size);
    remember(file, write, data);
    return count_change(false) ? SQLITE_OK : SQLITE_IOERR_WRITE;
}

static int file_truncate(sqlite3_file *base, sqlite3_int64 size)
{
    struct disk_file *file = ((struct disk_handle *)base)->file;
    if (count_call(false)) return SQLITE_IOERR_TRUNCATE;
    remember(file, (struct pending){.is_truncation = true, .at = (uint64_t)size}, NULL);
    if ((uint64_t)size < file->cache.size) file->cache.size = (uint64_t)size;
    grow(&file->cache, (uint64_t)size);
    return count_change(false) ? SQLITE_OK : SQLITE_IOERR_TRUNCATE;
}

static void sync_directory(void)
{
    for (int i = 0; i < FILES_MAX; i++) disk.files[i].is_listed_on_disk = disk.files[i].is_listed;
}

static int file_sync(sqlite3_file *base, int flags)
{
    struct disk_handle *handle = (struct disk_handle *)base;
    (void)flags;
    if (disk.is_off) return SQLITE_IOERR_FSYNC;
    if (count_call(true)) {
        settle_by_chance(handle->file);
        return SQLITE_IOERR_FSYNC;
    }
    if (!count_change(true)) return SQLITE_IOERR_FSYNC;
    for (uint32_t i = 0; i < handle->file->pending_count; i++)
        apply(handle->file, &handle->file->pending[i]);
    forget_pending(handle->file);
    if (handle->syncs_directory) sync_directory();
    handle->syncs_directory = false;
    return SQLITE_OK;
}

static int file_size(sqlite3_file *base, sqlite3_int64 *size)
{
    if (count_call(false)) return SQLITE_IOERR_FSTAT;
    *size = (sqlite3_int64)((struct disk_handle *)base)->file->cache.size;
    return SQLITE_OK;
}

static int file_lock(sqlite3_file *base, int level)
{
    (void)base;
    (void)level;
    return SQLITE_OK;
}

static int file_is_reserved(sqlite3_file *base, int *out)
{
    (void)base;
    *out = 0;
    return SQLITE_OK;
}

static int file_control(sqlite3_file *base, int what, void *argument)
{
    (void)base;
    (void)what;
    (void)argument;
    return SQLITE_NOTFOUND;
}

static int file_sector_size(sqlite3_file *base)
{
    (void)base;
    return 4096;
}

static int file_characteristics(sqlite3_file *base)
{
    (void)base;
    return SQLITE_IOCAP_POWERSAFE_OVERWRITE;
}

static const sqlite3_io_methods methods = {
    .iVersion = 1, // no shared memory
    .xClose = file_close,
    .xRead = file_read,
    .xWrite = file_write,
    .xTruncate = file_truncate,
    .xSync = file_sync,
    .xFileSize = file_size,
    .xLock = file_lock,
    .xUnlock = file_lock,
    .xCheckReservedLock = file_is_reserved,
    .xFileControl = file_control,
    .xSectorSize = file_sector_size,
    .xDeviceCharacteristics = file_characteristics,
};

// --- the file system

static struct disk_file *make_file(const char *name)
{
    for (int i = 0; i < FILES_MAX; i++) {
        struct disk_file *file = &disk.files[i];
        if (file->name[0]) continue;
        snprintf(file->name, sizeof file->name, "%s", name);
        file->is_listed = true;
        return file;
    }
    return NULL;
}

static int vfs_open(sqlite3_vfs *vfs, const char *name, sqlite3_file *base, int flags,
                    int *out_flags)
{
    (void)vfs;
    struct disk_handle *handle = (struct disk_handle *)base;
    *handle = (struct disk_handle){0};
    BD_ASSERT(name); // temporary files would be a surprise
    struct disk_file *file = find_file(name);
    bool is_new = !file && (flags & SQLITE_OPEN_CREATE);
    if (count_call(is_new) || (is_new && !count_change(false))) return SQLITE_CANTOPEN;
    if (is_new) file = make_file(name);
    if (!file) return SQLITE_CANTOPEN;
    file->open_count++;
    handle->base.pMethods = &methods;
    handle->file = file;
    handle->syncs_directory =
        (flags & SQLITE_OPEN_CREATE) &&
        (flags & (SQLITE_OPEN_WAL | SQLITE_OPEN_MAIN_JOURNAL | SQLITE_OPEN_SUPER_JOURNAL));
    if (out_flags) *out_flags = flags;
    return SQLITE_OK;
}

static int vfs_delete(sqlite3_vfs *vfs, const char *name, int syncs_directory)
{
    (void)vfs;
    if (count_call(true)) return SQLITE_IOERR_DELETE;
    if (!count_change(false)) return SQLITE_IOERR_DELETE;
    struct disk_file *file = find_file(name);
    if (!file) return SQLITE_IOERR_DELETE_NOENT;
    file->is_listed = false;
    if (syncs_directory) sync_directory();
    if (!file->open_count && !file->is_listed_on_disk) wipe(file);
    return SQLITE_OK;
}

static int vfs_access(sqlite3_vfs *vfs, const char *name, int flags, int *out)
{
    (void)vfs;
    (void)flags;
    if (count_call(false)) return SQLITE_IOERR_ACCESS;
    struct disk_file *file = find_file(name);
    // As SQLite's own: an empty file counts as none.
    *out = file && (flags != SQLITE_ACCESS_EXISTS || file->cache.size > 0);
    return SQLITE_OK;
}

static int vfs_full_path(sqlite3_vfs *vfs, const char *name, int size, char *out)
{
    (void)vfs;
    sqlite3_snprintf(size, out, "%s", name);
    return SQLITE_OK;
}

static int vfs_randomness(sqlite3_vfs *vfs, int size, char *out)
{
    (void)vfs;
    for (int i = 0; i < size; i++) out[i] = (char)(i * 37 + 11);
    return size;
}

static int vfs_sleep(sqlite3_vfs *vfs, int microseconds)
{
    (void)vfs;
    return microseconds;
}

static int vfs_time(sqlite3_vfs *vfs, double *out)
{
    (void)vfs;
    *out = 2460000.5;
    return SQLITE_OK;
}

static int vfs_last_error(sqlite3_vfs *vfs, int size, char *out)
{
    (void)vfs;
    if (size > 0) out[0] = 0;
    return disk.detail == DISK_FAULT_FULL ? ENOSPC : EIO;
}

void disk_register(void)
{
    static sqlite3_vfs vfs = {
        .iVersion = 1,
        .szOsFile = sizeof(struct disk_handle),
        .mxPathname = NAME_BYTES - 8,
        .zName = "powercut",
        .xOpen = vfs_open,
        .xDelete = vfs_delete,
        .xAccess = vfs_access,
        .xFullPathname = vfs_full_path,
        .xRandomness = vfs_randomness,
        .xSleep = vfs_sleep,
        .xCurrentTime = vfs_time,
        .xGetLastError = vfs_last_error,
    };
    int result = sqlite3_vfs_register(&vfs, 1);
    BD_ASSERT_CMP(result, ==, SQLITE_OK);
}
