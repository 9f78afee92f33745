#include "scene/gltf/picture_queue.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/assert.h"
#include "image/decode.h"

// What is decoded ahead of the owner, at most; a larger picture has the window to itself.
#define WINDOW_BYTES (256ull << 20)
// Of the memory that the child may have, so that a small limit is not passed by being fast.
#define WINDOW_SHARE       8
#define THREAD_STACK_BYTES (1u << 20)
#define THREADS_MAX        16

enum state { WAITING, TAKEN, DONE };

struct job {
    struct bd_encoded_picture encoded;
    struct bd_picture_size from;
    uint32_t width_px, height_px; // of the result
    enum state state;
    enum bd_err err;
    struct bd_err_detail *detail; // where `err` is one
    uint8_t *rgba;
};

struct bd_picture_queue {
    pthread_mutex_t lock;
    pthread_cond_t changed;
    uint32_t thread_count;
    pthread_t threads[THREADS_MAX];
    uint32_t arrived_count; // under the lock, as all below
    bool has_begun, is_ending;
    uint32_t count, room;
    struct job *jobs;
    uint32_t started, taken; // all before them are
    uint64_t window_bytes, held_bytes;
    uint32_t side_max_px;
};

// --- one picture ----------------------------------------------------------------------------

struct path {
    char text[64];
};

static struct path path_of(const struct bd_encoded_picture *encoded)
{
    struct path path;
    snprintf(path.text, sizeof path.text, "images[%u].%s", encoded->image,
             encoded->is_in_view ? "bufferView" : "uri");
    return path;
}

static bool is_shrunk(const struct job *job)
{
    return job->width_px != job->from.width_px || job->height_px != job->from.height_px;
}

static enum bd_err shrink(struct job *job, struct bd_err_detail *detail)
{
    const struct bd_texels from = {job->from.width_px, job->from.height_px, job->rgba};
    const struct bd_texels to = {job->width_px, job->height_px,
                                 malloc(4 * (size_t)job->width_px * job->height_px)};
    const bool done = to.rgba && bd_shrink(&from, job->encoded.kind, &to);
    free(from.rgba);
    job->rgba = to.rgba;
    if (done) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_NO_MEMORY, path_of(&job->encoded).text,
                      "the import needs more memory than its limit");
}

static void decode(const struct bd_picture_queue *queue, struct job *job)
{
    const struct bd_decode_limits limits = {queue->side_max_px, UINT64_MAX};
    struct bd_err_detail detail = {0};
    uint32_t width_px, height_px;
    job->err =
        bd_picture_decode(job->encoded.bytes, job->encoded.size_bytes, &limits,
                          path_of(&job->encoded).text, &width_px, &height_px, &job->rgba, &detail);
    if (!job->err) BD_ASSERT(width_px == job->from.width_px && height_px == job->from.height_px);
    if (!job->err && is_shrunk(job)) job->err = shrink(job, &detail);
    if (!job->err) return;
    free(job->rgba);
    job->rgba = NULL;
    job->detail = malloc(sizeof *job->detail);
    if (job->detail) *job->detail = detail;
}

// --- whose turn -----------------------------------------------------------------------------

// The next that nobody has begun, if what is held leaves room for it. A picture that is alone may
// be as large as it likes.
static struct job *next_job(struct bd_picture_queue *queue)
{
    if (!queue->has_begun || queue->started == queue->count) return NULL;
    struct job *job = &queue->jobs[queue->started];
    if (queue->held_bytes > 0 && queue->held_bytes + job->from.decode_bytes > queue->window_bytes)
        return NULL;
    queue->held_bytes += job->from.decode_bytes;
    queue->started++;
    job->state = TAKEN;
    return job;
}

static void decode_unlocked(struct bd_picture_queue *queue, struct job *job)
{
    pthread_mutex_unlock(&queue->lock);
    decode(queue, job);
    pthread_mutex_lock(&queue->lock);
    job->state = DONE;
    pthread_cond_broadcast(&queue->changed);
}

