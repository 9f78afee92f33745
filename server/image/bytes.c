#include "image/bytes.h"

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"

static enum bd_err reserve(struct bd_bytes *bytes, size_t capacity)
{
    if (capacity <= bytes->capacity_bytes) return BD_ERR_OK;
    size_t grown = bytes->capacity_bytes + bytes->capacity_bytes / 2;
    if (grown < capacity) grown = capacity;
    if (grown < 4096) grown = 4096;
    uint8_t *data = realloc(bytes->data, grown);
    if (!data) return BD_ERR_NO_MEMORY;
    bytes->data = data;
    bytes->capacity_bytes = grown;
    return BD_ERR_OK;
}

enum bd_err bd_bytes_put(struct bd_bytes *bytes, size_t offset, const void *source, size_t size)
{
    if (size > SIZE_MAX / 2 || offset > SIZE_MAX / 2) return BD_ERR_NO_MEMORY;
    enum bd_err err = reserve(bytes, offset + size);
    if (err) return err;
    if (offset > bytes->size_bytes)
        memset(bytes->data + bytes->size_bytes, 0, offset - bytes->size_bytes);
    if (size) memcpy(bytes->data + offset, source, size);
    if (offset + size > bytes->size_bytes) bytes->size_bytes = offset + size;
    return BD_ERR_OK;
}

enum bd_err bd_bytes_open_gap(struct bd_bytes *bytes, size_t offset, size_t size)
{
    BD_ASSERT_CMP(offset, <=, bytes->size_bytes);
    if (size > SIZE_MAX / 2) return BD_ERR_NO_MEMORY;
    enum bd_err err = reserve(bytes, bytes->size_bytes + size);
    if (err) return err;
    memmove(bytes->data + offset + size, bytes->data + offset, bytes->size_bytes - offset);
    bytes->size_bytes += size;
    return BD_ERR_OK;
}

void bd_bytes_finish(struct bd_bytes *bytes)
{
    free(bytes->data);
    *bytes = (struct bd_bytes){0};
}
