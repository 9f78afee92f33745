// The unit of the framed transports: `u32 total | u32 header_len | header | payload`, little-endian.
//
// `total` counts what follows it: 4 + header_len + payload. The header is one protobuf Envelope
// (protocol/wire.h), which this file knows nothing about. A WebSocket message is the same without
// `total`.
//
// The decoder takes bytes as they come. It checks both lengths as soon as they are there and
// before it allocates anything, and its buffer grows with what has arrived, never with what was
// promised. After an error the stream has no meaning any more: close it.
//
// Thread: any, one at a time for each object.

#ifndef BD_PROTOCOL_FRAMING_H
#define BD_PROTOCOL_FRAMING_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/err.h"

#ifdef __cplusplus
extern "C" {
#endif

#define BD_FRAMING_PREFIX_BYTES 8

// A whole message. One allocation, owned by who holds the struct; both parts lie in it.
struct bd_message {
    uint8_t *buffer;
    const uint8_t *header;
    size_t header_bytes;
    const uint8_t *payload;
    size_t payload_bytes;
};

// Frees and zeroes; takes an empty one.
void bd_message_finish(struct bd_message *message);

struct bd_decoder {
    uint64_t message_bytes_max; // header, payload and header_len together
    uint64_t header_bytes_max;
    uint64_t bound_bytes; // stricter than message_bytes_max, and told as `bound_name`; 0 = none
    const char *bound_name;
    uint8_t prefix[BD_FRAMING_PREFIX_BYTES];
    size_t prefix_used;
    uint8_t *buffer; // header and payload
    size_t used, capacity, wanted, header_bytes;
    bool complete;
};

void bd_decoder_init(struct bd_decoder *decoder, uint64_t message_bytes_max,
                     uint64_t header_bytes_max);
void bd_decoder_finish(struct bd_decoder *decoder);

// Messages from the next one on are no longer than `bytes_max`, a limit of this name (static).
// 0: than message_bytes_max again.
void bd_decoder_bound(struct bd_decoder *decoder, uint64_t bytes_max, const char *name);

// Takes bytes up to the end of one message and says how many it took. All of them, unless a
// message became complete: take it, then feed the rest. BD_ERR_LIMIT for a length that is too
// large, BD_ERR_BAD_INPUT for a header that is longer than its message, BD_ERR_NO_MEMORY.
BD_MUST_CHECK
enum bd_err bd_decoder_feed(struct bd_decoder *decoder, const void *bytes, size_t size,
                            size_t *taken, struct bd_err_detail *detail);

// Moves the complete message to `out`; false, and nothing moved, if there is none yet.
bool bd_decoder_take(struct bd_decoder *decoder, struct bd_message *out);

// True between messages: a stream that ends here was not cut short.
bool bd_decoder_is_empty(const struct bd_decoder *decoder);

// Writes the two lengths. The sum must fit: BD_ASSERTed, since what we send is ours.
void bd_framing_prefix(size_t header_bytes, size_t payload_bytes,
                       uint8_t out[BD_FRAMING_PREFIX_BYTES]);

#ifdef __cplusplus
}
#endif

#endif
