#include "scene/model/flat_io.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/hash.h"
#include "image/bytes.h"

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "the flat forms are little-endian");

// --- sinks ----------------------------------------------------------------------------------

bool bd_flat_to_bytes(void *user, const void *bytes, size_t size)
{
    struct bd_bytes *out = user;
    return bd_bytes_put(out, out->size_bytes, bytes, size) == BD_ERR_OK;
}

bool bd_flat_to_sha256(void *user, const void *bytes, size_t size)
{
    bd_sha256_update(user, bytes, size);
    return true;
}

// --- beginning and end ----------------------------------------------------------------------

static void clear(struct bd_flat_io *io)
{
    memset(io, 0, offsetof(struct bd_flat_io, buffer));
    io->part = "header";
}

void bd_flat_io_write_to(struct bd_flat_io *io, bd_flat_sink sink, void *user)
{
    clear(io);
    io->sink = sink;
    io->user = user;
}

void bd_flat_io_read_from(struct bd_flat_io *io, const void *bytes, size_t size)
{
    clear(io);
    io->reading = true;
    io->bytes = bytes;
    io->size = size;
}

void bd_flat_io_read_source(struct bd_flat_io *io, bd_flat_source source, void *user,
                            size_t size_max)
{
    clear(io);
    io->reading = true;
    io->source = source;
    io->source_user = user;
    io->size = size_max;
}

bool bd_flat_io_flush(struct bd_flat_io *io)
{
    if (!io->failed && io->used > 0 && !io->sink(io->user, io->buffer, io->used)) io->failed = true;
    io->used = 0;
    return !io->failed;
}

enum bd_err bd_flat_io_verdict(struct bd_flat_io *io, const char *what,
                               struct bd_err_detail *detail)
{
    if (!io->failed && !io->source && bd_flat_left(io) > 0) bd_flat_fail(io);
    if (io->no_memory)
        return bd_err_set(detail, BD_ERR_NO_MEMORY, io->part, "no memory for the %s", what);
    if (io->missing) {
        char hex[BD_SHA256_HEX];
        bd_sha256_hex(io->missing, hex);
        return bd_err_set(detail, BD_ERR_NOT_FOUND, io->part, "content sha256:%s is missing", hex);
    }
    if (io->failed)
        return bd_err_set(detail, BD_ERR_BAD_INPUT, io->part, "%s is damaged near byte %zu", what,
                          io->offset);
    return BD_ERR_OK;
}

void bd_flat_enter(struct bd_flat_io *io, const char *part)
{
    if (!io->failed) io->part = part;
}

void bd_flat_fail(struct bd_flat_io *io)
{
    io->failed = true;
}

void bd_flat_fail_memory(struct bd_flat_io *io)
{
    io->no_memory = !io->failed || io->no_memory;
    io->failed = true;
}

size_t bd_flat_left(const struct bd_flat_io *io)
{
    return io->size - io->offset;
}

static void write_bytes(struct bd_flat_io *io, const void *bytes, size_t size)
{
    if (io->used + size > sizeof io->buffer && !bd_flat_io_flush(io)) return;
    if (io->failed || size == 0) return;
    if (size > sizeof io->buffer) {
        if (!io->sink(io->user, bytes, size)) bd_flat_fail(io);
        return;
    }
    memcpy(io->buffer + io->used, bytes, size);
    io->used += size;
}

static bool take_bytes(struct bd_flat_io *io, void *bytes, size_t size)
{
    if (io->failed || bd_flat_left(io) < size) return false;
    if (io->source) return io->source(io->source_user, bytes, size);
    if (size) memcpy(bytes, io->bytes + io->offset, size);
    return true;
}

// What is not there reads as 0. Whole streams are left as they are then: nobody looks at them, and
// a length that nothing came of must cost no memory.
static void read_bytes(struct bd_flat_io *io, void *bytes, size_t size)
{
    if (take_bytes(io, bytes, size)) {
        io->offset += size;
        return;
    }
    if (size <= sizeof io->buffer) memset(bytes, 0, size);
    bd_flat_fail(io);
}

void bd_flat_bytes(struct bd_flat_io *io, void *bytes, size_t size)
{
    if (io->reading)
        read_bytes(io, bytes, size);
    else
        write_bytes(io, bytes, size);
}

void bd_flat_u32(struct bd_flat_io *io, uint32_t *value)
{
    bd_flat_bytes(io, value, sizeof *value);
}