static void *thread_main(void *user)
{
    struct bd_picture_queue *queue = user;
    pthread_mutex_lock(&queue->lock);
    queue->arrived_count++;
    pthread_cond_broadcast(&queue->changed);
    while (!queue->is_ending) {
        struct job *job = next_job(queue);
        if (job)
            decode_unlocked(queue, job);
        else
            pthread_cond_wait(&queue->changed, &queue->lock);
    }
    pthread_mutex_unlock(&queue->lock);
    return NULL;
}

// --- making and ending ----------------------------------------------------------------------

static void start_threads(struct bd_picture_queue *queue, uint32_t count)
{
    pthread_attr_t attributes;
    pthread_attr_init(&attributes);
    pthread_attr_setstacksize(&attributes, THREAD_STACK_BYTES);
    while (queue->thread_count < count && pthread_create(&queue->threads[queue->thread_count],
                                                         &attributes, thread_main, queue) == 0)
        queue->thread_count++;
    pthread_attr_destroy(&attributes);
    // A thread makes system calls of its own before it is in our hands.
    pthread_mutex_lock(&queue->lock);
    while (queue->arrived_count < queue->thread_count)
        pthread_cond_wait(&queue->changed, &queue->lock);
    pthread_mutex_unlock(&queue->lock);
}

struct bd_picture_queue *bd_picture_queue_create(uint32_t thread_count)
{
    struct bd_picture_queue *queue = calloc(1, sizeof *queue);
    if (!queue) return NULL;
    pthread_mutex_init(&queue->lock, NULL);
    pthread_cond_init(&queue->changed, NULL);
    start_threads(queue, thread_count < THREADS_MAX ? thread_count : THREADS_MAX);
    return queue;
}

void bd_picture_queue_destroy(struct bd_picture_queue **address)
{
    struct bd_picture_queue *queue = *address;
    *address = NULL;
    if (!queue) return;
    pthread_mutex_lock(&queue->lock);
    queue->is_ending = true;
    pthread_cond_broadcast(&queue->changed);
    pthread_mutex_unlock(&queue->lock);
    for (uint32_t i = 0; i < queue->thread_count; i++) pthread_join(queue->threads[i], NULL);
    for (uint32_t i = 0; i < queue->count; i++) {
        free(queue->jobs[i].rgba);
        free(queue->jobs[i].detail);
    }
    free(queue->jobs);
    pthread_cond_destroy(&queue->changed);
    pthread_mutex_destroy(&queue->lock);
    free(queue);
}

bool bd_picture_queue_add(struct bd_picture_queue *queue, const struct bd_encoded_picture *encoded)
{
    BD_ASSERT(!queue->has_begun);
    if (queue->count == queue->room) {
        const uint32_t room = queue->room ? 2 * queue->room : 16;
        struct job *jobs = realloc(queue->jobs, room * sizeof *jobs);
        if (!jobs) return false;
        queue->jobs = jobs;
        queue->room = room;
    }
    queue->jobs[queue->count++] = (struct job){.encoded = *encoded};
    return true;
}

// --- sizes ----------------------------------------------------------------------------------

static uint64_t texels_of(const struct job *job)
{
    return (uint64_t)job->width_px * job->height_px;
}

static enum bd_err measure(struct bd_picture_queue *queue, uint64_t *texels,
                           struct bd_err_detail *detail)
{
    *texels = 0;
    for (uint32_t i = 0; i < queue->count; i++) {
        struct job *job = &queue->jobs[i];
        enum bd_err err =
            bd_picture_measure(job->encoded.bytes, job->encoded.size_bytes, queue->side_max_px,
                               path_of(&job->encoded).text, &job->from, detail);
        if (err) return err;
        job->width_px = job->from.width_px;
        job->height_px = job->from.height_px;
        *texels += texels_of(job);
    }
    return BD_ERR_OK;
}

static uint32_t bits_of(uint64_t texels)
{
    return 64 - (uint32_t)__builtin_clzll(texels);
}

static uint32_t half(uint32_t side_px)
{
    return side_px > 1 ? side_px / 2 : 1;
}

