// Content-addressed files in the data directory: bytes by SHA-256, written once, never changed.
//
// A blob appears under its name only when it is whole and its hash is right (written beside,
// synced, renamed). What lies there is not trusted for that: a file is hashed when it is looked at,
// once for each inode and time of change, and one that is damaged is set aside as `damaged.NAME`
// and not there any more, until it is sent again.
//
// A handle is an owner's: it has and counts what that owner sent, and finds no other's, or finds
// all. What nobody asked for in a while is collected: revisions need no blobs, for the journal
// keeps what came out of them.
//
// Thread: any; calls block on the disk, so keep them off the event loop, but for those that say so.

#ifndef BD_SCENE_BLOBS_BLOBS_H
#define BD_SCENE_BLOBS_BLOBS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/err.h"
#include "base/hash.h"

struct bd_blobs;

// Opens, or makes with mode 0700, `directory`/blobs. Removes uploads that a crash left unfinished.
// The handle is nobody's and finds all.
BD_MUST_CHECK
enum bd_err bd_blobs_open(const char *directory, struct bd_blobs **out,
                          struct bd_err_detail *detail);
// With the handles of every owner.
void bd_blobs_close(struct bd_blobs **blobs);

// So much of the disk is kept free for others: uploads that would take from it are refused with
// BD_ERR_NO_MEMORY, naming disk_reserve_bytes. At any time. Does not block.
void bd_blobs_set_reserve(struct bd_blobs *blobs, uint64_t reserve_bytes);

// The same blobs for `owner`, "" = nobody; `finds_all`: those of others, too. Lives as long as
// `blobs`. Does not block.
struct bd_blobs *bd_blobs_of(struct bd_blobs *blobs, const char *owner, bool finds_all);

// True for exactly 64 lower-case hexadecimal digits.
bool bd_blob_name_is_valid(const char *hex);

// Whether it is there, whole, for this owner. Counts as use of it.
bool bd_blobs_have(struct bd_blobs *blobs, const char *hex);

// Takes away what was not used for `seconds`; `seconds` 0: nothing. How many files went.
uint32_t bd_blobs_collect(struct bd_blobs *blobs, uint64_t seconds);

// BD_ERR_NO_MEMORY, naming disk_reserve_bytes, if `more` bytes would take from what is kept free.
BD_MUST_CHECK
enum bd_err bd_blobs_check_room(struct bd_blobs *blobs, uint64_t more,
                                struct bd_err_detail *detail);

// A growing upload, to be committed under the name that its content must have. The owner's blobs,
// with its uploads under way, are never more than `most_bytes`: BD_ERR_LIMIT, naming max_bytes.
struct bd_blob_upload;
BD_MUST_CHECK
enum bd_err bd_blob_upload_begin(struct bd_blobs *blobs, uint64_t most_bytes,
                                 struct bd_blob_upload **out, struct bd_err_detail *detail);
BD_MUST_CHECK
enum bd_err bd_blob_upload_write(struct bd_blob_upload *upload, const void *bytes, size_t size,
                                 struct bd_err_detail *detail);
// Ends the upload either way and nulls it. BD_ERR_BAD_INPUT if the content's hash is not `hex`.
BD_MUST_CHECK
enum bd_err bd_blob_upload_commit(struct bd_blob_upload **upload, const char *hex,
                                  struct bd_err_detail *detail);
void bd_blob_upload_abort(struct bd_blob_upload **upload);

// Content in memory, read and not mapped: a file that is cut short, or a disk that fails, is an
// error and no signal.
struct bd_blob_map {
    const void *bytes;
    size_t size_bytes;
};
// What was uploaded so far, without keeping it: for content that is read once. It outlives the
// upload.
BD_MUST_CHECK
enum bd_err bd_blob_upload_map(struct bd_blob_upload *upload, struct bd_blob_map *out,
                               struct bd_err_detail *detail);

// A whole blob. Counts as use of it. BD_ERR_NOT_FOUND if there is none, BD_ERR_IO if the disk does
// not give it. Free with bd_blob_unmap.
BD_MUST_CHECK
enum bd_err bd_blobs_map(struct bd_blobs *blobs, const char *hex, struct bd_blob_map *out,
                         struct bd_err_detail *detail);
void bd_blob_unmap(struct bd_blob_map *map);

#endif
