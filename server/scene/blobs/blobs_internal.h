// What the files of the blobs share. Nobody else includes it.

#ifndef BD_SCENE_BLOBS_BLOBS_INTERNAL_H
#define BD_SCENE_BLOBS_BLOBS_INTERNAL_H

#include <pthread.h>
#include <stdatomic.h>
#include <sys/stat.h>

#include "scene/blobs/blobs.h"

// An owner's marks lie in a directory of this name and sixteen hexadecimal digits: empty files by
// the names of the blobs that it sent.
#define BD_BLOBS_OWNER_PREFIX   "of."
#define BD_BLOBS_DAMAGED_PREFIX "damaged."
// Uploads are files without a name (O_TMPFILE): whatever ends this process, the kernel takes them
// away. Where the file system has none, they carry a name with this prefix, swept at open.
#define BD_BLOBS_UPLOAD_PREFIX "upload."

#define BD_BLOBS_VERIFIED_MAX 4096

// A file whose hash was right.
struct bd_verified {
    uint64_t device, inode, size;
    struct timespec changed;
};

struct bd_blobs_base {
    int directory; // DIRECTORY/blobs
    _Atomic uint64_t reserve_bytes;
    pthread_mutex_t lock; // of all below, and of what is taken away or given a name
    struct bd_blobs *handles;
    struct bd_blob_upload *uploads;                     // under way
    struct bd_verified verified[BD_BLOBS_VERIFIED_MAX]; // by inode
};

struct bd_blobs {
    struct bd_blobs_base *base;
    char marks[sizeof BD_BLOBS_OWNER_PREFIX + 16]; // "": nobody's
    bool finds_all;
    struct bd_blobs *next;
};

struct bd_blob_upload {
    struct bd_blobs *blobs;
    int file;
    char name[sizeof BD_BLOBS_UPLOAD_PREFIX + 32]; // "" if it has none
    struct bd_sha256 *sha;
    uint64_t size_bytes, most_bytes;
    uint64_t held_bytes; // by the owner when it began, and of uploads that ended since
    struct bd_blob_upload *next;
};

enum bd_err bd_blobs_err(struct bd_err_detail *detail, const char *what);

// A file's content. BD_ERR_IO if it is shorter than it says.
BD_MUST_CHECK
enum bd_err bd_blobs_read_file(int file, struct bd_blob_map *out, struct bd_err_detail *detail);

// Whether a file of that name is there, and what its name says; one that is not is set aside.
// `out` NULL: only looked at.
BD_MUST_CHECK
enum bd_err bd_blobs_open_whole(struct bd_blobs *blobs, const char *hex, struct bd_blob_map *out,
                                struct bd_err_detail *detail);

// The marks of an owner. False, with errno, if one cannot be made.
bool bd_blobs_mark(const struct bd_blobs *blobs, const char *hex);
bool bd_blobs_is_marked(const struct bd_blobs *blobs, const char *hex);
void bd_blobs_touch(const struct bd_blobs *blobs, const char *hex);
uint64_t bd_blobs_held_bytes(const struct bd_blobs *blobs);

#endif
