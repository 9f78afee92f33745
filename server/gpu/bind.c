// Bindings of textures, images and buffers, and the dispatches that use them.

#include "base/assert.h"
#include "gpu/gpu_internal.h"

#define COUNT(array) ((uint32_t)(sizeof(array) / sizeof *(array)))

static void note_textures_and_arrays(struct bd_gpu *gpu, const struct bd_bindings *bindings)
{
    enum bd_use array_use = gpu->arrays_are_textures ? BD_USE_FETCH : BD_USE_STORAGE;
    for (uint32_t i = 0; i < BD_BINDING_MAX; i++) {
        const struct bd_tex *tex = bindings->textures[i].tex;
        const struct bd_buf *array = bindings->arrays[i];
        BD_ASSERT(!(tex && array)); // they share a number space
        if (tex) bd_barrier_read(gpu, &tex->access, BD_USE_FETCH);
        if (array) bd_barrier_read(gpu, &array->access, array_use);
    }
}

void bd_bind_note(struct bd_gpu *gpu, const struct bd_bindings *bindings)
{
    note_textures_and_arrays(gpu, bindings);
    for (uint32_t i = 0; i < COUNT(bindings->images); i++) {
        const struct bd_tex *tex = bindings->images[i].tex;
        if (!tex) continue;
        BD_ASSERT(bindings->images[i].read || bindings->images[i].write);
        if (bindings->images[i].write)
            bd_barrier_write(gpu, &tex->access, BD_USE_IMAGE);
        else
            bd_barrier_read(gpu, &tex->access, BD_USE_IMAGE);
    }
    for (uint32_t i = 0; i < COUNT(bindings->storage); i++) {
        const struct bd_buf *buf = bindings->storage[i].buf;
        if (!buf) continue;
        BD_ASSERT(bindings->storage[i].read || bindings->storage[i].write);
        if (bindings->storage[i].write)
            bd_barrier_write(gpu, &buf->access, BD_USE_STORAGE);
        else
            bd_barrier_read(gpu, &buf->access, BD_USE_STORAGE);
    }
}

static void bind_texture(struct bd_gpu *gpu, const struct bd_bindings *bindings, uint32_t unit)
{
    const struct bd_tex *tex = bindings->textures[unit].tex;
    enum bd_sampling sampling = bindings->textures[unit].sampling;
    // Filtered integers are undefined: GL gives black, silently.
    BD_ASSERT(sampling == BD_SAMPLE_NEAREST || !bd_format_info(tex->desc.format)->is_uint);
    glBindTextureUnit(unit, tex->id);
    glBindSampler(unit, bd_sampler(gpu, sampling, bindings->textures[unit].wrap_s,
                                   bindings->textures[unit].wrap_t));
}

static void bind_array(struct bd_gpu *gpu, const struct bd_buf *buf, uint32_t unit)
{
    if (gpu->arrays_are_textures) {
        glBindTextureUnit(unit, buf->texel_view);
        glBindSampler(unit, 0);
    } else {
        // Storage blocks 0 to 7 are those of bd_bindings.storage: see common/array.glsl.
        glBindBufferBase(GL_SHADER_STORAGE_BUFFER, COUNT(((struct bd_bindings *)0)->storage) + unit,
                         buf->id);
    }
}

void bd_bind_textures(struct bd_gpu *gpu, const struct bd_bindings *bindings)
{
    for (uint32_t i = 0; i < BD_BINDING_MAX; i++) {
        if (bindings->textures[i].tex) bind_texture(gpu, bindings, i);
        if (bindings->arrays[i]) bind_array(gpu, bindings->arrays[i], i);
    }
}

void bd_unbind_images(struct bd_gpu *gpu, const struct bd_bindings *bindings)
{
    for (uint32_t i = 0; i < COUNT(bindings->images); i++) {
        if (bindings->images[i].tex || !(gpu->images_bound >> i & 1)) continue;
        glBindImageTexture(i, 0, 0, GL_FALSE, 0, GL_READ_ONLY, GL_RGBA32F);
        gpu->images_bound &= ~(1u << i);
    }
}

static void bind_image(struct bd_gpu *gpu, const struct bd_bindings *bindings, uint32_t unit)
{
    const struct bd_tex *tex = bindings->images[unit].tex;
    const struct bd_format_info *info = bd_format_info(tex->desc.format);
    BD_ASSERT(info->is_image);
    bool all_layers = bindings->images[unit].layer < 0;
    BD_ASSERT(!all_layers || tex->desc.layer_count > 0);
    GLenum access = !bindings->images[unit].read   ? GL_WRITE_ONLY
                    : bindings->images[unit].write ? GL_READ_WRITE
                                                   : GL_READ_ONLY;
    glBindImageTexture(unit, tex->id, 0, all_layers, all_layers ? 0 : bindings->images[unit].layer,
                       access, info->internal_format);
    gpu->images_bound |= 1u << unit;
}

void bd_bind_all(struct bd_gpu *gpu, const struct bd_bindings *bindings)
{
    bd_bind_textures(gpu, bindings);
    bd_unbind_images(gpu, bindings);
    for (uint32_t i = 0; i < COUNT(bindings->images); i++)
        if (bindings->images[i].tex) bind_image(gpu, bindings, i);
    for (uint32_t i = 0; i < COUNT(bindings->storage); i++)
        if (bindings->storage[i].buf)
            glBindBufferBase(GL_SHADER_STORAGE_BUFFER, i, bindings->storage[i].buf->id);
    for (uint32_t i = 0; i < COUNT(bindings->uniforms); i++)
        if (bindings->uniforms[i].bytes)
            bd_uniform_bind(gpu, i, bindings->uniforms[i].bytes, bindings->uniforms[i].size_bytes);
}

// `counts`: where an indirect dispatch takes its counts from; NULL for a direct one.
static void prepare_dispatch(struct bd_gpu *gpu, const struct bd_program *program,
                             const struct bd_bindings *bindings, const struct bd_buf *counts)
{
    BD_ASSERT(program->source.compute && !gpu->in_target);
    bd_precompile_dispatch(gpu, program, bindings);
    gpu->serial++;
    bd_bind_note(gpu, bindings);
    if (counts) bd_barrier_read(gpu, &counts->access, BD_USE_COMMAND);
    bd_barrier_issue(gpu);
    bd_bind_all(gpu, bindings);
    glUseProgram(program->id);
}

void bd_gpu_dispatch(struct bd_gpu *gpu, const struct bd_program *program,
                     const struct bd_bindings *bindings, uint32_t x, uint32_t y, uint32_t z)
{
    BD_ASSERT(x <= 65535 && y <= 65535 && z <= 65535);
    if (x == 0 || y == 0 || z == 0) return;
    prepare_dispatch(gpu, program, bindings, NULL);
    glDispatchCompute(x, y, z);
    bd_gpu_check(gpu, "bd_gpu_dispatch");
}

void bd_gpu_dispatch_indirect(struct bd_gpu *gpu, const struct bd_program *program,
                              const struct bd_bindings *bindings, const struct bd_buf *counts,
                              size_t offset_bytes)
{
    const size_t counts_bytes = 3 * sizeof(uint32_t);
    BD_ASSERT(offset_bytes % 4 == 0 && counts->size_bytes >= counts_bytes &&
              offset_bytes <= counts->size_bytes - counts_bytes);
    prepare_dispatch(gpu, program, bindings, counts);
    glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, counts->id);
    glDispatchComputeIndirect((GLintptr)offset_bytes);
    bd_gpu_check(gpu, "bd_gpu_dispatch_indirect");
}
