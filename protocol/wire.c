#include "protocol/wire.h"

#include <stdlib.h>

#include "base/assert.h"
#include "protocol/framing.h"

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
