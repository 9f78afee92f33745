// How long each pass took on the device, by timestamps.

#include <stdlib.h>

#include "base/assert.h"
#include "gpu/gpu_internal.h"

// On a software device a timestamp is taken when the tiles of its batch are worked on, so a batch
// of its own, before and after, is what makes it a moment between two passes.
static void stamp(struct bd_gpu *gpu, GLuint query)
{
    if (gpu->caps.software) glFlush();
    glQueryCounter(query, GL_TIMESTAMP);
    if (gpu->caps.software) glFlush();
}

static void grow(struct bd_timers *timers)
{
    uint32_t capacity = timers->capacity ? 2 * timers->capacity : 64;
    timers->passes = realloc(timers->passes, capacity * sizeof *timers->passes);
    BD_ASSERT(timers->passes);
    for (uint32_t i = timers->capacity; i < capacity; i++) {
        timers->passes[i] = (struct bd_timer_pass){0};
        glCreateQueries(GL_TIMESTAMP, 2, timers->passes[i].queries);
    }
    timers->capacity = capacity;
}

void bd_timers_finish(struct bd_gpu *gpu)
{
    struct bd_timers *timers = &gpu->timers;
    for (uint32_t i = 0; i < timers->capacity; i++) glDeleteQueries(2, timers->passes[i].queries);
    free(timers->passes);
    *timers = (struct bd_timers){0};
}

void bd_timers_add_compile(struct bd_gpu *gpu, double ms)
{
    gpu->compile_ms += ms;
    if (gpu->timers.open) gpu->timers.passes[gpu->timers.count - 1].compile_ms += ms;
}

void bd_gpu_pass_begin(struct bd_gpu *gpu, const char *name)
{
    struct bd_timers *timers = &gpu->timers;
    BD_ASSERT(!timers->open);
    if (timers->count == timers->capacity) grow(timers);
    struct bd_timer_pass *pass = &timers->passes[timers->count++];
    pass->name = name;
    pass->compile_ms = 0;
    timers->open = true;
    glPushDebugGroup(GL_DEBUG_SOURCE_APPLICATION, 0, -1, name);
    stamp(gpu, pass->queries[0]);
    bd_gpu_check(gpu, "bd_gpu_pass_begin");
}

void bd_gpu_pass_end(struct bd_gpu *gpu)
{
    struct bd_timers *timers = &gpu->timers;
    BD_ASSERT(timers->open && !gpu->in_target);
    stamp(gpu, timers->passes[timers->count - 1].queries[1]);
    glPopDebugGroup();
    timers->open = false;
    bd_gpu_check(gpu, "bd_gpu_pass_end");
}

const char *bd_gpu_pass_name(const struct bd_gpu *gpu)
{
    const struct bd_timers *timers = &gpu->timers;
    return timers->open ? timers->passes[timers->count - 1].name : NULL;
}

static double take_ms(const struct bd_timer_pass *pass)
{
    GLuint64 begin_ns = 0, end_ns = 0;
    glGetQueryObjectui64v(pass->queries[0], GL_QUERY_RESULT, &begin_ns);
    glGetQueryObjectui64v(pass->queries[1], GL_QUERY_RESULT, &end_ns);
    double ms = end_ns > begin_ns ? (double)(end_ns - begin_ns) * 1e-6 - pass->compile_ms : 0;
    return ms > 0 ? ms : 0;
}

// Passes that did not fit into `out` stay for the next call: they move to the front, their
// queries with them.
static void forget_first(struct bd_timers *timers, uint32_t taken)
{
    for (uint32_t i = 0; i + taken < timers->count; i++) {
        struct bd_timer_pass kept = timers->passes[i + taken];
        timers->passes[i + taken] = timers->passes[i];
        timers->passes[i] = kept;
    }
    timers->count -= taken;
}

uint32_t bd_gpu_take_pass_times(struct bd_gpu *gpu, struct bd_gpu_pass_time *out, uint32_t max)
{
    struct bd_timers *timers = &gpu->timers;
    BD_ASSERT(!timers->open);
    uint32_t count = timers->count < max ? timers->count : max;
    bool lost = bd_gpu_status(gpu) == BD_ERR_DEVICE_LOST; // queries of a lost context say nothing
    for (uint32_t i = 0; i < count; i++)
        out[i] = (struct bd_gpu_pass_time){timers->passes[i].name,
                                           lost ? 0 : take_ms(&timers->passes[i])};
    forget_first(timers, count);
    bd_gpu_check(gpu, "bd_gpu_take_pass_times");
    return count;
}
