#include "scene/blobs/blobs.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include "base/assert.h"
#include "base/log.h"
#include "scene/blobs/blobs_internal.h"

enum bd_err bd_blobs_err(struct bd_err_detail *detail, const char *what)
{
    enum bd_err err =
        errno == ENOSPC || errno == EDQUOT || errno == ENOMEM ? BD_ERR_NO_MEMORY : BD_ERR_IO;
    return bd_err_set(detail, err, "data", "%s: %s", what, strerror(errno));
}

// --- handles --------------------------------------------------------------------------------

static void remove_unfinished(int directory)
{
    int copy = openat(directory, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    DIR *list = copy < 0 ? NULL : fdopendir(copy);
    if (!list) {
        if (copy >= 0) close(copy);
        return;
    }
    for (struct dirent *entry; (entry = readdir(list));)
        if (strncmp(entry->d_name, BD_BLOBS_UPLOAD_PREFIX, strlen(BD_BLOBS_UPLOAD_PREFIX)) == 0)
            unlinkat(directory, entry->d_name, 0);
    closedir(list);
}

static struct bd_blobs *add_handle(struct bd_blobs_base *base, const char *marks, bool finds_all)
{
    struct bd_blobs *blobs = calloc(1, sizeof *blobs);
    BD_ASSERT(blobs);
    blobs->base = base;
    blobs->finds_all = finds_all;
    snprintf(blobs->marks, sizeof blobs->marks, "%s", marks);
    blobs->next = base->handles;
    base->handles = blobs;
    return blobs;
}

enum bd_err bd_blobs_open(const char *directory, struct bd_blobs **out,
                          struct bd_err_detail *detail)
{
    char path[4096];
    int length = snprintf(path, sizeof path, "%s/blobs", directory);
    if (length < 0 || (size_t)length >= sizeof path)
        return bd_err_set(detail, BD_ERR_USAGE, "data", "the data directory's path is too long");
    if (mkdir(path, 0700) < 0 && errno != EEXIST) return bd_blobs_err(detail, path);
    int fd = open(path, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    if (fd < 0) return bd_blobs_err(detail, path);
    struct bd_blobs_base *base = calloc(1, sizeof *base);
    BD_ASSERT(base);
    base->directory = fd;
    pthread_mutex_init(&base->lock, NULL);
    remove_unfinished(fd);
    *out = add_handle(base, "", true);
    return BD_ERR_OK;
}

void bd_blobs_close(struct bd_blobs **blobs)
{
    if (!*blobs) return;
    struct bd_blobs_base *base = (*blobs)->base;
    while (base->handles) {
        struct bd_blobs *next = base->handles->next;
        free(base->handles);
        base->handles = next;
    }
    close(base->directory);
    pthread_mutex_destroy(&base->lock);
    free(base);
    *blobs = NULL;
}

void bd_blobs_set_reserve(struct bd_blobs *blobs, uint64_t reserve_bytes)
{
    atomic_store(&blobs->base->reserve_bytes, reserve_bytes);
}

struct bd_blobs *bd_blobs_of(struct bd_blobs *blobs, const char *owner, bool finds_all)
{
    char marks[sizeof blobs->marks] = "", hex[BD_SHA256_HEX];
    uint8_t digest[BD_SHA256_BYTES];
    struct bd_blobs_base *base = blobs->base;
    bd_sha256_of(owner, strlen(owner), digest);
    bd_sha256_hex(digest, hex);
    if (owner[0]) snprintf(marks, sizeof marks, BD_BLOBS_OWNER_PREFIX "%.16s", hex);
    pthread_mutex_lock(&base->lock);
    struct bd_blobs *found = base->handles;
    while (found && (found->finds_all != finds_all || strcmp(found->marks, marks) != 0))
        found = found->next;
    if (!found) found = add_handle(base, marks, finds_all);
    pthread_mutex_unlock(&base->lock);
    return found;
}

enum bd_err bd_blobs_check_room(struct bd_blobs *blobs, uint64_t more, struct bd_err_detail *detail)
{
    struct statvfs info;
    const uint64_t reserve = atomic_load(&blobs->base->reserve_bytes);
    if (reserve == 0) return BD_ERR_OK;
    if (fstatvfs(blobs->base->directory, &info)) return bd_blobs_err(detail, "the data directory");
    const uint64_t room = (uint64_t)info.f_bavail * info.f_frsize;
    if (room >= reserve && more <= room - reserve) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_NO_MEMORY, "disk_reserve_bytes",
                      "the disk of the data directory has %" PRIu64 " bytes free: of those the "
                      "limit disk_reserve_bytes keeps %" PRIu64 " for edits",
                      room, reserve);
}

bool bd_blob_name_is_valid(const char *hex)
{
    return strspn(hex, "0123456789abcdef") == 64 && hex[64] == 0;
}

// --- whole or not ---------------------------------------------------------------------------

static struct bd_verified *slot_of(struct bd_blobs_base *base, const struct stat *info)
{
    return &base->verified[(uint64_t)info->st_ino % BD_BLOBS_VERIFIED_MAX];
}

static struct bd_verified verified_of(const struct stat *info)
{
    return (struct bd_verified){(uint64_t)info->st_dev, (uint64_t)info->st_ino,
                                (uint64_t)info->st_size, info->st_mtim};
}

static bool is_verified(struct bd_blobs_base *base, const struct stat *info)
{
    pthread_mutex_lock(&base->lock);
    const struct bd_verified is = verified_of(info), was = *slot_of(base, info);
    pthread_mutex_unlock(&base->lock);
    return is.device == was.device && is.inode == was.inode && is.size == was.size &&
           is.changed.tv_sec == was.changed.tv_sec && is.changed.tv_nsec == was.changed.tv_nsec;
}

static void set_verified(struct bd_blobs_base *base, const struct stat *info)
{
    pthread_mutex_lock(&base->lock);
    *slot_of(base, info) = verified_of(info);
    pthread_mutex_unlock(&base->lock);
}

static bool is_same_file(const struct stat *a, const struct stat *b)
{
    return a->st_dev == b->st_dev && a->st_ino == b->st_ino &&
           a->st_mtim.tv_sec == b->st_mtim.tv_sec && a->st_mtim.tv_nsec == b->st_mtim.tv_nsec;
}

// Unless another has taken the place of the one that was read: a client may have sent it again.
static void set_aside(struct bd_blobs_base *base, const char *hex, const struct stat *read)
{
    char aside[sizeof BD_BLOBS_DAMAGED_PREFIX + 64];
    struct stat now;
    snprintf(aside, sizeof aside, BD_BLOBS_DAMAGED_PREFIX "%.64s", hex);
    pthread_mutex_lock(&base->lock);
    bool is_there =
        fstatat(base->directory, hex, &now, AT_SYMLINK_NOFOLLOW) == 0 && is_same_file(&now, read);
    bool is_aside = is_there && renameat(base->directory, hex, base->directory, aside) == 0;
    pthread_mutex_unlock(&base->lock);
    if (is_there)
        bd_log(BD_LOG_WARN, "scene", "blob sha256:%s was damaged and %s as blobs/%s", hex,
               is_aside ? "is set aside" : "cannot be set aside", aside);
}

static bool is_named(const struct bd_blob_map *content, const char *hex)
{
    uint8_t digest[BD_SHA256_BYTES];
    char actual[BD_SHA256_HEX];
    bd_sha256_of(content->bytes, content->size_bytes, digest);
    bd_sha256_hex(digest, actual);
    return strcmp(actual, hex) == 0;
}

// The same of a file that nobody wants to keep in memory.
static enum bd_err look_at(int file, const char *hex, bool *out_is_named,
                           struct bd_err_detail *detail)
{
    char piece[1 << 16], actual[BD_SHA256_HEX];
    uint8_t digest[BD_SHA256_BYTES];
    struct bd_sha256 *sha = bd_sha256_create();
    ssize_t got;
    for (off_t at = 0; (got = pread(file, piece, sizeof piece, at)) != 0;) {
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) break;
        bd_sha256_update(sha, piece, (size_t)got);
        at += got;
    }
    bd_sha256_finish(&sha, digest);
    if (got < 0) return bd_blobs_err(detail, "a blob cannot be read");
    bd_sha256_hex(digest, actual);
    *out_is_named = strcmp(actual, hex) == 0;
    return BD_ERR_OK;
}

