// The framed unit: golden bytes, every way of cutting a stream, hostile lengths.

#include "protocol/framing.h"

#include <stdlib.h>
#include <string.h>

#include "cmocka_all.h"

// "hd" as header, "payload" behind it: 4 + 2 + 7 = 13.
static const uint8_t golden[] = {13,  0,   0,   0,   2,   0,   0,   0,  'h',
                                 'd', 'p', 'a', 'y', 'l', 'o', 'a', 'd'};

static void assert_is_golden(struct bd_message *message)
{
    assert_int_equal(message->header_bytes, 2);
    assert_memory_equal(message->header, "hd", 2);
    assert_int_equal(message->payload_bytes, 7);
    assert_memory_equal(message->payload, "payload", 7);
    bd_message_finish(message);
}

static void prefix_has_golden_bytes(void **state)
{
    (void)state;
    uint8_t prefix[BD_FRAMING_PREFIX_BYTES];
    bd_framing_prefix(2, 7, prefix);
    assert_memory_equal(prefix, golden, sizeof prefix);
    bd_framing_prefix(0x01020304, 0x10, prefix);
    static const uint8_t wide[] = {0x18, 3, 2, 1, 4, 3, 2, 1};
    assert_memory_equal(prefix, wide, sizeof prefix);
}

// Feeds in pieces of `step` bytes; every message that comes out must be the golden one.
static int feed_all(struct bd_decoder *decoder, const uint8_t *bytes, size_t size, size_t step)
{
    int count = 0;
    while (size > 0) {
        size_t piece = step < size ? step : size;
        size_t taken;
        assert_int_equal(bd_decoder_feed(decoder, bytes, piece, &taken, NULL), BD_ERR_OK);
        struct bd_message message;
        if (bd_decoder_take(decoder, &message)) {
            assert_is_golden(&message);
            count++;
        } else {
            assert_int_equal(taken, piece);
        }
        bytes += taken;
        size -= taken;
    }
    return count;
}

static void messages_survive_every_cut(void **state)
{
    (void)state;
    uint8_t twice[2 * sizeof golden];
    memcpy(twice, golden, sizeof golden);
    memcpy(twice + sizeof golden, golden, sizeof golden);
    for (size_t step = 1; step <= sizeof twice; step++) {
        struct bd_decoder decoder;
        bd_decoder_init(&decoder, 64, 16);
        assert_int_equal(feed_all(&decoder, twice, sizeof twice, step), 2);
        assert_true(bd_decoder_is_empty(&decoder));
        bd_decoder_finish(&decoder);
    }
}

static void truncation_at_every_byte_yields_nothing(void **state)
{
    (void)state;
    for (size_t size = 0; size < sizeof golden; size++) {
        struct bd_decoder decoder;
        bd_decoder_init(&decoder, 64, 16);
        assert_int_equal(feed_all(&decoder, golden, size, 3), 0);
        assert_int_equal(bd_decoder_is_empty(&decoder), size == 0);
        bd_decoder_finish(&decoder);
    }
}

static void empty_parts_are_fine(void **state)
{
    (void)state;
    static const uint8_t empty[] = {4, 0, 0, 0, 0, 0, 0, 0};
    struct bd_decoder decoder;
    bd_decoder_init(&decoder, 64, 16);
    size_t taken;
    assert_int_equal(bd_decoder_feed(&decoder, empty, sizeof empty, &taken, NULL), BD_ERR_OK);
    struct bd_message message;
    assert_true(bd_decoder_take(&decoder, &message));
    assert_non_null(message.header);
    assert_int_equal(message.header_bytes + message.payload_bytes, 0);
    bd_message_finish(&message);
    bd_decoder_finish(&decoder);
}

