// What strangers send to the daemon: HTTP, WebSocket and framed messages, on several connections,
// in any order, while what is under way comes back sooner, later or never.
//
// A script (script.h); what was gathered before a command that sends nothing by itself is sent
// first, as it is, to the current peer, who is connected by HTTP if he is not yet. Commands:
//   T: as the first one: tokens are asked for
//   h, f: a new connection of the current peer: HTTP, framed      1 to 4: another peer
//   s: nothing but sending      end: what is left is sent and all settles; nothing left: all breaks off
//   j, p: an envelope in JSON, in protobuf: sent as his face carries it    d: its payload
//   w: one WebSocket frame whose first byte is opcode and flags, the rest its content
//   x: the connection is reset       c: half closed
//   r: one piece of work is done     b: one comes back to the loop     g: one frame ends
//   a: all of them                   t: time passes                    q: the daemon drains

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/log.h"
#include "protocol/framing.h"
#include "protocol/json.h"
#include "protocol/wire.h"
#include "tests/fuzz/daemon.h"
#include "tests/fuzz/script.h"

#include "target.h"

#define STEPS_MAX 256

struct talk {
    uint32_t peer;
    uint8_t *payload; // of the next envelope
    size_t payload_bytes;
};

static void be_connected(const struct talk *talk)
{
    if (!daemon_is_connected(talk->peer)) daemon_connect(talk->peer, PEER_HTTP);
}

static void send_raw(const struct talk *talk, const struct script *script)
{
    if (script->size == 0) return;
    be_connected(talk);
    daemon_send(talk->peer, script->bytes, script->size);
}

// --- WebSocket --------------------------------------------------------------------------------

// Masked by zeros: content stays readable in the input.
static void send_frame(const struct talk *talk, uint8_t flags, const uint8_t *bytes, size_t size)
{
    if (size > UINT16_MAX) return;
    uint8_t *frame = calloc(1, size + 8);
    BD_ASSERT(frame);
    size_t head = 2;
    frame[0] = flags;
    if (size < 126) {
        frame[1] = (uint8_t)(0x80 | size);
    } else {
        frame[1] = 0x80 | 126;
        frame[2] = (uint8_t)(size >> 8);
        frame[3] = (uint8_t)size;
        head = 4;
    }
    memcpy(frame + head + 4, bytes, size);
    daemon_send(talk->peer, frame, head + 4 + size);
    free(frame);
}

// --- envelopes --------------------------------------------------------------------------------

// A unit is a prefix of two lengths, the header and the payload; a WebSocket message begins with
// the second length.
static void send_unit(const struct talk *talk, const uint8_t *header, size_t header_bytes)
{
    const size_t size = BD_FRAMING_PREFIX_BYTES + header_bytes + talk->payload_bytes;
    uint8_t *unit = malloc(size);
    BD_ASSERT(unit);
    bd_framing_prefix(header_bytes, talk->payload_bytes, unit);
    memcpy(unit + BD_FRAMING_PREFIX_BYTES, header, header_bytes);
    if (talk->payload_bytes)
        memcpy(unit + BD_FRAMING_PREFIX_BYTES + header_bytes, talk->payload, talk->payload_bytes);
    if (daemon_peer_kind(talk->peer) == PEER_FRAMED)
        daemon_send(talk->peer, unit, size);
    else
        send_frame(talk, 0x82, unit + 4, size - 4);
    free(unit);
}

static void send_json(const struct talk *talk, const struct script *script)
{
    ProtobufCMessage *message = NULL;
    if (bd_json_text_to_message((const char *)script->bytes, script->size,
                                &bounced__envelope__descriptor, &message, NULL))
        return;
    uint8_t *unit;
    size_t size;
    bd_envelope_encode((const Bounced__Envelope *)message, 0, &unit, &size);
    send_unit(talk, unit + BD_FRAMING_PREFIX_BYTES, size - BD_FRAMING_PREFIX_BYTES);
    free(unit);
    protobuf_c_message_free_unpacked(message, NULL);
}

static void take_payload(struct talk *talk, const struct script *script)
{
    free(talk->payload);
    talk->payload = malloc(script->size + 1);
    BD_ASSERT(talk->payload);
    memcpy(talk->payload, script->bytes, script->size);
    talk->payload_bytes = script->size;
}

static void forget_payload(struct talk *talk)
{
    free(talk->payload);
    talk->payload = NULL;
    talk->payload_bytes = 0;
}

// --- commands ---------------------------------------------------------------------------------

// True if the command took what was gathered.
static bool send_as(struct talk *talk, const struct script *script, int command)
{
    static const uint32_t pass_ms[] = {1, 20, 100, 400, 1000, 5000, 11000, 31000, 61000, 130000};
    switch (command) {
    case 'j':
    case 'p':
        be_connected(talk);
        if (command == 'j')
            send_json(talk, script);
        else
            send_unit(talk, script->bytes, script->size);
        forget_payload(talk);
        return true;
    case 'd':
        take_payload(talk, script);
        return true;
    case 'w':
        be_connected(talk);
        if (script->size > 0)
            send_frame(talk, script->bytes[0], script->bytes + 1, script->size - 1);
        return true;
    case 't':
        daemon_pass_ms(pass_ms[script_number(script, sizeof pass_ms / sizeof pass_ms[0])]);
        return true;
    default:
        return false;
    }
}

static void step(struct talk *talk, const struct script *script, int command)
{
    if (send_as(talk, script, command)) return;
    send_raw(talk, script);
    switch (command) {
    case 'h':
        daemon_connect(talk->peer, PEER_HTTP);
        break;
    case 'f':
        daemon_connect(talk->peer, PEER_FRAMED);
        break;
    case '1':
    case '2':
    case '3':
    case '4':
        talk->peer = (uint32_t)(command - '1');
        break;
    case 'x':
        daemon_reset(talk->peer);
        break;
    case 'c':
        daemon_half_close(talk->peer);
        break;
    case 'r':
        daemon_run_one();
        break;
    case 'b':
        daemon_return_one();
        break;
    case 'g':
        daemon_end_frame();
        break;
    case 0:
        if (script->size > 0) daemon_settle();
        break;
    case 'a':
        daemon_settle();
        break;
    case 'q':
        daemon_drain();
        break;
    default:
        break;
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
    struct script script;
    struct talk talk = {0};
    const bool has_tokens = size >= 2 && bytes[0] == SCRIPT_MARK && bytes[1] == 'T';
    // Refusals are logged for whoever runs the daemon; here all is refusals.
    bd_log_setup(BD_LOG_ERROR, false);
    daemon_begin(has_tokens);
    script_begin(&script, bytes, size);
    for (int i = 0, command; i < STEPS_MAX && (command = script_next(&script)) >= 0; i++)
        step(&talk, &script, command);
    script_finish(&script);
    forget_payload(&talk);
    daemon_end();
    return 0;
}
