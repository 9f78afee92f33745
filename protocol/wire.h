// Envelopes to bytes and back, with an allocator that cannot be made to grow.
//
// protobuf-c allocates what a message says it holds: a hostile megabyte of tags can ask for a
// hundred. Each decode here has a budget; beyond it the message is refused.
//
// Thread: any.

#ifndef BD_PROTOCOL_WIRE_H
#define BD_PROTOCOL_WIRE_H

#include <stddef.h>
#include <stdint.h>

#include "base/err.h"
#include "protocol/bounced.pb-c.h"

#ifdef __cplusplus
extern "C" {
#endif

#define BD_PROTOCOL_VERSION_MIN 1
#define BD_PROTOCOL_VERSION_MAX 1

// An allocator for protobuf-c that gives out at most `left_bytes` in total. What it gives is freed
// by free(): messages may outlive it.
struct bd_wire_alloc {
    ProtobufCAllocator allocator; // allocator.allocator_data points at this struct
    size_t left_bytes;
};
void bd_wire_alloc_init(struct bd_wire_alloc *alloc, size_t budget_bytes);

// What decoding `size` bytes of header may allocate: twenty times as much covers every honest
// message (small strings, each with a pointer and an allocation of its own), plus a floor.
size_t bd_wire_budget(size_t size);

// BD_ERR_BAD_INPUT if the bytes are no Envelope or break the budget. A body that this build does
// not know (BOUNCED__ENVELOPE__BODY__NOT_SET) is no error here: it has a request id to answer to.
// Free with bd_envelope_free.
BD_MUST_CHECK
enum bd_err bd_envelope_decode(const void *bytes, size_t size, Bounced__Envelope **out,
                               struct bd_err_detail *detail);
void bd_envelope_free(Bounced__Envelope **envelope); // takes NULL

// BD_ERR_UNSUPPORTED if the message or one in it has a field that this build does not know: for
// messages that are not to be done by half. `detail` names the path behind `path`
// ("ops[0].set_light") and the field's number.
BD_MUST_CHECK
enum bd_err bd_wire_check_known(const ProtobufCMessage *message, const char *path,
                                struct bd_err_detail *detail);

// BD_ERR_BAD_INPUT if a text in the packed message holds a zero byte, which would end it, or is no
// UTF-8: nobody behind this has to ask. The bytes have been unpacked once. `detail` names the
// field; what an envelope holds is named without the body's own name ("ops[0].add_light.name").
BD_MUST_CHECK
enum bd_err bd_wire_check_text(const ProtobufCMessageDescriptor *descriptor, const void *bytes,
                               size_t size, struct bd_err_detail *detail);

// The whole unit's start: prefix and packed header, for a payload of `payload_bytes` to follow it.
// The caller frees `*out`. Aborts without memory, as nothing sensible can be said then.
void bd_envelope_encode(const Bounced__Envelope *envelope, size_t payload_bytes, uint8_t **out,
                        size_t *out_size);

#ifdef __cplusplus
}
#endif

#endif
