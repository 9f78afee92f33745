#include "tests/fuzz/pool.h"

#include <stdlib.h>
#include <string.h>
#include <uv.h>

#include "base/assert.h"
#include "image/decode.h"
#include "net/loop/background.h"
#include "scene/gltf/gltf.h"
#include "scene/import/import.h"
#include "scene/import/sky_map.h"
#include "scene/model/flat.h"
#include "tests/fuzz/machine.h"

#define WORK_MAX   4096
#define TIMERS_MAX 8

struct work {
    uv_work_t *request;
    uv_work_cb run;
    uv_after_work_cb back;
    struct bd_background *background; // instead of the three
};

struct queue {
    struct work items[WORK_MAX];
    uint32_t first, count;
};

struct timer {
    uv_timer_t *handle; // NULL: none
    uv_timer_cb fire;
    uint64_t due_ms, repeat_ms;
};

static struct {
    struct queue waiting, done;
    struct timer timers[TIMERS_MAX];
} pool;

static void push(struct queue *queue, struct work work)
{
    BD_ASSERT_CMP(queue->count, <, WORK_MAX);
    queue->items[(queue->first + queue->count++) % WORK_MAX] = work;
}

static bool pop(struct queue *queue, struct work *out)
{
    if (queue->count == 0) return false;
    *out = queue->items[queue->first];
    queue->first = (queue->first + 1) % WORK_MAX;
    queue->count--;
    return true;
}

void pool_begin(void)
{
    BD_ASSERT_CMP(pool_count(), ==, 0);
    memset(pool.timers, 0, sizeof pool.timers);
}

uint32_t pool_count(void)
{
    return pool.waiting.count + pool.done.count;
}

bool pool_run_one(void)
{
    struct work work;
    if (!pop(&pool.waiting, &work)) return false;
    if (work.background)
        work.background->run(work.background);
    else
        work.run(work.request);
    push(&pool.done, work);
    return true;
}

bool pool_return_one(void)
{
    struct work work;
    if (!pop(&pool.done, &work)) return false;
    if (work.background)
        work.background->back(work.background);
    else
        work.back(work.request, 0);
    return true;
}

static struct timer *first_due(void)
{
    struct timer *first = NULL;
    for (uint32_t i = 0; i < TIMERS_MAX; i++) {
        struct timer *timer = &pool.timers[i];
        if (timer->handle && timer->due_ms <= machine_now_ms() &&
            (!first || timer->due_ms < first->due_ms))
            first = timer;
    }
    return first;
}

void pool_pass_ms(uint64_t ms)
{
    machine_pass_ms(ms);
    // One that begins anew, again and again, is one that does not wait: enough of it.
    for (uint32_t i = 0; i < 64; i++) {
        struct timer *timer = first_due();
        if (!timer) return;
        const struct timer fired = *timer;
        timer->due_ms = machine_now_ms() + fired.repeat_ms;
        if (fired.repeat_ms == 0) timer->handle = NULL;
        fired.fire(fired.handle);
    }
}

// --- what the linker puts in the place of libuv's and of the import's -------------------------

int __wrap_uv_queue_work(uv_loop_t *loop, uv_work_t *request, uv_work_cb run,
                         uv_after_work_cb back);
int __wrap_uv_timer_start(uv_timer_t *handle, uv_timer_cb fire, uint64_t wait_ms,
                          uint64_t repeat_ms);
int __wrap_uv_signal_start(uv_signal_t *handle, uv_signal_cb fire, int number);
void __wrap_bd_background_start(struct bd_loop *loop, struct bd_background *work);

int __wrap_uv_queue_work(uv_loop_t *loop, uv_work_t *request, uv_work_cb run, uv_after_work_cb back)
{
    request->loop = loop;
    push(&pool.waiting, (struct work){request, run, back, NULL});
    return 0;
}

// A thread of its own, where others have the pool.
void __wrap_bd_background_start(struct bd_loop *loop, struct bd_background *work)
{
    work->loop = loop;
    if (work->begun) work->begun(work);
    push(&pool.waiting, (struct work){.background = work});
}