static enum bd_err feed_lengths(uint32_t total, uint32_t header_len, size_t size,
                                struct bd_err_detail *detail)
{
    uint8_t prefix[8];
    for (int i = 0; i < 4; i++) {
        prefix[i] = (uint8_t)(total >> (8 * i));
        prefix[4 + i] = (uint8_t)(header_len >> (8 * i));
    }
    struct bd_decoder decoder;
    bd_decoder_init(&decoder, 64, 16);
    size_t taken;
    enum bd_err err = bd_decoder_feed(&decoder, prefix, size, &taken, detail);
    assert_null(decoder.buffer); // nothing is allocated for a promise
    bd_decoder_finish(&decoder);
    return err;
}

static void lengths_are_checked_before_anything_is_allocated(void **state)
{
    (void)state;
    struct bd_err_detail detail;
    assert_int_equal(feed_lengths(64, 16, 8, &detail), BD_ERR_OK);
    assert_int_equal(feed_lengths(65, 16, 4, &detail), BD_ERR_LIMIT); // after four bytes already
    assert_string_equal(detail.field, "message_bytes");
    assert_int_equal(feed_lengths(UINT32_MAX, UINT32_MAX, 8, &detail), BD_ERR_LIMIT);
    assert_int_equal(feed_lengths(64, 17, 8, &detail), BD_ERR_LIMIT);
    assert_string_equal(detail.field, "header_bytes");
    assert_int_equal(feed_lengths(10, 7, 8, &detail), BD_ERR_BAD_INPUT);
    assert_int_equal(feed_lengths(4, UINT32_MAX, 8, &detail), BD_ERR_BAD_INPUT);
    for (uint32_t total = 0; total < 4; total++)
        assert_int_equal(feed_lengths(total, 0, 4, &detail), BD_ERR_BAD_INPUT);
}

static void memory_follows_what_arrived(void **state)
{
    (void)state;
    static const uint8_t promise[] = {0, 0, 0, 1, 4, 0, 0, 0, 'x'}; // 16 MiB, one byte sent
    struct bd_decoder decoder;
    bd_decoder_init(&decoder, 1 << 25, 16);
    size_t taken;
    assert_int_equal(bd_decoder_feed(&decoder, promise, sizeof promise, &taken, NULL), BD_ERR_OK);
    assert_in_range(decoder.capacity, 1, 4096);
    bd_decoder_finish(&decoder);
}

static uint32_t next_random(uint32_t *state)
{
    *state = *state * 1664525u + 1013904223u;
    return *state >> 8;
}

// Whatever the bytes, the decoder takes them, refuses them or makes messages within the limits.
static void random_bytes_stay_within_limits(void **state)
{
    (void)state;
    uint32_t seed = 7;
    for (int round = 0; round < 20000; round++) {
        uint8_t bytes[96];
        size_t size = next_random(&seed) % sizeof bytes;
        for (size_t i = 0; i < size; i++) bytes[i] = (uint8_t)next_random(&seed);
        if (round % 2 && size >= 8) memset(bytes + 1, 0, 3), memset(bytes + 5, 0, 3);
        struct bd_decoder decoder;
        bd_decoder_init(&decoder, 64, 16);
        for (size_t at = 0; at < size;) {
            size_t taken;
            if (bd_decoder_feed(&decoder, bytes + at, size - at, &taken, NULL)) break;
            at += taken;
            struct bd_message message;
            if (!bd_decoder_take(&decoder, &message)) continue;
            assert_in_range(message.header_bytes, 0, 16);
            assert_in_range(message.header_bytes + message.payload_bytes, 0, 60);
            bd_message_finish(&message);
        }
        assert_in_range(decoder.capacity, 0, 64);
        bd_decoder_finish(&decoder);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(prefix_has_golden_bytes),
        cmocka_unit_test(messages_survive_every_cut),
        cmocka_unit_test(truncation_at_every_byte_yields_nothing),
        cmocka_unit_test(empty_parts_are_fine),
        cmocka_unit_test(lengths_are_checked_before_anything_is_allocated),
        cmocka_unit_test(memory_follows_what_arrived),
        cmocka_unit_test(random_bytes_stay_within_limits),
    };
    return cmocka_run_group_tests_name("framing", tests, NULL, NULL);
}
