// What holds of a device as a whole: errors that stick, waiting, and the memory that it may use.

#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/assert.h"
#include "base/log.h"
#include "gpu/gpu_internal.h"
#include "gpu/shader_cache.h"

// --- errors that stick --------------------------------------------------------------------

static void stick(struct bd_gpu *gpu, enum bd_err err, const char *call, const char *what)
{
    bd_log(BD_LOG_ERROR, "gpu", "%s: %s", call, what);
    // A lost device explains every error after it.
    if (gpu->status == BD_ERR_OK || err == BD_ERR_DEVICE_LOST) gpu->status = err;
}

bool bd_gpu_check(struct bd_gpu *gpu, const char *call)
{
    bool clean = true;
    // Bounded: a lost context may answer with errors for ever.
    for (int i = 0; i < 8; i++) {
        GLenum error = glGetError();
        if (error == GL_NO_ERROR) return clean;
        clean = false;
        char what[32];
        snprintf(what, sizeof what, "OpenGL error 0x%04x", error);
        if (gpu->status == BD_ERR_DEVICE_LOST) continue;
        if (error == GL_CONTEXT_LOST)
            stick(gpu, BD_ERR_DEVICE_LOST, call, "the context was lost");
        else if (error == GL_OUT_OF_MEMORY)
            stick(gpu, BD_ERR_NO_MEMORY, call, "out of memory");
        else
            stick(gpu, BD_ERR_INTERNAL, call, what);
    }
    return clean;
}

GLenum bd_gpu_take_error(void)
{
    GLenum first = glGetError();
    for (int i = 0; i < 8 && first != GL_NO_ERROR && glGetError() != GL_NO_ERROR; i++) continue;
    return first;
}

void bd_gpu_check_reset(struct bd_gpu *gpu)
{
    if (gpu->status == BD_ERR_DEVICE_LOST) return;
    switch (glGetGraphicsResetStatus()) {
    case GL_NO_ERROR:
        return;
    case GL_GUILTY_CONTEXT_RESET:
        stick(gpu, BD_ERR_DEVICE_LOST, "reset", "the device was reset, through our work");
        return;
    case GL_INNOCENT_CONTEXT_RESET:
        stick(gpu, BD_ERR_DEVICE_LOST, "reset", "the device was reset, through another's work");
        return;
    default:
        stick(gpu, BD_ERR_DEVICE_LOST, "reset", "the device was reset");
        return;
    }
}

enum bd_err bd_gpu_why_not_made(struct bd_gpu *gpu)
{
    bd_gpu_check_reset(gpu);
    return gpu->status == BD_ERR_DEVICE_LOST ? BD_ERR_DEVICE_LOST : BD_ERR_NO_MEMORY;
}

enum bd_err bd_gpu_status(struct bd_gpu *gpu)
{
    return gpu->status;
}

void bd_gpu_flush(struct bd_gpu *gpu)
{
    if (gpu->caps.software)
        glFinish();
    else
        glFlush();
    bd_gpu_check(gpu, "bd_gpu_flush");
}

enum bd_err bd_gpu_wait(struct bd_gpu *gpu)
{
    glFinish();
    bd_gpu_check(gpu, "bd_gpu_wait");
    bd_gpu_check_reset(gpu);
    if (++gpu->wait_count == gpu->lose_after_waits)
        stick(gpu, BD_ERR_DEVICE_LOST, "bd_gpu_wait", "loss of the device, injected");
    return gpu->status;
}

// --- memory -------------------------------------------------------------------------------

enum bd_err bd_gpu_reserve(struct bd_gpu *gpu, const char *name, uint64_t size_bytes,
                           struct bd_err_detail *detail)
{
    struct bd_gpu_memory *memory = &gpu->memory;
    bool fits =
        memory->limit_bytes == 0 || (memory->used_bytes <= memory->limit_bytes &&
                                     size_bytes <= memory->limit_bytes - memory->used_bytes);
    if (!fits)
        return bd_err_set(detail, BD_ERR_NO_MEMORY, "gpu_memory",
                          "%s needs %.1f MiB of GPU memory; %.1f of the %.1f MiB allowed are used",
                          name, (double)size_bytes / 1048576.0,
                          (double)memory->used_bytes / 1048576.0,
                          (double)memory->limit_bytes / 1048576.0);
    memory->used_bytes += size_bytes;
    if (memory->used_bytes > memory->peak_bytes) memory->peak_bytes = memory->used_bytes;
    return BD_ERR_OK;
}

void bd_gpu_release(struct bd_gpu *gpu, uint64_t size_bytes)
{
    BD_ASSERT_CMP(gpu->memory.used_bytes, >=, size_bytes);
    gpu->memory.used_bytes -= size_bytes;
}

void bd_gpu_memory(const struct bd_gpu *gpu, struct bd_gpu_memory *out)
{
    *out = gpu->memory;
}

void bd_gpu_memory_reset_peak(struct bd_gpu *gpu)
{
    gpu->memory.peak_bytes = gpu->memory.used_bytes;
}

void bd_gpu_set_memory_limit(struct bd_gpu *gpu, uint64_t limit_bytes)
{
    gpu->memory.limit_bytes = limit_bytes;
}