enum bd_err bd_blobs_read_file(int file, struct bd_blob_map *out, struct bd_err_detail *detail)
{
    struct stat info;
    *out = (struct bd_blob_map){.bytes = "", .size_bytes = 0};
    if (fstat(file, &info) < 0) return bd_blobs_err(detail, "a blob cannot be read");
    const size_t size = (size_t)info.st_size;
    if (size == 0) return BD_ERR_OK;
    char *bytes = mmap(NULL, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (bytes == MAP_FAILED) return bd_blobs_err(detail, "no memory for a blob");
    *out = (struct bd_blob_map){bytes, size};
    for (size_t at = 0; at < size;) {
        ssize_t got = pread(file, bytes + at, size - at, (off_t)at);
        if (got < 0 && errno == EINTR) continue;
        if (got == 0) errno = EIO; // somebody cuts it short meanwhile
        if (got > 0) {
            at += (size_t)got;
            continue;
        }
        enum bd_err err = bd_blobs_err(detail, "a blob cannot be read");
        bd_blob_unmap(out);
        return err;
    }
    return BD_ERR_OK;
}

void bd_blob_unmap(struct bd_blob_map *map)
{
    if (map->bytes && map->size_bytes) munmap((void *)(uintptr_t)map->bytes, map->size_bytes);
    *map = (struct bd_blob_map){0};
}

static enum bd_err not_there(const char *hex, struct bd_err_detail *detail)
{
    return bd_err_set(detail, BD_ERR_NOT_FOUND, "blob", "there is no blob sha256:%.64s", hex);
}

// What an open file holds, and whether it is what its name says.
static enum bd_err read_and_judge(struct bd_blobs_base *base, int file, const char *hex,
                                  struct bd_blob_map *out, struct stat *info, bool *is_whole,
                                  struct bd_err_detail *detail)
{
    if (fstat(file, info)) return bd_blobs_err(detail, "a blob cannot be read");
    *is_whole = is_verified(base, info);
    enum bd_err err = out ? bd_blobs_read_file(file, out, detail) : BD_ERR_OK;
    if (err || *is_whole) return err;
    if (!out) return look_at(file, hex, is_whole, detail);
    *is_whole = is_named(out, hex);
    return BD_ERR_OK;
}

// Whatever bears the name and is no file that we wrote is damage, too, and not waited for.
enum bd_err bd_blobs_open_whole(struct bd_blobs *blobs, const char *hex, struct bd_blob_map *out,
                                struct bd_err_detail *detail)
{
    struct bd_blobs_base *base = blobs->base;
    struct stat info;
    bool is_whole = false;
    if (fstatat(base->directory, hex, &info, AT_SYMLINK_NOFOLLOW))
        return errno == ENOENT ? not_there(hex, detail)
                               : bd_blobs_err(detail, "a blob cannot be looked at");
    if (S_ISREG(info.st_mode)) {
        if (!out && is_verified(base, &info)) return BD_ERR_OK;
        int file = openat(base->directory, hex, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
        if (file < 0) return bd_blobs_err(detail, "a blob cannot be opened");
        enum bd_err err = read_and_judge(base, file, hex, out, &info, &is_whole, detail);
        close(file);
        if (err) return err;
    }
    if (is_whole) {
        set_verified(base, &info);
        return BD_ERR_OK;
    }
    if (out) bd_blob_unmap(out);
    set_aside(base, hex, &info);
    return bd_err_set(detail, BD_ERR_NOT_FOUND, "blob",
                      "blob sha256:%.64s was damaged and is not there any more: send it again",
                      hex);
}

static bool finds(const struct bd_blobs *blobs, const char *hex)
{
    return bd_blob_name_is_valid(hex) && (blobs->finds_all || bd_blobs_is_marked(blobs, hex));
}

bool bd_blobs_have(struct bd_blobs *blobs, const char *hex)
{
    if (!finds(blobs, hex)) return false;
    bd_blobs_touch(blobs, hex); // first: it is not collected from here on
    return bd_blobs_open_whole(blobs, hex, NULL, NULL) == BD_ERR_OK;
}

enum bd_err bd_blobs_map(struct bd_blobs *blobs, const char *hex, struct bd_blob_map *out,
                         struct bd_err_detail *detail)
{
    *out = (struct bd_blob_map){0};
    if (!finds(blobs, hex)) return not_there(hex, detail);
    bd_blobs_touch(blobs, hex);
    return bd_blobs_open_whole(blobs, hex, out, detail);
}
