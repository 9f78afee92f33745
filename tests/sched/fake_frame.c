#include "fake_frame.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/assert.h"
#include "base/hash.h"
#include "frame/frame.h"

#define SLICES_MAX   10
#define SLICE_NS     150000
#define LOSS_ONE_IN  24 // frames, more or less
#define SPOIL_ONE_IN 96

struct bd_gpu {
    pthread_t thread;
    struct bd_gpu_caps caps;
    enum bd_err status;
};

static atomic_uint begun_count, stopped_count, lost_count;
static atomic_bool is_rendering;

struct fake_frame_counts fake_frame_counts(void)
{
    return (struct fake_frame_counts){atomic_load(&begun_count), atomic_load(&stopped_count),
                                      atomic_load(&lost_count)};
}

float fake_frame_value(uint64_t seed, enum bd_layer layer)
{
    uint32_t of = layer;
    return 0.5f + (float)(bd_hash64(&of, sizeof of, seed) % 1024) / 1024;
}

// --- gpu/ -----------------------------------------------------------------------------------

static void assert_own_thread(const struct bd_gpu *gpu)
{
    BD_ASSERT(pthread_equal(gpu->thread, pthread_self()));
}

enum bd_err __wrap_bd_gpu_create(const struct bd_gpu_options *options, struct bd_gpu **out,
                                 struct bd_err_detail *detail);
enum bd_err __wrap_bd_gpu_create(const struct bd_gpu_options *options, struct bd_gpu **out,
                                 struct bd_err_detail *detail)
{
    (void)options, (void)detail;
    struct bd_gpu *gpu = calloc(1, sizeof *gpu);
    BD_ASSERT(gpu);
    gpu->thread = pthread_self();
    strcpy(gpu->caps.name, "fake");
    strcpy(gpu->caps.device_class, "fake-1");
    gpu->caps.software = true;
    *out = gpu;
    return BD_ERR_OK;
}

void __wrap_bd_gpu_destroy(struct bd_gpu **gpu);
void __wrap_bd_gpu_destroy(struct bd_gpu **gpu)
{
    assert_own_thread(*gpu);
    free(*gpu);
    *gpu = NULL;
}

const struct bd_gpu_caps *__wrap_bd_gpu_caps(const struct bd_gpu *gpu);
const struct bd_gpu_caps *__wrap_bd_gpu_caps(const struct bd_gpu *gpu)
{
    assert_own_thread(gpu);
    return &gpu->caps;
}

enum bd_err __wrap_bd_gpu_status(struct bd_gpu *gpu);
enum bd_err __wrap_bd_gpu_status(struct bd_gpu *gpu)
{
    assert_own_thread(gpu);
    return gpu->status;
}

void __wrap_bd_gpu_memory(const struct bd_gpu *gpu, struct bd_gpu_memory *out);
void __wrap_bd_gpu_memory(const struct bd_gpu *gpu, struct bd_gpu_memory *out)
{
    assert_own_thread(gpu);
    *out = (struct bd_gpu_memory){.used_bytes = 1 << 20, .peak_bytes = 1 << 20};
}

void __wrap_bd_gpu_set_memory_limit(struct bd_gpu *gpu, uint64_t limit_bytes);
void __wrap_bd_gpu_set_memory_limit(struct bd_gpu *gpu, uint64_t limit_bytes)
{
    (void)limit_bytes;
    assert_own_thread(gpu);
}

// --- frame/ ---------------------------------------------------------------------------------

void __wrap_bd_renderer_init(struct bd_renderer *renderer, struct bd_gpu *gpu,
                             uint64_t memo_budget_bytes);
void __wrap_bd_renderer_init(struct bd_renderer *renderer, struct bd_gpu *gpu,
                             uint64_t memo_budget_bytes)
{
    (void)memo_budget_bytes;
    assert_own_thread(gpu);
    *renderer = (struct bd_renderer){.gpu = gpu};
}

void __wrap_bd_memo_keep_last_frame(struct bd_memo *memo, uint64_t bytes_max);
void __wrap_bd_memo_keep_last_frame(struct bd_memo *memo, uint64_t bytes_max)
{
    (void)bytes_max;
    BD_ASSERT(!memo);
}

void __wrap_bd_renderer_finish(struct bd_renderer *renderer);
void __wrap_bd_renderer_finish(struct bd_renderer *renderer)
{
    assert_own_thread(renderer->gpu);
    *renderer = (struct bd_renderer){0};
}