const struct bd_gpu_caps *bd_gpu_caps(const struct bd_gpu *gpu)
{
    return &gpu->caps;
}

// --- interruptions ------------------------------------------------------------------------

void bd_gpu_suspend(struct bd_gpu *gpu, struct bd_gpu_suspended *out)
{
    *out = (struct bd_gpu_suspended){
        .pass = bd_gpu_pass_name(gpu),
        .in_target = gpu->in_target,
        .target = gpu->target,
        .first_row = gpu->first_row,
        .row_count = gpu->row_count,
        .memory_peak_bytes = gpu->memory.peak_bytes,
    };
    if (out->in_target) bd_gpu_target_end(gpu);
    if (out->pass) bd_gpu_pass_end(gpu);
}

void bd_gpu_resume(struct bd_gpu *gpu, const struct bd_gpu_suspended *suspended)
{
    if (gpu->memory.peak_bytes < suspended->memory_peak_bytes)
        gpu->memory.peak_bytes = suspended->memory_peak_bytes;
    if (suspended->pass) bd_gpu_pass_begin(gpu, suspended->pass);
    if (suspended->in_target) bd_draw_resume_target(gpu, suspended);
}

// --- making and ending --------------------------------------------------------------------

static void GLAPIENTRY on_debug(GLenum source, GLenum type, GLuint id, GLenum severity,
                                GLsizei length, const GLchar *message, const void *user)
{
    (void)length, (void)user;
    // Our own debug groups come back as messages.
    if (source == GL_DEBUG_SOURCE_APPLICATION) return;
    bool bad = type == GL_DEBUG_TYPE_ERROR || severity == GL_DEBUG_SEVERITY_HIGH;
    bd_log(bad ? BD_LOG_ERROR : BD_LOG_DEBUG, "gpu/driver", "%s (%u)", message, id);
}

static void start_debug(bool debug)
{
    glEnable(GL_DEBUG_OUTPUT);
    if (debug) glEnable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
    glDebugMessageCallback(on_debug, NULL);
}

// State that never changes afterwards.
static void set_fixed_state(void)
{
    glClipControl(GL_UPPER_LEFT, GL_ZERO_TO_ONE);
    glDepthFunc(GL_GREATER);
    glCullFace(GL_BACK);
    glEnable(GL_FRAMEBUFFER_SRGB);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    glDisable(GL_DITHER);
}

static enum bd_err make_objects(struct bd_gpu *gpu, struct bd_err_detail *detail)
{
    static const uint8_t zeroes[64 * 1024];
    glCreateVertexArrays(1, &gpu->vertex_array);
    glCreateFramebuffers(1, &gpu->framebuffer);
    glCreateBuffers(1, &gpu->zero_buffer);
    glNamedBufferStorage(gpu->zero_buffer, sizeof zeroes, zeroes, 0);
    glCreateBuffers(1, &gpu->scratch_buffer);
    glNamedBufferStorage(gpu->scratch_buffer, sizeof zeroes, zeroes, GL_DYNAMIC_STORAGE_BIT);
    enum bd_err err = bd_uniform_ring_init(gpu, detail);
    if (err) return err;
    if (bd_gpu_take_error() == GL_NO_ERROR) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_DEVICE, "device", "%s does not work", gpu->caps.name);
}

static void destroy_objects(struct bd_gpu *gpu)
{
    bd_timers_finish(gpu);
    bd_programs_finish(gpu);
    bd_uniform_ring_finish(gpu);
    glDeleteSamplers(27, gpu->samplers);
    glDeleteBuffers(1, &gpu->scratch_buffer);
    glDeleteBuffers(1, &gpu->zero_buffer);
    glDeleteFramebuffers(1, &gpu->framebuffer);
    glDeleteVertexArrays(1, &gpu->vertex_array);
}

enum bd_err bd_gpu_create(const struct bd_gpu_options *options, struct bd_gpu **out,
                          struct bd_err_detail *detail)
{
    *out = NULL;
    struct bd_gpu *gpu = calloc(1, sizeof *gpu);
    BD_ASSERT(gpu);
    bd_shader_cache_prepare(options->cache_directory, options->disk_reserve_bytes);
    // Read when Mesa is loaded; its cache keeps such code apart.
    if (options->quick_code) setenv("GALLIVM_PERF", "nopt", 0);
    enum bd_err err = bd_choose(options->device, options->debug, &gpu->egl, detail);
    if (err) goto free_gpu;
    gpu->memory.limit_bytes = options->memory_limit_bytes;
    gpu->lose_after_waits = options->lose_after_waits;
    bd_read_caps(&gpu->caps);
    gpu->arrays_are_textures = gpu->caps.software;
    start_debug(options->debug);
    set_fixed_state();
    err = make_objects(gpu, detail);
    if (err) goto close_egl;
    *out = gpu;
    return BD_ERR_OK;

close_egl:
    destroy_objects(gpu);
    bd_egl_close(&gpu->egl);
free_gpu:
    free(gpu);
    return err;
}

void bd_gpu_destroy(struct bd_gpu **gpu)
{
    if (!*gpu) return;
    BD_ASSERT_CMP((*gpu)->memory.used_bytes, ==, 0);
    destroy_objects(*gpu);
    bd_egl_close(&(*gpu)->egl);
    free(*gpu);
    *gpu = NULL;
}