// Halves pictures of `bits` in order until all have `most` texels or fewer. The sum then.
static uint64_t halve_those_of(struct bd_picture_queue *queue, uint32_t bits, uint64_t texels,
                               uint64_t most)
{
    for (uint32_t i = 0; i < queue->count && texels > most; i++) {
        struct job *job = &queue->jobs[i];
        if (bits_of(texels_of(job)) != bits) continue;
        texels -= texels_of(job);
        job->width_px = half(job->width_px);
        job->height_px = half(job->height_px);
        texels += texels_of(job);
    }
    return texels;
}

// Halving costs a picture at least one bit, so that one round for each is enough.
static uint64_t fit(struct bd_picture_queue *queue, uint64_t texels, uint64_t most)
{
    for (uint32_t bits = 64; bits > 1 && texels > most; bits--)
        texels = halve_those_of(queue, bits, texels, most);
    return texels;
}

static enum bd_err check_texels(const struct bd_picture_queue *queue, uint64_t most,
                                struct bd_err_detail *detail)
{
    uint64_t texels = 0;
    for (uint32_t i = 0; i < queue->count; i++) {
        texels += texels_of(&queue->jobs[i]);
        if (texels > most)
            return bd_err_set(detail, BD_ERR_LIMIT, path_of(&queue->jobs[i].encoded).text,
                              "pictures together have more than %llu texels",
                              (unsigned long long)most);
    }
    return BD_ERR_OK;
}

enum bd_err bd_picture_queue_begin(struct bd_picture_queue *queue,
                                   const struct bd_import_limits *limits,
                                   struct bd_shrunk_pictures *shrunk, struct bd_err_detail *detail)
{
    const uint64_t share = limits->memory_bytes / WINDOW_SHARE;
    *shrunk = (struct bd_shrunk_pictures){0};
    queue->side_max_px = limits->picture_side_px;
    enum bd_err err = measure(queue, &shrunk->texels_before, detail);
    if (err) return err;
    shrunk->texels_after = fit(queue, shrunk->texels_before, limits->picture_texels_kept);
    for (uint32_t i = 0; i < queue->count; i++) shrunk->count += is_shrunk(&queue->jobs[i]);
    const uint64_t most = limits->picture_texels < limits->picture_texels_kept
                              ? limits->picture_texels
                              : limits->picture_texels_kept;
    err = check_texels(queue, most, detail);
    if (err) return err;
    pthread_mutex_lock(&queue->lock);
    queue->window_bytes = share < WINDOW_BYTES ? share : WINDOW_BYTES;
    queue->has_begun = true;
    pthread_cond_broadcast(&queue->changed);
    pthread_mutex_unlock(&queue->lock);
    return BD_ERR_OK;
}

void bd_picture_queue_size(const struct bd_picture_queue *queue, uint32_t index, uint32_t *width_px,
                           uint32_t *height_px)
{
    BD_ASSERT_CMP(index, <, queue->count);
    *width_px = queue->jobs[index].width_px;
    *height_px = queue->jobs[index].height_px;
}

// --- out ------------------------------------------------------------------------------------

static enum bd_err tell(const struct job *job, struct bd_err_detail *detail)
{
    if (detail && job->detail) *detail = *job->detail;
    if (!job->detail)
        return bd_err_set(detail, job->err, path_of(&job->encoded).text, "cannot be decoded");
    return job->err;
}

enum bd_err bd_picture_queue_take(struct bd_picture_queue *queue, uint8_t **rgba,
                                  struct bd_err_detail *detail)
{
    pthread_mutex_lock(&queue->lock);
    BD_ASSERT_CMP(queue->taken, <, queue->count);
    struct job *job = &queue->jobs[queue->taken];
    // Whoever waits for it may as well decode it, or another that comes later.
    while (job->state != DONE) {
        struct job *mine = next_job(queue);
        if (mine)
            decode_unlocked(queue, mine);
        else
            pthread_cond_wait(&queue->changed, &queue->lock);
    }
    queue->taken++;
    queue->held_bytes -= job->from.decode_bytes;
    *rgba = job->rgba;
    job->rgba = NULL;
    pthread_cond_broadcast(&queue->changed);
    pthread_mutex_unlock(&queue->lock);
    return job->err ? tell(job, detail) : BD_ERR_OK;
}