void bd_flat_bool(struct bd_flat_io *io, bool *value)
{
    uint8_t byte = !io->reading && *value;
    bd_flat_bytes(io, &byte, 1);
    if (byte > 1) bd_flat_fail(io);
    if (io->reading) *value = byte == 1;
}

void bd_flat_enum(struct bd_flat_io *io, void *value, uint32_t count)
{
    uint32_t number;
    memcpy(&number, value, sizeof number);
    bd_flat_u32(io, &number);
    if (number >= count) {
        bd_flat_fail(io);
        number = 0;
    }
    if (io->reading) memcpy(value, &number, sizeof number);
}

void bd_flat_index(struct bd_flat_io *io, int32_t *index, uint32_t count)
{
    bd_flat_bytes(io, index, sizeof *index);
    if (*index == BD_NONE || (*index >= 0 && (uint32_t)*index < count)) return;
    bd_flat_fail(io);
    if (io->reading) *index = BD_NONE;
}

void bd_flat_f32(struct bd_flat_io *io, float *value, float least, float most)
{
    bd_flat_bytes(io, value, sizeof *value);
    if (!(*value >= least && *value <= most)) bd_flat_fail(io);
}

void bd_flat_f32s(struct bd_flat_io *io, float *values, int count, float least, float most)
{
    for (int i = 0; i < count; i++) bd_flat_f32(io, &values[i], least, most);
}

void bd_flat_text(struct bd_flat_io *io, char *text, size_t size)
{
    bd_flat_bytes(io, text, size);
    if (io->reading) text[size - 1] = 0;
}

void bd_flat_magic(struct bd_flat_io *io, const char magic[8])
{
    char head[8];
    memcpy(head, magic, sizeof head);
    bd_flat_bytes(io, head, sizeof head);
    if (memcmp(head, magic, sizeof head) != 0) bd_flat_fail(io);
}

static void *allocate(struct bd_flat_io *io, size_t bytes)
{
    void *memory = malloc(bytes ? bytes : 1);
    if (!memory) bd_flat_fail_memory(io);
    return memory;
}

// A vertex further out than the square root of FLT_MAX has no squared distance.
static const float component_max = 1e18f;

void bd_flat_stream(struct bd_flat_io *io, float **stream, uint32_t vertex_count, uint32_t width,
                    bool required)
{
    size_t count = (size_t)vertex_count * width;
    bool present = *stream != NULL;
    bd_flat_bool(io, &present);
    if (required && !present) bd_flat_fail(io);
    if (io->failed || !present) return;
    if (!io->reading) {
        write_bytes(io, *stream, count * sizeof **stream);
        return;
    }
    if (bd_flat_left(io) / sizeof **stream < count) {
        bd_flat_fail(io);
        return;
    }
    *stream = allocate(io, count * sizeof **stream);
    if (!*stream) return;
    read_bytes(io, *stream, count * sizeof **stream);
    for (size_t i = 0; !io->failed && i < count; i++)
        if (!(fabsf((*stream)[i]) <= component_max)) bd_flat_fail(io);
}

// Of what comes from a source, a count alone buys little memory.
#define ROOM_AT_FIRST 1024u

static size_t first_room(const struct bd_flat_io *io, uint32_t count)
{
    if (count == 0) return 1;
    return io->source && count > ROOM_AT_FIRST ? ROOM_AT_FIRST : count;
}

bool bd_flat_items(struct bd_flat_io *io, const char *part, uint32_t *count, void **items,
                   size_t item_bytes, size_t flat_bytes_min)
{
    bd_flat_enter(io, part);
    bd_flat_u32(io, count);
    if (!io->reading) return !io->failed;
    if (io->failed || *count > INT32_MAX || *count > bd_flat_left(io) / flat_bytes_min) {
        *count = 0;
        bd_flat_fail(io);
        return false;
    }
    *items = calloc(first_room(io, *count), item_bytes);
    if (*items) return true;
    *count = 0;
    bd_flat_fail_memory(io);
    return false;
}

bool bd_flat_room(struct bd_flat_io *io, void **items, size_t item_bytes, uint32_t index,
                  uint32_t count)
{
    // Room doubles where it is used up: at the powers of two.
    if (!io->reading || !io->source || index < ROOM_AT_FIRST || (index & (index - 1)) != 0)
        return true;
    const uint32_t more = count - index < index ? count - index : index;
    char *grown = realloc(*items, ((size_t)index + more) * item_bytes);
    if (!grown) {
        bd_flat_fail_memory(io);
        return false;
    }
    memset(grown + index * item_bytes, 0, more * item_bytes);
    *items = grown;
    return true;
}
