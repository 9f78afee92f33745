#include "protocol/wire.h"

#include <stdio.h>
#include <stdlib.h>

#include "base/assert.h"
#include "base/text.h"
#include "protocol/framing.h"

#define PATH_BYTES 128 // what is longer is cut

static void *capped_alloc(void *data, size_t size)
{
    struct bd_wire_alloc *alloc = data;
    if (size > alloc->left_bytes) return NULL;
    alloc->left_bytes -= size;
    return malloc(size);
}

static void capped_free(void *data, void *bytes)
{
    (void)data;
    free(bytes);
}

void bd_wire_alloc_init(struct bd_wire_alloc *alloc, size_t budget_bytes)
{
    *alloc = (struct bd_wire_alloc){
        .allocator = {.alloc = capped_alloc, .free = capped_free, .allocator_data = alloc},
        .left_bytes = budget_bytes};
}

size_t bd_wire_budget(size_t size)
{
    return 4096 + 20 * size;
}

enum bd_err bd_envelope_decode(const void *bytes, size_t size, Bounced__Envelope **out,
                               struct bd_err_detail *detail)
{
    struct bd_wire_alloc alloc;
    bd_wire_alloc_init(&alloc, bd_wire_budget(size));
    Bounced__Envelope *envelope = bounced__envelope__unpack(&alloc.allocator, size, bytes);
    if (!envelope)
        return bd_err_set(detail, BD_ERR_BAD_INPUT, "header",
                          "the header of %zu bytes is no message of this protocol", size);
    *out = envelope;
    return BD_ERR_OK;
}

void bd_envelope_free(Bounced__Envelope **envelope)
{
    if (!*envelope) return;
    struct bd_wire_alloc alloc;
    bd_wire_alloc_init(&alloc, 0);
    bounced__envelope__free_unpacked(*envelope, &alloc.allocator);
    *envelope = NULL;
}

// --- what is not known ----------------------------------------------------------------------

// The message of a field that is none of the oneof's others; NULL if it is not set.
static const ProtobufCMessage *message_at(const ProtobufCMessage *message,
                                          const ProtobufCFieldDescriptor *field)
{
    const char *base = (const char *)message;
    if ((field->flags & PROTOBUF_C_FIELD_FLAG_ONEOF) &&
        *(const uint32_t *)(const void *)(base + field->quantifier_offset) != field->id)
        return NULL;
    return *(ProtobufCMessage *const *)(const void *)(base + field->offset);
}

static enum bd_err check_list(const ProtobufCMessage *message,
                              const ProtobufCFieldDescriptor *field, const char *path,
                              struct bd_err_detail *detail)
{
    const char *base = (const char *)message;
    const size_t count = *(const size_t *)(const void *)(base + field->quantifier_offset);
    ProtobufCMessage *const *list =
        *(ProtobufCMessage * *const *)(const void *)(base + field->offset);
    char place[PATH_BYTES];
    enum bd_err err = BD_ERR_OK;
    for (size_t i = 0; !err && i < count; i++) {
        snprintf(place, sizeof place, "%s.%s[%zu]", path, field->name, i);
        err = bd_wire_check_known(list[i], place, detail);
    }
    return err;
}

static enum bd_err check_field(const ProtobufCMessage *message,
                               const ProtobufCFieldDescriptor *field, const char *path,
                               struct bd_err_detail *detail)
{
    if (field->type != PROTOBUF_C_TYPE_MESSAGE) return BD_ERR_OK;
    if (field->label == PROTOBUF_C_LABEL_REPEATED) return check_list(message, field, path, detail);
    const ProtobufCMessage *inner = message_at(message, field);
    if (!inner) return BD_ERR_OK;
    char place[PATH_BYTES];
    snprintf(place, sizeof place, "%s.%s", path, field->name);
    return bd_wire_check_known(inner, place, detail);
}

enum bd_err bd_wire_check_known(const ProtobufCMessage *message, const char *path,
                                struct bd_err_detail *detail)
{
    if (message->n_unknown_fields > 0)
        return bd_err_set(detail, BD_ERR_UNSUPPORTED, path,
                          "%s: this server knows no field %u of a %s", path,
                          message->unknown_fields[0].tag, message->descriptor->short_name);
    enum bd_err err = BD_ERR_OK;
    for (unsigned i = 0; !err && i < message->descriptor->n_fields; i++)
        err = check_field(message, &message->descriptor->fields[i], path, detail);
    return err;
}

// --- texts ----------------------------------------------------------------------------------

#define FIELDS_MAX 64 // of one message

