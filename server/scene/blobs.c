#include "scene/blobs.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/assert.h"

struct bd_blobs {
    int directory; // DIRECTORY/blobs
};

// Uploads are files without a name (O_TMPFILE): whatever ends this process, the kernel takes them
// away. Where the file system has none, they carry a name with this prefix, swept at open.
#define UPLOAD_PREFIX "upload."

struct bd_blob_upload {
    struct bd_blobs *blobs;
    int file;
    char name[sizeof UPLOAD_PREFIX + 32]; // "" if it has none
    struct bd_sha256 *sha;
    uint64_t size_bytes;
};

static enum bd_err io_fault(struct bd_fault *fault, const char *what)
{
    enum bd_err err = errno == ENOSPC || errno == EDQUOT ? BD_ERR_NO_MEMORY : BD_ERR_IO;
    return bd_fault_set(fault, err, "data", "%s: %s", what, strerror(errno));
}

static void remove_unfinished(int directory)
{
    int copy = openat(directory, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    DIR *list = copy < 0 ? NULL : fdopendir(copy);
    if (!list) {
        if (copy >= 0) close(copy);
        return;
    }
    for (struct dirent *entry; (entry = readdir(list));)
        if (strncmp(entry->d_name, UPLOAD_PREFIX, strlen(UPLOAD_PREFIX)) == 0)
            unlinkat(directory, entry->d_name, 0);
    closedir(list);
}

enum bd_err bd_blobs_open(const char *directory, struct bd_blobs **out, struct bd_fault *fault)
{
    char path[4096];
    int length = snprintf(path, sizeof path, "%s/blobs", directory);
    if (length < 0 || (size_t)length >= sizeof path)
        return bd_fault_set(fault, BD_ERR_USAGE, "data", "the data directory's path is too long");
    if (mkdir(path, 0700) < 0 && errno != EEXIST) return io_fault(fault, path);
    int fd = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd < 0) return io_fault(fault, path);
    struct bd_blobs *blobs = malloc(sizeof *blobs);
    BD_ASSERT(blobs);
    blobs->directory = fd;
    remove_unfinished(fd);
    *out = blobs;
    return BD_ERR_OK;
}

void bd_blobs_close(struct bd_blobs **blobs)
{
    if (!*blobs) return;
    close((*blobs)->directory);
    free(*blobs);
    *blobs = NULL;
}

bool bd_blob_name_is_valid(const char *hex)
{
    return strspn(hex, "0123456789abcdef") == 64 && hex[64] == 0;
}

bool bd_blobs_have(struct bd_blobs *blobs, const char *hex)
{
    return bd_blob_name_is_valid(hex) && faccessat(blobs->directory, hex, R_OK, 0) == 0;
}

static int open_named(struct bd_blob_upload *upload)
{
    static uint32_t next;
    snprintf(upload->name, sizeof upload->name, UPLOAD_PREFIX "%d.%u", (int)getpid(),
             __atomic_fetch_add(&next, 1, __ATOMIC_RELAXED));
    return openat(upload->blobs->directory, upload->name, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC,
                  0600);
}

enum bd_err bd_blob_upload_begin(struct bd_blobs *blobs, struct bd_blob_upload **out,
                                 struct bd_fault *fault)
{
    struct bd_blob_upload *upload = calloc(1, sizeof *upload);
    BD_ASSERT(upload);
    upload->blobs = blobs;
    upload->file = openat(blobs->directory, ".", O_RDWR | O_TMPFILE | O_CLOEXEC, 0600);
    if (upload->file < 0) upload->file = open_named(upload);
    if (upload->file < 0) {
        free(upload);
        return io_fault(fault, "an upload cannot begin");
    }
    upload->sha = bd_sha256_create();
    *out = upload;
    return BD_ERR_OK;
}

