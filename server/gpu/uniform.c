// Arguments of shaders: a ring of uniform blocks that frames write through.

#include <string.h>

#include "base/assert.h"
#include "gpu/gpu_internal.h"

enum bd_err bd_uniform_ring_init(struct bd_gpu *gpu, struct bd_err_detail *detail)
{
    struct bd_uniform_ring *ring = &gpu->uniforms;
    const GLbitfield flags = GL_MAP_WRITE_BIT | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT;
    const GLsizeiptr size = BD_UNIFORM_SEGMENT_COUNT * BD_UNIFORM_SEGMENT_BYTES;
    GLint alignment = 256;
    glGetIntegerv(GL_UNIFORM_BUFFER_OFFSET_ALIGNMENT, &alignment);
    ring->alignment_bytes = (uint32_t)alignment;
    glCreateBuffers(1, &ring->id);
    glNamedBufferStorage(ring->id, size, NULL, flags);
    ring->mapped = glMapNamedBufferRange(ring->id, 0, size, flags);
    if (bd_gpu_take_error() == GL_NO_ERROR && ring->mapped) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_DEVICE, "device", "no mapped buffer for uniforms");
}

void bd_uniform_ring_finish(struct bd_gpu *gpu)
{
    struct bd_uniform_ring *ring = &gpu->uniforms;
    for (uint32_t i = 0; i < BD_UNIFORM_SEGMENT_COUNT; i++) glDeleteSync(ring->fences[i]);
    glDeleteBuffers(1, &ring->id);
    *ring = (struct bd_uniform_ring){0};
}

static void next_segment(struct bd_uniform_ring *ring)
{
    ring->fences[ring->segment] = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
    ring->segment = (ring->segment + 1) % BD_UNIFORM_SEGMENT_COUNT;
    ring->used_bytes = 0;
    GLsync *fence = &ring->fences[ring->segment];
    if (!*fence) return;
    // A lost context signals its fences or fails the wait; it does not hang here.
    GLenum state;
    do {
        state = glClientWaitSync(*fence, GL_SYNC_FLUSH_COMMANDS_BIT, 1000000000u);
    } while (state == GL_TIMEOUT_EXPIRED && glGetGraphicsResetStatus() == GL_NO_ERROR);
    glDeleteSync(*fence);
    *fence = NULL;
}

void bd_uniform_bind(struct bd_gpu *gpu, uint32_t index, const void *bytes, size_t size_bytes)
{
    struct bd_uniform_ring *ring = &gpu->uniforms;
    BD_ASSERT_CMP(size_bytes, <=, BD_UNIFORM_BLOCK_MAX_BYTES);
    uint32_t mask = ring->alignment_bytes - 1;
    uint32_t taken_bytes = ((uint32_t)size_bytes + mask) & ~mask;
    if (ring->used_bytes + taken_bytes > BD_UNIFORM_SEGMENT_BYTES) next_segment(ring);
    uint32_t offset = ring->segment * BD_UNIFORM_SEGMENT_BYTES + ring->used_bytes;
    memcpy(ring->mapped + offset, bytes, size_bytes);
    ring->used_bytes += taken_bytes;
    // Whole vec4s: a std140 block's size is rounded up to that.
    GLsizeiptr bound = (GLsizeiptr)((size_bytes + 15) & ~(size_t)15);
    glBindBufferRange(GL_UNIFORM_BUFFER, index, ring->id, (GLintptr)offset, bound);
}
