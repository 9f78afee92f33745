// Envelopes: golden bytes that old clients rely on, truncation, hostile headers, the budget.

#include "protocol/wire.h"

#include <stdlib.h>
#include <string.h>

#include "protocol/framing.h"

#include "cmocka_all.h"

// render{scene: "ab", frame: {size: [512, 300], seed: 7, encoding: "png"}} with request id 5.
static const uint8_t golden[] = {
    0x1c, 0,    0,    0,    0x18, 0,    0, 0, // total 28, header 24
    0x08, 0x05,                               // request_id = 5
    0x8a, 0x01, 0x13,                         // render, 19 bytes
    0x0a, 0x02, 'a',  'b',                    // scene
    0x2a, 0x0d,                               // frame, 13 bytes
    0x1a, 0x04, 0x80, 0x04, 0xac, 0x02,       // size, packed
    0x38, 0x07,                               // seed
    0x52, 0x03, 'p',  'n',  'g',              // encoding
};
#define GOLDEN_BYTES (sizeof golden)

static void render_has_golden_bytes(void **state)
{
    (void)state;
    uint32_t size[2] = {512, 300};
    char scene[] = "ab", encoding[] = "png";
    Bounced__FrameRequest frame = BOUNCED__FRAME_REQUEST__INIT;
    frame.n_size = 2;
    frame.size = size;
    frame.has_seed = 1;
    frame.seed = 7;
    frame.encoding = encoding;
    Bounced__Render render = BOUNCED__RENDER__INIT;
    render.scene = scene;
    render.frame = &frame;
    Bounced__Envelope envelope = BOUNCED__ENVELOPE__INIT;
    envelope.has_request_id = 1;
    envelope.request_id = 5;
    envelope.body_case = BOUNCED__ENVELOPE__BODY_RENDER;
    envelope.render = &render;
    uint8_t *bytes;
    size_t bytes_size;
    bd_envelope_encode(&envelope, 0, &bytes, &bytes_size);
    assert_int_equal(bytes_size, GOLDEN_BYTES);
    assert_memory_equal(bytes, golden, GOLDEN_BYTES);
    free(bytes);
}

static void golden_bytes_are_read(void **state)
{
    (void)state;
    Bounced__Envelope *envelope;
    assert_int_equal(bd_envelope_decode(golden + 8, GOLDEN_BYTES - 8, &envelope, NULL), BD_ERR_OK);
    assert_int_equal(envelope->request_id, 5);
    assert_int_equal(envelope->body_case, BOUNCED__ENVELOPE__BODY_RENDER);
    assert_string_equal(envelope->render->scene, "ab");
    assert_int_equal(envelope->render->frame->size[1], 300);
    assert_false(envelope->render->frame->has_aa);
    bd_envelope_free(&envelope);
    assert_null(envelope);
}

// Most cuts are no Envelope; a cut between fields is a shorter one. None may crash or leak.
static void truncation_at_every_byte_is_survived(void **state)
{
    (void)state;
    int refused = 0;
    for (size_t size = 0; size < GOLDEN_BYTES - 8; size++) {
        Bounced__Envelope *envelope = NULL;
        if (bd_envelope_decode(golden + 8, size, &envelope, NULL)) refused++;
        bd_envelope_free(&envelope);
    }
    assert_int_equal(refused, GOLDEN_BYTES - 8 - 2); // all but the empty one and the bare id
}

static void unknown_body_keeps_its_request_id(void **state)
{
    (void)state;
    static const uint8_t newer[] = {0x08, 0x09, 0xa2, 0x1f, 0x01, 'x'}; // field 500
    Bounced__Envelope *envelope;
    assert_int_equal(bd_envelope_decode(newer, sizeof newer, &envelope, NULL), BD_ERR_OK);
    assert_int_equal(envelope->request_id, 9);
    assert_int_equal(envelope->body_case, BOUNCED__ENVELOPE__BODY__NOT_SET);
    bd_envelope_free(&envelope);
}

// A table of empty entries is two bytes an entry on the wire and an allocation each in memory.
static void hostile_header_breaks_the_budget(void **state)
{
    (void)state;
    enum { COUNT = 200000 };
    uint8_t *bytes = malloc(16 + 2 * COUNT);
    uint32_t inner = 2 * COUNT;
    size_t used = 0;
    bytes[used++] = 0x8a; // render
    bytes[used++] = 0x01;
    for (; inner >= 0x80; inner >>= 7) bytes[used++] = (uint8_t)(inner | 0x80);
    bytes[used++] = (uint8_t)inner;
    for (int i = 0; i < COUNT; i++) {
        bytes[used++] = 0x1a; // files
        bytes[used++] = 0x00;
    }
    Bounced__Envelope *envelope = NULL;
    assert_int_equal(bd_envelope_decode(bytes, used, &envelope, NULL), BD_ERR_BAD_INPUT);
    assert_null(envelope);
    free(bytes);
}

static void random_headers_are_survived(void **state)
{
    (void)state;
    uint32_t seed = 11;
    uint8_t bytes[sizeof golden];
    for (int round = 0; round < 20000; round++) {
        memcpy(bytes, golden, sizeof golden);
        for (int flips = 0; flips < 3; flips++) {
            seed = seed * 1664525u + 1013904223u;
            bytes[8 + (seed >> 8) % (GOLDEN_BYTES - 8)] = (uint8_t)(seed >> 24);
        }
        Bounced__Envelope *envelope = NULL;
        enum bd_err err = bd_envelope_decode(bytes + 8, GOLDEN_BYTES - 8, &envelope, NULL);
        assert_true(err == BD_ERR_OK || err == BD_ERR_BAD_INPUT);
        bd_envelope_free(&envelope);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(render_has_golden_bytes),
        cmocka_unit_test(golden_bytes_are_read),
        cmocka_unit_test(truncation_at_every_byte_is_survived),
        cmocka_unit_test(unknown_body_keeps_its_request_id),
        cmocka_unit_test(hostile_header_breaks_the_budget),
        cmocka_unit_test(random_headers_are_survived),
    };
    return cmocka_run_group_tests_name("wire", tests, NULL, NULL);
}
