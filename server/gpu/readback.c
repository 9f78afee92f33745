// Copies from textures to the host, started and waited for apart.

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "gpu/gpu_internal.h"

struct bd_readback {
    GLuint buffer;
    GLsync fence;
    size_t size_bytes;
};

// GL counts the bytes of one copy in 31 bits; a picture of 16384 x 16384 has 4 GiB.
#define COPY_MAX_BYTES (UINT64_C(1) << 30)

static void copy_to_buffer(const struct bd_tex *tex, uint32_t layer, uint32_t first_row,
                           uint32_t height, const struct bd_readback *readback)
{
    const struct bd_format_info *info = bd_format_info(tex->desc.format);
    const size_t row_bytes = readback->size_bytes / height;
    const uint32_t rows_max = (uint32_t)(COPY_MAX_BYTES / row_bytes);
    glBindBuffer(GL_PIXEL_PACK_BUFFER, readback->buffer);
    for (uint32_t row = 0; row < height; row += rows_max) {
        uint32_t rows = height - row < rows_max ? height - row : rows_max;
        glGetTextureSubImage(tex->id, 0, 0, (GLint)(first_row + row), (GLint)layer,
                             (GLsizei)tex->desc.width_px, (GLsizei)rows, 1, info->format,
                             info->type, (GLsizei)(rows * row_bytes),
                             (void *)(uintptr_t)(row * row_bytes));
    }
    glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
}

static void destroy(struct bd_readback *readback)
{
    glDeleteSync(readback->fence);
    glDeleteBuffers(1, &readback->buffer);
    free(readback);
}

enum bd_err bd_gpu_readback_start(struct bd_gpu *gpu, const struct bd_tex *tex, uint32_t layer,
                                  struct bd_readback **out, struct bd_err_detail *detail)
{
    return bd_gpu_readback_rows_start(gpu, tex, layer, 0, tex->desc.height_px, out, detail);
}

enum bd_err bd_gpu_readback_rows_start(struct bd_gpu *gpu, const struct bd_tex *tex, uint32_t layer,
                                       uint32_t first_row, uint32_t row_count,
                                       struct bd_readback **out, struct bd_err_detail *detail)
{
    BD_ASSERT(row_count > 0 && first_row < tex->desc.height_px &&
              row_count <= tex->desc.height_px - first_row);
    *out = NULL;
    struct bd_readback *readback = calloc(1, sizeof *readback);
    BD_ASSERT(readback);
    readback->size_bytes =
        (size_t)tex->desc.width_px * row_count * bd_format_info(tex->desc.format)->texel_bytes;
    glCreateBuffers(1, &readback->buffer);
    glNamedBufferStorage(readback->buffer, (GLsizeiptr)readback->size_bytes, NULL,
                         GL_MAP_READ_BIT | GL_CLIENT_STORAGE_BIT);
    if (bd_gpu_take_error() != GL_NO_ERROR) {
        size_t size_bytes = readback->size_bytes;
        destroy(readback);
        return bd_err_set(detail, bd_gpu_why_not_made(gpu), tex->desc.name,
                          "the device has no %zu KiB to read %s back", size_bytes >> 10,
                          tex->desc.name);
    }
    gpu->serial++;
    bd_barrier_read(gpu, &tex->access, BD_USE_TEX_UPDATE);
    bd_barrier_issue(gpu);
    copy_to_buffer(tex, layer, first_row, row_count, readback);
    readback->fence = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
    glFlush(); // so that the copy is under way while the caller does something else
    bd_gpu_check(gpu, "bd_gpu_readback_start");
    *out = readback;
    return BD_ERR_OK;
}

static void wait_for(struct bd_gpu *gpu, GLsync fence)
{
    GLenum state;
    do {
        state = glClientWaitSync(fence, GL_SYNC_FLUSH_COMMANDS_BIT, 1000000000u);
        if (state == GL_TIMEOUT_EXPIRED) bd_gpu_check_reset(gpu);
    } while (state == GL_TIMEOUT_EXPIRED && gpu->status != BD_ERR_DEVICE_LOST);
}

enum bd_err bd_gpu_readback_finish(struct bd_gpu *gpu, struct bd_readback **readback, void *bytes,
                                   size_t size_bytes)
{
    BD_ASSERT_CMP(size_bytes, ==, (*readback)->size_bytes);
    wait_for(gpu, (*readback)->fence);
    bd_gpu_check_reset(gpu);
    bd_gpu_check(gpu, "bd_gpu_readback_finish");
    enum bd_err err = bd_gpu_status(gpu);
    if (!err) {
        GLuint buffer = (*readback)->buffer;
        const void *mapped =
            glMapNamedBufferRange(buffer, 0, (GLsizeiptr)size_bytes, GL_MAP_READ_BIT);
        if (mapped) memcpy(bytes, mapped, size_bytes);
        if (mapped) glUnmapNamedBuffer(buffer);
        if (!bd_gpu_check(gpu, "bd_gpu_readback_finish") || !mapped) err = bd_gpu_status(gpu);
        if (!err && !mapped) err = BD_ERR_NO_MEMORY;
    }
    destroy(*readback);
    *readback = NULL;
    return err;
}

enum bd_err bd_tex_read_rows(struct bd_gpu *gpu, const struct bd_tex *tex, uint32_t layer,
                             uint32_t first_row, uint32_t row_count, void *texels,
                             size_t size_bytes)
{
    const struct bd_format_info *info = bd_format_info(tex->desc.format);
    BD_ASSERT(first_row < tex->desc.height_px && row_count <= tex->desc.height_px - first_row);
    BD_ASSERT_CMP(size_bytes, ==, (size_t)tex->desc.width_px * row_count * info->texel_bytes);
    BD_ASSERT_CMP(size_bytes, <=, COPY_MAX_BYTES);
    gpu->serial++;
    bd_barrier_read(gpu, &tex->access, BD_USE_TEX_UPDATE);
    bd_barrier_issue(gpu);
    glGetTextureSubImage(tex->id, 0, 0, (GLint)first_row, (GLint)layer, (GLsizei)tex->desc.width_px,
                         (GLsizei)row_count, 1, info->format, info->type, (GLsizei)size_bytes,
                         texels);
    bd_gpu_check(gpu, "bd_tex_read_rows");
    return bd_gpu_status(gpu);
}
