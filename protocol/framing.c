#include "protocol/framing.h"

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"

#define FIRST_CAPACITY_BYTES 4096

static uint32_t read_u32(const uint8_t *bytes)
{
    return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 |
           (uint32_t)bytes[3] << 24;
}

static void write_u32(uint8_t *bytes, uint32_t value)
{
    for (int i = 0; i < 4; i++) bytes[i] = (uint8_t)(value >> (8 * i));
}

void bd_message_finish(struct bd_message *message)
{
    free(message->buffer);
    *message = (struct bd_message){0};
}

void bd_decoder_init(struct bd_decoder *decoder, uint64_t message_bytes_max,
                     uint64_t header_bytes_max)
{
    *decoder = (struct bd_decoder){.message_bytes_max = message_bytes_max,
                                   .header_bytes_max = header_bytes_max};
}

void bd_decoder_finish(struct bd_decoder *decoder)
{
    free(decoder->buffer);
    *decoder = (struct bd_decoder){0};
}

void bd_decoder_bound(struct bd_decoder *decoder, uint64_t bytes_max, const char *name)
{
    decoder->bound_bytes = bytes_max;
    decoder->bound_name = name;
}

static enum bd_err check_total(const struct bd_decoder *decoder, struct bd_err_detail *detail)
{
    uint32_t total = read_u32(decoder->prefix);
    if (decoder->bound_bytes > 0 && total > decoder->bound_bytes)
        return bd_err_set(detail, BD_ERR_LIMIT, decoder->bound_name,
                          "a message of %u bytes is above the limit %s of %llu", total,
                          decoder->bound_name, (unsigned long long)decoder->bound_bytes);
    if (total > decoder->message_bytes_max)
        return bd_err_set(detail, BD_ERR_LIMIT, "message_bytes",
                          "a message of %u bytes is above the limit message_bytes of %llu", total,
                          (unsigned long long)decoder->message_bytes_max);
    if (total < 4)
        return bd_err_set(detail, BD_ERR_BAD_INPUT, "total",
                          "a message of %u bytes has no room for its header's length", total);
    return BD_ERR_OK;
}

static enum bd_err check_header_len(const struct bd_decoder *decoder, struct bd_err_detail *detail)
{
    uint32_t total = read_u32(decoder->prefix);
    uint32_t header_bytes = read_u32(decoder->prefix + 4);
    if (header_bytes > total - 4)
        return bd_err_set(detail, BD_ERR_BAD_INPUT, "header_len",
                          "a header of %u bytes is longer than its message of %u", header_bytes,
                          total);
    if (header_bytes > decoder->header_bytes_max)
        return bd_err_set(detail, BD_ERR_LIMIT, "header_bytes",
                          "a header of %u bytes is above the limit header_bytes of %llu",
                          header_bytes, (unsigned long long)decoder->header_bytes_max);
    return BD_ERR_OK;
}

// Each length is checked the moment it is whole, so that a peer which sends a bad one and then
// waits for an answer gets it.
static enum bd_err feed_prefix(struct bd_decoder *decoder, const uint8_t *bytes, size_t size,
                               size_t *taken, struct bd_err_detail *detail)
{
    while (*taken < size && decoder->prefix_used < BD_FRAMING_PREFIX_BYTES) {
        decoder->prefix[decoder->prefix_used++] = bytes[(*taken)++];
        enum bd_err err = BD_ERR_OK;
        if (decoder->prefix_used == 4) err = check_total(decoder, detail);
        if (decoder->prefix_used == 8) err = check_header_len(decoder, detail);
        if (err) return err;
    }
    if (decoder->prefix_used == BD_FRAMING_PREFIX_BYTES) {
        decoder->wanted = read_u32(decoder->prefix) - 4;
        decoder->header_bytes = read_u32(decoder->prefix + 4);
    }
    return BD_ERR_OK;
}

static enum bd_err make_room(struct bd_decoder *decoder, size_t needed,
                             struct bd_err_detail *detail)
{
    if (needed <= decoder->capacity) return BD_ERR_OK;
    size_t capacity = decoder->capacity ? decoder->capacity * 2 : FIRST_CAPACITY_BYTES;
    if (capacity < needed) capacity = needed;
    if (capacity > decoder->wanted) capacity = decoder->wanted;
    uint8_t *buffer = realloc(decoder->buffer, capacity);
    if (!buffer)
        return bd_err_set(detail, BD_ERR_NO_MEMORY, "", "no memory for a message of %zu bytes",
                          decoder->wanted);
    decoder->buffer = buffer;
    decoder->capacity = capacity;
    return BD_ERR_OK;
}

enum bd_err bd_decoder_feed(struct bd_decoder *decoder, const void *bytes, size_t size,
                            size_t *taken, struct bd_err_detail *detail)
{
    *taken = 0;
    if (decoder->complete) return BD_ERR_OK;
    enum bd_err err = feed_prefix(decoder, bytes, size, taken, detail);
    if (err || decoder->prefix_used < BD_FRAMING_PREFIX_BYTES) return err;

    size_t piece = size - *taken;
    if (piece > decoder->wanted - decoder->used) piece = decoder->wanted - decoder->used;
    if (piece > 0) {
        err = make_room(decoder, decoder->used + piece, detail);
        if (err) return err;
        memcpy(decoder->buffer + decoder->used, (const uint8_t *)bytes + *taken, piece);
    }
    decoder->used += piece;
    *taken += piece;
    decoder->complete = decoder->used == decoder->wanted;
    return BD_ERR_OK;
}

bool bd_decoder_take(struct bd_decoder *decoder, struct bd_message *out)
{
    if (!decoder->complete) return false;
    // An empty part is an empty string, not NULL: parsers of it need no special case.
    static const uint8_t nothing[1];
    const uint8_t *start = decoder->buffer ? decoder->buffer : nothing;
    *out = (struct bd_message){.buffer = decoder->buffer,
                               .header = start,
                               .header_bytes = decoder->header_bytes,
                               .payload = start + decoder->header_bytes,
                               .payload_bytes = decoder->wanted - decoder->header_bytes};
    *decoder = (struct bd_decoder){.message_bytes_max = decoder->message_bytes_max,
                                   .header_bytes_max = decoder->header_bytes_max,
                                   .bound_bytes = decoder->bound_bytes,
                                   .bound_name = decoder->bound_name};
    return true;
}

bool bd_decoder_is_empty(const struct bd_decoder *decoder)
{
    return decoder->prefix_used == 0;
}

void bd_framing_prefix(size_t header_bytes, size_t payload_bytes,
                       uint8_t out[BD_FRAMING_PREFIX_BYTES])
{
    BD_ASSERT(header_bytes <= UINT32_MAX - 4 && payload_bytes <= UINT32_MAX - 4 - header_bytes);
    write_u32(out, (uint32_t)(4 + header_bytes + payload_bytes));
    write_u32(out + 4, (uint32_t)header_bytes);
}
