// Blobs on their way in, and whose they are.

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/assert.h"
#include "scene/blobs/blobs_internal.h"

// --- owners ---------------------------------------------------------------------------------

static void mark_path(const struct bd_blobs *blobs, const char *hex, char out[96])
{
    snprintf(out, 96, "%s/%.64s", blobs->marks, hex);
}

bool bd_blobs_mark(const struct bd_blobs *blobs, const char *hex)
{
    char path[96];
    const int directory = blobs->base->directory;
    if (!blobs->marks[0]) return true;
    mark_path(blobs, hex, path);
    if (mkdirat(directory, blobs->marks, 0700) && errno != EEXIST) return false;
    int file = openat(directory, path, O_WRONLY | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0600);
    if (file < 0) return false;
    // One from long ago may be about to be collected.
    bool is_marked = futimens(file, NULL) == 0;
    close(file);
    return is_marked;
}

static bool sync_marks(const struct bd_blobs *blobs)
{
    if (!blobs->marks[0]) return true;
    int marks = openat(blobs->base->directory, blobs->marks, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    bool is_synced = marks >= 0 && fsync(marks) == 0;
    if (marks >= 0) close(marks);
    return is_synced;
}

bool bd_blobs_is_marked(const struct bd_blobs *blobs, const char *hex)
{
    char path[96];
    mark_path(blobs, hex, path);
    return blobs->marks[0] && faccessat(blobs->base->directory, path, F_OK, 0) == 0;
}

// The time of the last use is that of access, which is ours to set; that of change stays.
void bd_blobs_touch(const struct bd_blobs *blobs, const char *hex)
{
    static const struct timespec now[2] = {{.tv_nsec = UTIME_NOW}, {.tv_nsec = UTIME_OMIT}};
    char path[96];
    mark_path(blobs, hex, path);
    pthread_mutex_lock(&blobs->base->lock); // not while it is being collected
    utimensat(blobs->base->directory, hex, now, AT_SYMLINK_NOFOLLOW);
    if (blobs->marks[0]) utimensat(blobs->base->directory, path, now, AT_SYMLINK_NOFOLLOW);
    pthread_mutex_unlock(&blobs->base->lock);
}

uint64_t bd_blobs_held_bytes(const struct bd_blobs *blobs)
{
    const int directory = blobs->base->directory;
    int marks = openat(directory, blobs->marks, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    DIR *list = marks < 0 ? NULL : fdopendir(marks);
    uint64_t bytes = 0;
    if (!list) return 0;
    for (struct dirent *entry; (entry = readdir(list));) {
        struct stat info;
        if (bd_blob_name_is_valid(entry->d_name) &&
            fstatat(directory, entry->d_name, &info, 0) == 0)
            bytes += (uint64_t)info.st_size;
    }
    closedir(list);
    return bytes;
}

// --- uploads --------------------------------------------------------------------------------

static int open_named(struct bd_blob_upload *upload)
{
    static uint32_t next;
    snprintf(upload->name, sizeof upload->name, BD_BLOBS_UPLOAD_PREFIX "%d.%u", (int)getpid(),
             __atomic_fetch_add(&next, 1, __ATOMIC_RELAXED));
    return openat(upload->blobs->base->directory, upload->name,
                  O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
}

static void enlist(struct bd_blob_upload *upload)
{
    struct bd_blobs_base *base = upload->blobs->base;
    pthread_mutex_lock(&base->lock);
    upload->next = base->uploads;
    base->uploads = upload;
    pthread_mutex_unlock(&base->lock);
}

static void leave_list(struct bd_blob_upload *upload)
{
    struct bd_blobs_base *base = upload->blobs->base;
    pthread_mutex_lock(&base->lock);
    struct bd_blob_upload **at = &base->uploads;
    while (*at != upload) at = &(*at)->next;
    *at = upload->next;
    pthread_mutex_unlock(&base->lock);
}

enum bd_err bd_blob_upload_begin(struct bd_blobs *blobs, uint64_t most_bytes,
                                 struct bd_blob_upload **out, struct bd_err_detail *detail)
{
    enum bd_err err = bd_blobs_check_room(blobs, 0, detail);
    if (err) return err;
    struct bd_blob_upload *upload = calloc(1, sizeof *upload);
    BD_ASSERT(upload);
    upload->blobs = blobs;
    upload->most_bytes = most_bytes;
    if (most_bytes != UINT64_MAX) upload->held_bytes = bd_blobs_held_bytes(blobs);
    upload->file = openat(blobs->base->directory, ".", O_RDWR | O_TMPFILE | O_CLOEXEC, 0600);
    if (upload->file < 0) upload->file = open_named(upload);
    if (upload->file < 0) {
        free(upload);
        return bd_blobs_err(detail, "an upload cannot begin");
    }
    upload->sha = bd_sha256_create();
    enlist(upload);
    *out = upload;
    return BD_ERR_OK;
}

// Takes the bytes into the count before they are written, so that uploads side by side do not pass
// together where each would alone.
static enum bd_err count_bytes(struct bd_blob_upload *upload, size_t more,
                               struct bd_err_detail *detail)
{
    struct bd_blobs_base *base = upload->blobs->base;
    pthread_mutex_lock(&base->lock);
    uint64_t bytes = upload->held_bytes;
    upload->size_bytes += more;
    for (const struct bd_blob_upload *at = base->uploads; at; at = at->next)
        if (strcmp(at->blobs->marks, upload->blobs->marks) == 0) bytes += at->size_bytes;
    pthread_mutex_unlock(&base->lock);
    if (bytes <= upload->most_bytes) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_LIMIT, "max_bytes",
                      "the blobs would take %" PRIu64 " bytes, above max_bytes of %" PRIu64, bytes,
                      upload->most_bytes);
}

enum bd_err bd_blob_upload_write(struct bd_blob_upload *upload, const void *bytes, size_t size,
                                 struct bd_err_detail *detail)
{
    enum bd_err err = bd_blobs_check_room(upload->blobs, size, detail);
    if (!err) err = count_bytes(upload, size, detail);
    if (err) return err;
    bd_sha256_update(upload->sha, bytes, size);
    for (const char *at = bytes; size > 0;) {
        ssize_t written = write(upload->file, at, size);
        if (written < 0 && errno == EINTR) continue;
        if (written < 0) return bd_blobs_err(detail, "an upload cannot be written");
        at += written;
        size -= (size_t)written;
    }
    return BD_ERR_OK;
}

void bd_blob_upload_abort(struct bd_blob_upload **upload)
{
    if (!*upload) return;
    leave_list(*upload);
    if ((*upload)->name[0]) unlinkat((*upload)->blobs->base->directory, (*upload)->name, 0);
    close((*upload)->file);
    bd_sha256_destroy(&(*upload)->sha);
    free(*upload);
    *upload = NULL;
}

static int link_as(const struct bd_blob_upload *upload, const char *name)
{
    char path[64];
    snprintf(path, sizeof path, "/proc/self/fd/%d", upload->file);
    return linkat(AT_FDCWD, path, upload->blobs->base->directory, name, AT_SYMLINK_FOLLOW);
}

// Gives the file its final name. Somebody else may have been first with the same content: fine, if
// it is whole. What is not was set aside; what cannot be read is replaced.
static int publish(struct bd_blob_upload *upload, const char *hex)
{
    const int directory = upload->blobs->base->directory;
    if (!upload->name[0] && link_as(upload, hex) == 0) return 0;
    if (!upload->name[0] && errno != EEXIST) return -1;
    bd_blobs_touch(upload->blobs, hex); // it is not collected from here on
    if (bd_blobs_open_whole(upload->blobs, hex, NULL, NULL) == BD_ERR_OK) return 0;
    if (!upload->name[0]) {
        int file = open_named(upload); // for a name that nobody has
        if (file >= 0) close(file);
        unlinkat(directory, upload->name, 0);
        if (link_as(upload, upload->name)) return -1;
    }
    int result = renameat(directory, upload->name, directory, hex);
    if (result == 0) upload->name[0] = 0; // it has moved: abort must not look for it
    return result;
}

// The owner's other uploads counted what it held before this one was whole.
static void tell_others(const struct bd_blob_upload *upload)
{
    struct bd_blobs_base *base = upload->blobs->base;
    pthread_mutex_lock(&base->lock);
    for (struct bd_blob_upload *at = base->uploads; at; at = at->next)
        if (at != upload && strcmp(at->blobs->marks, upload->blobs->marks) == 0)
            at->held_bytes += upload->size_bytes;
    pthread_mutex_unlock(&base->lock);
}

static enum bd_err check_and_publish(struct bd_blob_upload *upload, const char *hex,
                                     struct bd_err_detail *detail)
{
    uint8_t digest[BD_SHA256_BYTES];
    char actual[BD_SHA256_HEX];
    bd_sha256_finish(&upload->sha, digest);
    bd_sha256_hex(digest, actual);
    if (strcmp(actual, hex) != 0)
        return bd_err_set(detail, BD_ERR_BAD_INPUT, "blob",
                          "the content is sha256:%s, not sha256:%s", actual, hex);
    const bool is_held = bd_blobs_is_marked(upload->blobs, hex);
    if (fsync(upload->file) < 0 || publish(upload, hex) < 0 || !bd_blobs_mark(upload->blobs, hex) ||
        !sync_marks(upload->blobs) || fsync(upload->blobs->base->directory) < 0)
        return bd_blobs_err(detail, "a blob cannot be kept");
    if (!is_held) tell_others(upload);
    return BD_ERR_OK;
}

enum bd_err bd_blob_upload_commit(struct bd_blob_upload **upload, const char *hex,
                                  struct bd_err_detail *detail)
{
    enum bd_err err = check_and_publish(*upload, hex, detail);
    bd_blob_upload_abort(upload);
    return err;
}

enum bd_err bd_blob_upload_map(struct bd_blob_upload *upload, struct bd_blob_map *out,
                               struct bd_err_detail *detail)
{
    return bd_blobs_read_file(upload->file, out, detail);
}