enum bd_err bd_blob_upload_write(struct bd_blob_upload *upload, const void *bytes, size_t size,
                                 struct bd_fault *fault)
{
    bd_sha256_update(upload->sha, bytes, size);
    for (const char *at = bytes; size > 0;) {
        ssize_t written = write(upload->file, at, size);
        if (written < 0 && errno == EINTR) continue;
        if (written < 0) return io_fault(fault, "an upload cannot be written");
        at += written;
        size -= (size_t)written;
        upload->size_bytes += (uint64_t)written;
    }
    return BD_ERR_OK;
}

void bd_blob_upload_abort(struct bd_blob_upload **upload)
{
    if (!*upload) return;
    if ((*upload)->name[0]) unlinkat((*upload)->blobs->directory, (*upload)->name, 0);
    close((*upload)->file);
    bd_sha256_destroy(&(*upload)->sha);
    free(*upload);
    *upload = NULL;
}

// Gives the file its final name. Somebody else may have been first with the same content: fine.
static int publish(const struct bd_blob_upload *upload, const char *hex)
{
    int directory = upload->blobs->directory;
    if (upload->name[0]) return renameat(directory, upload->name, directory, hex);
    char path[64];
    snprintf(path, sizeof path, "/proc/self/fd/%d", upload->file);
    int result = linkat(AT_FDCWD, path, directory, hex, AT_SYMLINK_FOLLOW);
    return result < 0 && errno == EEXIST ? 0 : result;
}

static enum bd_err check_and_publish(struct bd_blob_upload *upload, const char *hex,
                                     struct bd_fault *fault)
{
    uint8_t digest[BD_SHA256_BYTES];
    char actual[BD_SHA256_HEX];
    bd_sha256_finish(&upload->sha, digest);
    bd_sha256_hex(digest, actual);
    if (strcmp(actual, hex) != 0)
        return bd_fault_set(fault, BD_ERR_BAD_INPUT, "blob",
                            "the content is sha256:%s, not sha256:%s", actual, hex);
    if (fsync(upload->file) < 0 || publish(upload, hex) < 0 || fsync(upload->blobs->directory) < 0)
        return io_fault(fault, "a blob cannot be kept");
    upload->name[0] = 0; // it has moved: abort must not look for it
    return BD_ERR_OK;
}

enum bd_err bd_blob_upload_commit(struct bd_blob_upload **upload, const char *hex,
                                  struct bd_fault *fault)
{
    enum bd_err err = check_and_publish(*upload, hex, fault);
    bd_blob_upload_abort(upload);
    return err;
}

static enum bd_err map_file(int file, struct bd_blob_map *out, struct bd_fault *fault)
{
    struct stat info;
    if (fstat(file, &info) < 0) return io_fault(fault, "a blob cannot be read");
    *out = (struct bd_blob_map){.bytes = "", .size_bytes = (size_t)info.st_size};
    if (info.st_size == 0) return BD_ERR_OK;
    void *bytes = mmap(NULL, (size_t)info.st_size, PROT_READ, MAP_SHARED, file, 0);
    if (bytes == MAP_FAILED) return io_fault(fault, "a blob cannot be mapped");
    out->bytes = bytes;
    return BD_ERR_OK;
}

enum bd_err bd_blob_upload_map(struct bd_blob_upload *upload, struct bd_blob_map *out,
                               struct bd_fault *fault)
{
    return map_file(upload->file, out, fault);
}

enum bd_err bd_blobs_map(struct bd_blobs *blobs, const char *hex, struct bd_blob_map *out,
                         struct bd_fault *fault)
{
    int file =
        bd_blob_name_is_valid(hex) ? openat(blobs->directory, hex, O_RDONLY | O_CLOEXEC) : -1;
    if (file < 0)
        return bd_fault_set(fault, BD_ERR_NOT_FOUND, "blob", "there is no blob sha256:%.64s", hex);
    enum bd_err err = map_file(file, out, fault);
    close(file);
    return err;
}

void bd_blob_unmap(struct bd_blob_map *map)
{
    if (map->bytes && map->size_bytes) munmap((void *)(uintptr_t)map->bytes, map->size_bytes);
    *map = (struct bd_blob_map){0};
}