void __wrap_bd_renderer_suspend(struct bd_renderer *renderer, struct bd_suspended_frame *out);
void __wrap_bd_renderer_suspend(struct bd_renderer *renderer, struct bd_suspended_frame *out)
{
    assert_own_thread(renderer->gpu);
    BD_ASSERT(atomic_exchange(&is_rendering, false));
    *out = (struct bd_suspended_frame){0};
}

void __wrap_bd_renderer_resume(struct bd_renderer *renderer,
                               const struct bd_suspended_frame *suspended);
void __wrap_bd_renderer_resume(struct bd_renderer *renderer,
                               const struct bd_suspended_frame *suspended)
{
    (void)suspended;
    assert_own_thread(renderer->gpu);
    BD_ASSERT(!atomic_exchange(&is_rendering, true));
}

static void fill(struct bd_image *image, float value)
{
    const size_t count = (size_t)image->width_px * image->height_px * image->channel_count;
    for (size_t i = 0; i < count; i++) image->pixels[i] = value;
}

static void draw(const struct bd_frame_request *request, struct bd_image *layers[BD_LAYER_COUNT])
{
    for (uint32_t l = 0; l < BD_LAYER_COUNT; l++) {
        if (l != BD_LAYER_BEAUTY && !(request->layers >> l & 1)) continue;
        layers[l] = bd_image_create(request->width_px, request->height_px,
                                    bd_layer_channel_count((enum bd_layer)l));
        BD_ASSERT(layers[l]);
        fill(layers[l], fake_frame_value(request->seed, (enum bd_layer)l));
    }
}

static void fill_report(const struct bd_frame_request *request, struct bd_report *report)
{
    report->width_px = request->width_px;
    report->height_px = request->height_px;
    report->seed = request->seed;
    report->params = request->params;
    report->time_ms.total = 1;
}

static enum bd_err lose(struct bd_gpu *gpu)
{
    gpu->status = BD_ERR_DEVICE_LOST;
    atomic_fetch_add(&lost_count, 1);
    return BD_ERR_DEVICE_LOST;
}

// `chance` differs from one attempt at a frame to the next.
static enum bd_err run_slices(struct bd_gpu *gpu, uint64_t chance,
                              enum bd_err (*should_stop)(void *user), void *user)
{
    const struct timespec slice = {.tv_nsec = SLICE_NS};
    const uint64_t count = 1 + chance % SLICES_MAX;
    for (uint64_t i = 0; i < count; i++) {
        nanosleep(&slice, NULL);
        enum bd_err err = should_stop(user);
        if (err) return err;
        if (chance / SLICES_MAX % LOSS_ONE_IN == 0 && i == count / 2) return lose(gpu);
    }
    if (chance / SLICES_MAX % SPOIL_ONE_IN == 1) gpu->status = BD_ERR_INTERNAL;
    return BD_ERR_OK;
}

enum bd_err __wrap_bd_frame_render(struct bd_renderer *renderer, struct bd_scene *scene,
                                   const struct bd_frame_request *request,
                                   enum bd_err (*should_stop)(void *user), void *user,
                                   struct bd_image *layers[BD_LAYER_COUNT],
                                   struct bd_report *report, struct bd_err_detail *detail);
enum bd_err __wrap_bd_frame_render(struct bd_renderer *renderer, struct bd_scene *scene,
                                   const struct bd_frame_request *request,
                                   enum bd_err (*should_stop)(void *user), void *user,
                                   struct bd_image *layers[BD_LAYER_COUNT],
                                   struct bd_report *report, struct bd_err_detail *detail)
{
    (void)scene, (void)detail;
    assert_own_thread(renderer->gpu);
    BD_ASSERT(!atomic_exchange(&is_rendering, true));
    for (uint32_t l = 0; l < BD_LAYER_COUNT; l++) BD_ASSERT(!layers[l]);
    uint32_t attempt = atomic_fetch_add(&begun_count, 1);
    enum bd_err err = run_slices(renderer->gpu, bd_hash64(&attempt, sizeof attempt, request->seed),
                                 should_stop, user);
    fill_report(request, report);
    report->stopped = err == BD_ERR_CANCELLED  ? BD_STOPPED_CANCELLED
                      : err == BD_ERR_DEADLINE ? BD_STOPPED_DEADLINE
                                               : BD_STOPPED_COMPLETE;
    if (err)
        atomic_fetch_add(&stopped_count, 1);
    else
        draw(request, layers);
    atomic_store(&is_rendering, false);
    return err;
}
