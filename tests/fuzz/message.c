// Framed messages as they come from a socket: in pieces of any size, any bytes.
//
// The first byte says how the rest is cut. What decodes is packed and decoded again: the same.

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "protocol/framing.h"
#include "protocol/wire.h"

#include "target.h"

#define MESSAGE_BYTES_MAX 65536
#define HEADER_BYTES_MAX  4096

static void check_round_trip(const Bounced__Envelope *envelope)
{
    uint8_t *unit;
    size_t unit_bytes;
    bd_envelope_encode(envelope, 0, &unit, &unit_bytes);
    Bounced__Envelope *again = NULL;
    enum bd_err err = bd_envelope_decode(unit + BD_FRAMING_PREFIX_BYTES,
                                         unit_bytes - BD_FRAMING_PREFIX_BYTES, &again, NULL);
    // Packed anew it can be shorter, and its budget with it; nothing else may fail.
    if (!err) BD_ASSERT_CMP(again->body_case, ==, envelope->body_case);
    bd_envelope_free(&again);
    free(unit);
}

static void take_message(struct bd_decoder *decoder)
{
    struct bd_message message;
    if (!bd_decoder_take(decoder, &message)) return;
    BD_ASSERT_CMP(message.header_bytes, <=, HEADER_BYTES_MAX);
    BD_ASSERT_CMP(message.header_bytes + message.payload_bytes, <=, MESSAGE_BYTES_MAX);
    Bounced__Envelope *envelope = NULL;
    if (!bd_envelope_decode(message.header, message.header_bytes, &envelope, NULL))
        check_round_trip(envelope);
    bd_envelope_free(&envelope);
    bd_message_finish(&message);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
    if (size == 0) return 0;
    const size_t piece = bytes[0] ? bytes[0] : size;
    struct bd_decoder decoder;
    bd_decoder_init(&decoder, MESSAGE_BYTES_MAX, HEADER_BYTES_MAX);
    enum bd_err err = BD_ERR_OK;
    for (size_t at = 1; !err && at < size;) {
        size_t taken, offered = piece < size - at ? piece : size - at;
        err = bd_decoder_feed(&decoder, bytes + at, offered, &taken, NULL);
        if (err) break;
        BD_ASSERT_CMP(taken, <=, offered);
        at += taken;
        take_message(&decoder);
    }
    bd_decoder_finish(&decoder);
    return 0;
}
