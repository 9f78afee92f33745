// Bytes from a connection into an upload, without the disk ever holding up the loop.
//
// The loop appends; libuv's pool writes. While the pool is behind by more than a megabyte the
// spool is full, and the connection should stop reading until it hears `drained`.
//
// Thread: the event loop's.

#ifndef BD_NET_LOOP_SPOOL_H
#define BD_NET_LOOP_SPOOL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/err.h"
#include "scene/blobs/blobs.h"

struct bd_loop;
struct bd_spool;

struct bd_spool_events {
    // The spool is not full any more.
    void (*drained)(void *user);
    // After bd_spool_commit or bd_spool_close, or early if the disk failed. The last event; the
    // spool is still to be abandoned.
    void (*ended)(void *user, enum bd_err err, const struct bd_err_detail *detail);
};

// Into `blobs`, whose owner may have no more than `most_bytes`.
struct bd_spool *bd_spool_create(struct bd_loop *loop, struct bd_blobs *blobs, uint64_t most_bytes,
                                 const struct bd_spool_events *events, void *user);

// Copies. Nothing happens after a failure: `ended` tells it.
void bd_spool_append(struct bd_spool *spool, const void *bytes, size_t size);
bool bd_spool_is_full(const struct bd_spool *spool);
uint64_t bd_spool_bytes(const struct bd_spool *spool); // appended so far

// Writes what is left and keeps the content as the blob of that name, if its hash is right.
void bd_spool_commit(struct bd_spool *spool, const char *hex);
// Writes what is left and keeps nothing: for bd_spool_take_upload in `ended`.
void bd_spool_close(struct bd_spool *spool);
struct bd_blob_upload *bd_spool_take_upload(struct bd_spool *spool);

// No further events; frees it as soon as the pool is done with it. Nulls; takes NULL.
void bd_spool_abandon(struct bd_spool **spool);

#endif
