#include "net/loop/spool.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <uv.h>

#include "base/assert.h"
#include "net/loop/loop.h"

#define FULL_BYTES (1u << 20)

enum wish { WISH_MORE, WISH_COMMIT, WISH_CLOSE };

struct bytes {
    uint8_t *data;
    size_t used, capacity;
};

struct bd_spool {
    struct bd_loop *loop;
    struct bd_blobs *blobs;
    uint64_t most_bytes;
    const struct bd_spool_events *events;
    void *user;
    struct bytes pending; // filled by the loop
    struct bytes writing; // the pool's while `is_working`
    uint64_t appended_bytes;
    enum wish wish;
    char hex[BD_SHA256_HEX];
    bool is_working, was_full, is_ended, is_abandoned;
    uv_work_t work;
    struct bd_blob_upload *upload; // the pool's while `is_working`
    bool commits;                  // this piece of work is the last
    enum bd_err err;
    struct bd_err_detail detail;
};

struct bd_spool *bd_spool_create(struct bd_loop *loop, struct bd_blobs *blobs, uint64_t most_bytes,
                                 const struct bd_spool_events *events, void *user)
{
    struct bd_spool *spool = calloc(1, sizeof *spool);
    BD_ASSERT(spool);
    spool->loop = loop;
    spool->blobs = blobs;
    spool->most_bytes = most_bytes;
    spool->events = events;
    spool->user = user;
    spool->work.data = spool;
    return spool;
}

static void free_spool(struct bd_spool *spool)
{
    bd_blob_upload_abort(&spool->upload);
    free(spool->pending.data);
    free(spool->writing.data);
    free(spool);
}

static void write_on_pool(uv_work_t *work)
{
    struct bd_spool *spool = work->data;
    if (!spool->upload)
        spool->err =
            bd_blob_upload_begin(spool->blobs, spool->most_bytes, &spool->upload, &spool->detail);
    if (!spool->err)
        spool->err = bd_blob_upload_write(spool->upload, spool->writing.data, spool->writing.used,
                                          &spool->detail);
    if (!spool->err && spool->commits)
        spool->err = bd_blob_upload_commit(&spool->upload, spool->hex, &spool->detail);
}

static void end(struct bd_spool *spool)
{
    spool->is_ended = true;
    spool->events->ended(spool->user, spool->err, &spool->detail);
}

static void work_on(struct bd_spool *spool);

static void write_back(uv_work_t *work, int status)
{
    struct bd_spool *spool = work->data;
    BD_ASSERT_CMP(status, ==, 0);
    spool->is_working = false;
    spool->writing.used = 0;
    if (spool->is_abandoned) {
        free_spool(spool);
    } else if (spool->err || spool->commits ||
               (spool->wish == WISH_CLOSE && spool->pending.used == 0)) {
        end(spool);
    } else {
        if (spool->wish != WISH_MORE || spool->pending.used > 0) work_on(spool);
        bool drained = spool->was_full && !bd_spool_is_full(spool);
        if (drained) spool->was_full = false;
        if (drained) spool->events->drained(spool->user);
    }
}

static void work_on(struct bd_spool *spool)
{
    if (spool->is_working || spool->is_ended) return;
    struct bytes swap = spool->writing;
    spool->writing = spool->pending;
    spool->pending = swap;
    spool->commits = spool->wish == WISH_COMMIT;
    spool->is_working = true;
    int result = uv_queue_work(&spool->loop->uv, &spool->work, write_on_pool, write_back);
    BD_ASSERT_CMP(result, ==, 0);
}

void bd_spool_append(struct bd_spool *spool, const void *bytes, size_t size)
{
    BD_ASSERT(spool->wish == WISH_MORE);
    if (size == 0 || spool->is_ended) return;
    struct bytes *pending = &spool->pending;
    if (pending->used + size > pending->capacity) {
        size_t capacity = pending->capacity ? pending->capacity * 2 : 65536;
        if (capacity < pending->used + size) capacity = pending->used + size;
        pending->data = realloc(pending->data, capacity);
        BD_ASSERT(pending->data);
        pending->capacity = capacity;
    }
    memcpy(pending->data + pending->used, bytes, size);
    pending->used += size;
    spool->appended_bytes += size;
    if (bd_spool_is_full(spool)) spool->was_full = true;
    work_on(spool);
}

bool bd_spool_is_full(const struct bd_spool *spool)
{
    return spool->pending.used >= FULL_BYTES;
}

uint64_t bd_spool_bytes(const struct bd_spool *spool)
{
    return spool->appended_bytes;
}

void bd_spool_commit(struct bd_spool *spool, const char *hex)
{
    snprintf(spool->hex, sizeof spool->hex, "%s", hex);
    spool->wish = WISH_COMMIT;
    work_on(spool);
}

void bd_spool_close(struct bd_spool *spool)
{
    spool->wish = WISH_CLOSE;
    work_on(spool);
}

struct bd_blob_upload *bd_spool_take_upload(struct bd_spool *spool)
{
    struct bd_blob_upload *upload = spool->upload;
    spool->upload = NULL;
    return upload;
}

void bd_spool_abandon(struct bd_spool **spool)
{
    if (!*spool) return;
    (*spool)->is_abandoned = true;
    if (!(*spool)->is_working) free_spool(*spool);
    *spool = NULL;
}
