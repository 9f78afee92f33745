// Buffers on the device.

#include <inttypes.h>
#include <stdlib.h>

#include "base/assert.h"
#include "gpu/gpu_internal.h"

// Buffers are whole vec4s, so that a BD_ARRAY over one has no half element at its end. Mesa's
// software devices generate a program's code anew, to the same instructions, for an array whose
// bytes are a power of two, or have zeroes in bits 8 to 15: none has.
static size_t padded_bytes(const struct bd_gpu *gpu, size_t size_bytes)
{
    size_t padded = (size_bytes + 15) & ~(size_t)15;
    if (!gpu->arrays_are_textures) return padded;
    if ((padded >> 8 & 0xff) == 0) padded += 256;
    return padded & (padded - 1) ? padded : padded + 16;
}

enum content { CONTENT_UNSET, CONTENT_ZERO, CONTENT_GIVEN };

static void set_content(struct bd_buf *buf, size_t padded, enum content content,
                        const void *initial)
{
    if (content == CONTENT_ZERO || (content == CONTENT_GIVEN && padded != buf->size_bytes))
        glClearNamedBufferData(buf->id, GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, NULL);
    if (content == CONTENT_GIVEN)
        glNamedBufferSubData(buf->id, 0, (GLsizeiptr)buf->size_bytes, initial);
}

#define HOST_ACCESS                                                                                \
    (GL_MAP_READ_BIT | GL_MAP_WRITE_BIT | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT)

static bool make_buffer(struct bd_gpu *gpu, struct bd_buf *buf, size_t padded, enum content content,
                        const void *initial)
{
    const bool is_host_memory = gpu->caps.software;
    glCreateBuffers(1, &buf->id);
    glNamedBufferStorage(buf->id, (GLsizeiptr)padded, NULL,
                         GL_DYNAMIC_STORAGE_BIT | (is_host_memory ? HOST_ACCESS : 0));
    if (bd_gpu_take_error() == GL_NO_ERROR) {
        set_content(buf, padded, content, initial);
        if (is_host_memory)
            buf->bytes = glMapNamedBufferRange(buf->id, 0, (GLsizeiptr)padded, HOST_ACCESS);
        if (gpu->arrays_are_textures) {
            glCreateTextures(GL_TEXTURE_BUFFER, 1, &buf->texel_view);
            glTextureBuffer(buf->texel_view, GL_RGBA32F, buf->id);
        }
        if (bd_gpu_take_error() == GL_NO_ERROR) return true;
    }
    glDeleteTextures(1, &buf->texel_view);
    glDeleteBuffers(1, &buf->id);
    return false;
}

static enum bd_err create(struct bd_gpu *gpu, const char *name, size_t size_bytes,
                          enum content content, const void *initial, struct bd_buf **out,
                          struct bd_err_detail *detail)
{
    BD_ASSERT_CMP(size_bytes, >, 0);
    *out = NULL;
    size_t padded = padded_bytes(gpu, size_bytes);
    enum bd_err err = bd_gpu_reserve(gpu, name, padded, detail);
    if (err) return err;
    struct bd_buf *buf = calloc(1, sizeof *buf);
    if (buf) *buf = (struct bd_buf){.name = name, .size_bytes = size_bytes};
    if (!buf || !make_buffer(gpu, buf, padded, content, initial)) {
        free(buf);
        bd_gpu_release(gpu, padded);
        return bd_err_set(detail, bd_gpu_why_not_made(gpu), name,
                          "the device has no %zu KiB for buffer %s", padded >> 10, name);
    }
    glObjectLabel(GL_BUFFER, buf->id, -1, name);
    *out = buf;
    return BD_ERR_OK;
}

enum bd_err bd_buf_create(struct bd_gpu *gpu, const char *name, size_t size_bytes,
                          const void *initial, struct bd_buf **out, struct bd_err_detail *detail)
{
    return create(gpu, name, size_bytes, initial ? CONTENT_GIVEN : CONTENT_ZERO, initial, out,
                  detail);
}

enum bd_err bd_buf_create_unset(struct bd_gpu *gpu, const char *name, size_t size_bytes,
                                struct bd_buf **out, struct bd_err_detail *detail)
{
    return create(gpu, name, size_bytes, CONTENT_UNSET, NULL, out, detail);
}

void bd_buf_destroy(struct bd_gpu *gpu, struct bd_buf **buf)
{
    if (!*buf) return;
    glDeleteTextures(1, &(*buf)->texel_view);
    glDeleteBuffers(1, &(*buf)->id);
    bd_gpu_release(gpu, padded_bytes(gpu, (*buf)->size_bytes));
    free(*buf);
    *buf = NULL;
}

size_t bd_buf_size_bytes(const struct bd_buf *buf)
{
    return buf->size_bytes;
}

void bd_buf_upload(struct bd_gpu *gpu, struct bd_buf *buf, size_t offset, const void *bytes,
                   size_t size_bytes)
{
    BD_ASSERT(offset <= buf->size_bytes && size_bytes <= buf->size_bytes - offset);
    gpu->serial++;
    bd_barrier_write(gpu, &buf->access, BD_USE_BUF_UPDATE);
    bd_barrier_issue(gpu);
    glNamedBufferSubData(buf->id, (GLintptr)offset, (GLsizeiptr)size_bytes, bytes);
    bd_gpu_check(gpu, "bd_buf_upload");
}

void bd_buf_clear(struct bd_gpu *gpu, struct bd_buf *buf)
{
    gpu->serial++;
    bd_barrier_write(gpu, &buf->access, BD_USE_BUF_UPDATE);
    bd_barrier_issue(gpu);
    glClearNamedBufferData(buf->id, GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, NULL);
    bd_gpu_check(gpu, "bd_buf_clear");
}

enum bd_err bd_buf_read(struct bd_gpu *gpu, const struct bd_buf *buf, size_t offset, void *bytes,
                        size_t size_bytes)
{
    BD_ASSERT(offset <= buf->size_bytes && size_bytes <= buf->size_bytes - offset);
    gpu->serial++;
    bd_barrier_read(gpu, &buf->access, BD_USE_BUF_UPDATE);
    bd_barrier_issue(gpu);
    glGetNamedBufferSubData(buf->id, (GLintptr)offset, (GLsizeiptr)size_bytes, bytes);
    bd_gpu_check(gpu, "bd_buf_read");
    return bd_gpu_status(gpu);
}

enum bd_err bd_buf_borrow(struct bd_gpu *gpu, struct bd_buf *buf, enum bd_borrow how, void **bytes,
                          struct bd_err_detail *detail)
{
    if (buf->bytes) {
        glMemoryBarrier(GL_CLIENT_MAPPED_BUFFER_BARRIER_BIT);
        glFinish();
        *bytes = buf->bytes;
        return bd_gpu_status(gpu);
    }
    *bytes = malloc(buf->size_bytes);
    if (!*bytes)
        return bd_err_set(detail, BD_ERR_NO_MEMORY, buf->name,
                          "no memory for a copy of %zu KiB of buffer %s", buf->size_bytes >> 10,
                          buf->name);
    return how == BD_BORROW_TO_READ ? bd_buf_read(gpu, buf, 0, *bytes, buf->size_bytes) : BD_ERR_OK;
}

void bd_buf_return(struct bd_gpu *gpu, struct bd_buf *buf, enum bd_borrow how, void **bytes)
{
    if (*bytes && *bytes != buf->bytes) {
        if (how == BD_BORROW_TO_WRITE) bd_buf_upload(gpu, buf, 0, *bytes, buf->size_bytes);
        free(*bytes);
    }
    *bytes = NULL;
}
