// Content-addressed files in the data directory: bytes by SHA-256, written once, never changed.
//
// A blob appears under its name only when it is whole and its hash is right (written beside,
// synced, renamed). Thread: any; calls block on the disk, so keep them off the event loop.

#ifndef BD_SCENE_BLOBS_H
#define BD_SCENE_BLOBS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/err.h"
#include "base/hash.h"

struct bd_blobs;

// Opens, or makes with mode 0700, `directory`/blobs. Removes uploads that a crash left unfinished.
BD_MUST_CHECK
enum bd_err bd_blobs_open(const char *directory, struct bd_blobs **out, struct bd_fault *fault);
void bd_blobs_close(struct bd_blobs **blobs);

// True for exactly 64 lower-case hexadecimal digits.
bool bd_blob_name_is_valid(const char *hex);

bool bd_blobs_have(struct bd_blobs *blobs, const char *hex);

// A growing upload, to be committed under the name that its content must have.
struct bd_blob_upload;
BD_MUST_CHECK
enum bd_err bd_blob_upload_begin(struct bd_blobs *blobs, struct bd_blob_upload **out,
                                 struct bd_fault *fault);
BD_MUST_CHECK
enum bd_err bd_blob_upload_write(struct bd_blob_upload *upload, const void *bytes, size_t size,
                                 struct bd_fault *fault);
// Ends the upload either way and nulls it. BD_ERR_BAD_INPUT if the content's hash is not `hex`.
BD_MUST_CHECK
enum bd_err bd_blob_upload_commit(struct bd_blob_upload **upload, const char *hex,
                                  struct bd_fault *fault);
void bd_blob_upload_abort(struct bd_blob_upload **upload);

struct bd_blob_map {
    const void *bytes;
    size_t size_bytes;
};
// Maps what was uploaded so far without keeping it: for content that is read once. The map
// outlives the upload.
BD_MUST_CHECK
enum bd_err bd_blob_upload_map(struct bd_blob_upload *upload, struct bd_blob_map *out,
                               struct bd_fault *fault);

// Maps a blob for reading. BD_ERR_NOT_FOUND if there is none. Unmap with bd_blob_unmap.
BD_MUST_CHECK
enum bd_err bd_blobs_map(struct bd_blobs *blobs, const char *hex, struct bd_blob_map *out,
                         struct bd_fault *fault);
void bd_blob_unmap(struct bd_blob_map *map);

#endif
