// Memory barriers: which the next dispatch, draw or copy needs, by what was written and read before it.

#include "gpu/gpu_internal.h"

static const GLbitfield barrier_bits[BD_USE_COUNT] = {
    [BD_USE_FETCH] = GL_TEXTURE_FETCH_BARRIER_BIT,
    [BD_USE_IMAGE] = GL_SHADER_IMAGE_ACCESS_BARRIER_BIT,
    [BD_USE_STORAGE] = GL_SHADER_STORAGE_BARRIER_BIT,
    [BD_USE_VERTEX] = GL_VERTEX_ATTRIB_ARRAY_BARRIER_BIT,
    [BD_USE_INDEX] = GL_ELEMENT_ARRAY_BARRIER_BIT,
    [BD_USE_COMMAND] = GL_COMMAND_BARRIER_BIT,
    [BD_USE_TARGET] = GL_FRAMEBUFFER_BARRIER_BIT,
    [BD_USE_TEX_UPDATE] = GL_TEXTURE_UPDATE_BARRIER_BIT,
    [BD_USE_BUF_UPDATE] = GL_BUFFER_UPDATE_BARRIER_BIT,
};

static bool by_shader(enum bd_use use)
{
    return use == BD_USE_FETCH || use == BD_USE_IMAGE || use == BD_USE_STORAGE;
}

// Resources are const where the caller only reads them; when they were read is not part of what
// the caller sees.
static struct bd_access *noted(const struct bd_access *access)
{
    return (struct bd_access *)(uintptr_t)access;
}

void bd_barrier_read(struct bd_gpu *gpu, const struct bd_access *access, enum bd_use use)
{
    if (access->written_at > gpu->barrier_at[use]) gpu->barriers_wanted |= barrier_bits[use];
    if (by_shader(use)) noted(access)->read_at = gpu->serial;
}

// A write by a shader must wait for earlier reads too: invocations of two dispatches may run side
// by side. Writes that the API orders itself need to wait for shaders' writes only.
void bd_barrier_write(struct bd_gpu *gpu, const struct bd_access *access, enum bd_use use)
{
    bool shader_writes = use == BD_USE_IMAGE || use == BD_USE_STORAGE;
    if (access->written_at > gpu->barrier_at[use] ||
        (shader_writes && access->read_at > gpu->barrier_at[use]))
        gpu->barriers_wanted |= barrier_bits[use];
    if (shader_writes) noted(access)->written_at = gpu->serial;
}

void bd_barrier_issue(struct bd_gpu *gpu)
{
    if (!gpu->barriers_wanted) return;
    glMemoryBarrier(gpu->barriers_wanted);
    for (int use = 0; use < BD_USE_COUNT; use++)
        if (gpu->barriers_wanted & barrier_bits[use]) gpu->barrier_at[use] = gpu->serial - 1;
    gpu->barriers_wanted = 0;
}