// What is left of packed bytes. Sticky: behind the first thing that is none of protobuf's, nothing
// is left.
struct packed {
    const uint8_t *at, *end;
};

static uint64_t take_varint(struct packed *in)
{
    uint64_t value = 0;
    for (int shift = 0; shift < 64 && in->at < in->end; shift += 7) {
        const uint8_t byte = *in->at++;
        value |= (uint64_t)(byte & 0x7f) << shift;
        if (!(byte & 0x80)) return value;
    }
    in->at = in->end;
    return 0;
}

// The value behind a tag; of a length-delimited one what it holds.
static struct packed take_value(struct packed *in, unsigned wire_type)
{
    uint64_t size = 0;
    if (wire_type == PROTOBUF_C_WIRE_TYPE_VARINT) take_varint(in);
    if (wire_type == PROTOBUF_C_WIRE_TYPE_64BIT) size = 8;
    if (wire_type == PROTOBUF_C_WIRE_TYPE_32BIT) size = 4;
    if (wire_type == PROTOBUF_C_WIRE_TYPE_LENGTH_PREFIXED) size = take_varint(in);
    if (size > (size_t)(in->end - in->at)) size = (size_t)(in->end - in->at);
    const struct packed value = {in->at, in->at + size};
    in->at = value.end;
    return value;
}

static enum bd_err check_one_text(struct packed text, const char *path,
                                  struct bd_err_detail *detail)
{
    const size_t size = (size_t)(text.end - text.at), bad = bd_text_bad_at(text.at, size);
    if (bad == size) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_BAD_INPUT, path, "%s: %s", path,
                      text.at[bad] ? "is no UTF-8" : "holds a zero byte");
}

static enum bd_err check_texts(const ProtobufCMessageDescriptor *descriptor, struct packed in,
                               const char *path, struct bd_err_detail *detail);

// The body of an envelope is the request itself: what it holds is named alone.
static enum bd_err check_value(const ProtobufCFieldDescriptor *field, bool is_body,
                               struct packed value, uint32_t number, const char *path,
                               struct bd_err_detail *detail)
{
    char place[PATH_BYTES];
    const bool is_list = field->label == PROTOBUF_C_LABEL_REPEATED;
    const int used =
        snprintf(place, sizeof place, "%s%s%s", path, path[0] ? "." : "", field->name);
    if (is_list && used >= 0 && (size_t)used < sizeof place)
        snprintf(place + used, sizeof place - (size_t)used, "[%u]", number);
    if (field->type == PROTOBUF_C_TYPE_STRING) return check_one_text(value, place, detail);
    return check_texts(field->descriptor, value, is_body ? "" : place, detail);
}

static enum bd_err check_texts(const ProtobufCMessageDescriptor *descriptor, struct packed in,
                               const char *path, struct bd_err_detail *detail)
{
    uint32_t seen[FIELDS_MAX] = {0};
    enum bd_err err = BD_ERR_OK;
    BD_ASSERT_CMP(descriptor->n_fields, <=, FIELDS_MAX);
    while (!err && in.at < in.end) {
        const uint64_t tag = take_varint(&in);
        const struct packed value = take_value(&in, tag & 7);
        const ProtobufCFieldDescriptor *field =
            protobuf_c_message_descriptor_get_field(descriptor, (unsigned)(tag >> 3));
        if (!field || (tag & 7) != PROTOBUF_C_WIRE_TYPE_LENGTH_PREFIXED) continue;
        if (field->type == PROTOBUF_C_TYPE_STRING || field->type == PROTOBUF_C_TYPE_MESSAGE)
            err = check_value(field, descriptor == &bounced__envelope__descriptor, value,
                              seen[field - descriptor->fields]++, path, detail);
    }
    return err;
}

enum bd_err bd_wire_check_text(const ProtobufCMessageDescriptor *descriptor, const void *bytes,
                               size_t size, struct bd_err_detail *detail)
{
    const struct packed in = {bytes, (const uint8_t *)bytes + size};
    return check_texts(descriptor, in, "", detail);
}

void bd_envelope_encode(const Bounced__Envelope *envelope, size_t payload_bytes, uint8_t **out,
                        size_t *out_size)
{
    size_t header_bytes = bounced__envelope__get_packed_size(envelope);
    uint8_t *bytes = malloc(BD_FRAMING_PREFIX_BYTES + header_bytes);
    BD_ASSERT(bytes);
    bd_framing_prefix(header_bytes, payload_bytes, bytes);
    bounced__envelope__pack(envelope, bytes + BD_FRAMING_PREFIX_BYTES);
    *out = bytes;
    *out_size = BD_FRAMING_PREFIX_BYTES + header_bytes;
}