int __wrap_uv_timer_start(uv_timer_t *handle, uv_timer_cb fire, uint64_t wait_ms,
                          uint64_t repeat_ms)
{
    struct timer *place = NULL;
    for (uint32_t i = 0; i < TIMERS_MAX; i++)
        if (pool.timers[i].handle == handle) place = &pool.timers[i];
    for (uint32_t i = 0; !place && i < TIMERS_MAX; i++)
        if (!pool.timers[i].handle) place = &pool.timers[i];
    BD_ASSERT(place);
    *place = (struct timer){handle, fire, machine_now_ms() + wait_ms, repeat_ms};
    return 0;
}

// Signals are whoever's runs the target.
int __wrap_uv_signal_start(uv_signal_t *handle, uv_signal_cb fire, int number)
{
    (void)handle;
    (void)fire;
    (void)number;
    return 0;
}

enum bd_err __wrap_bd_import_under(struct bd_import_pool *unused,
                                   const struct bd_import_file *files, uint32_t file_count,
                                   const struct bd_import_limits *limits,
                                   const struct bd_environment *environment, struct bd_scene **out,
                                   struct bd_err_detail *detail);
enum bd_err __wrap_bd_import(struct bd_import_pool *unused, const struct bd_import_file *files,
                             uint32_t file_count, const struct bd_import_limits *limits,
                             struct bd_scene **out, struct bd_err_detail *detail);

enum bd_err __wrap_bd_import_under(struct bd_import_pool *unused,
                                   const struct bd_import_file *files, uint32_t file_count,
                                   const struct bd_import_limits *limits,
                                   const struct bd_environment *environment, struct bd_scene **out,
                                   struct bd_err_detail *detail)
{
    (void)unused;
    enum bd_err err = bd_gltf_read(files, file_count, limits, out, detail);
    if (err) return err;
    if (environment) (*out)->environment = *environment;
    if (environment && environment->map) bd_sky_map_retain(environment->map);
    err = bd_scene_finish(*out, detail);
    if (err) bd_scene_release(out);
    if (!err) bd_scene_set_hash(*out);
    return err;
}

enum bd_err __wrap_bd_import(struct bd_import_pool *unused, const struct bd_import_file *files,
                             uint32_t file_count, const struct bd_import_limits *limits,
                             struct bd_scene **out, struct bd_err_detail *detail)
{
    return __wrap_bd_import_under(unused, files, file_count, limits, NULL, out, detail);
}

enum bd_err __wrap_bd_import_picture(struct bd_import_pool *unused,
                                     const struct bd_import_file *file,
                                     const struct bd_import_limits *limits, struct bd_picture **out,
                                     struct bd_err_detail *detail);
enum bd_err __wrap_bd_import_sky_map(struct bd_import_pool *unused,
                                     const struct bd_import_file *file,
                                     const struct bd_import_limits *limits, struct bd_sky_map **out,
                                     uint64_t *negative_count, struct bd_err_detail *detail);

enum bd_err __wrap_bd_import_picture(struct bd_import_pool *unused,
                                     const struct bd_import_file *file,
                                     const struct bd_import_limits *limits, struct bd_picture **out,
                                     struct bd_err_detail *detail)
{
    (void)unused;
    const struct bd_decode_limits most = {limits->picture_side_px, limits->picture_texels};
    struct bd_picture *picture = calloc(1, sizeof *picture);
    BD_ASSERT(picture);
    picture->reference_count = 1;
    enum bd_err err =
        bd_picture_decode(file->bytes, file->size_bytes, &most, file->uri, &picture->width_px,
                          &picture->height_px, &picture->rgba, detail);
    if (err)
        bd_picture_release(&picture);
    else
        bd_picture_seal(picture);
    *out = picture;
    return err;
}

enum bd_err __wrap_bd_import_sky_map(struct bd_import_pool *unused,
                                     const struct bd_import_file *file,
                                     const struct bd_import_limits *limits, struct bd_sky_map **out,
                                     uint64_t *negative_count, struct bd_err_detail *detail)
{
    (void)unused;
    (void)limits;
    enum bd_err err =
        bd_sky_map_read(file->bytes, file->size_bytes, file->uri, out, negative_count, detail);
    if (!err) bd_sky_map_seal(*out);
    return err;
}
