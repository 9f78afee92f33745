#include "protocol/wire.h"

#include <stdio.h>
#include <stdlib.h>

#include "base/assert.h"
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
                               struct bd_fault *fault)
{
    struct bd_wire_alloc alloc;
    bd_wire_alloc_init(&alloc, bd_wire_budget(size));
    Bounced__Envelope *envelope = bounced__envelope__unpack(&alloc.allocator, size, bytes);
    if (!envelope)
        return bd_fault_set(fault, BD_ERR_BAD_INPUT, "header",
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
                              struct bd_fault *fault)
{
    const char *base = (const char *)message;
    const size_t count = *(const size_t *)(const void *)(base + field->quantifier_offset);
    ProtobufCMessage *const *list =
        *(ProtobufCMessage * *const *)(const void *)(base + field->offset);
    char place[PATH_BYTES];
    enum bd_err err = BD_ERR_OK;
    for (size_t i = 0; !err && i < count; i++) {
        snprintf(place, sizeof place, "%s.%s[%zu]", path, field->name, i);
        err = bd_wire_check_known(list[i], place, fault);
    }
    return err;
}

static enum bd_err check_field(const ProtobufCMessage *message,
                               const ProtobufCFieldDescriptor *field, const char *path,
                               struct bd_fault *fault)
{
    if (field->type != PROTOBUF_C_TYPE_MESSAGE) return BD_ERR_OK;
    if (field->label == PROTOBUF_C_LABEL_REPEATED) return check_list(message, field, path, fault);
    const ProtobufCMessage *inner = message_at(message, field);
    if (!inner) return BD_ERR_OK;
    char place[PATH_BYTES];
    snprintf(place, sizeof place, "%s.%s", path, field->name);
    return bd_wire_check_known(inner, place, fault);
}

enum bd_err bd_wire_check_known(const ProtobufCMessage *message, const char *path,
                                struct bd_fault *fault)
{
    if (message->n_unknown_fields > 0)
        return bd_fault_set(fault, BD_ERR_UNSUPPORTED, path,
                            "%s: this server knows no field %u of a %s", path,
                            message->unknown_fields[0].tag, message->descriptor->short_name);
    enum bd_err err = BD_ERR_OK;
    for (unsigned i = 0; !err && i < message->descriptor->n_fields; i++)
        err = check_field(message, &message->descriptor->fields[i], path, fault);
    return err;
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
