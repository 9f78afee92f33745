// The JSON form: the report's shape, tables, wide numbers, refusals with their paths.

#include "protocol/json.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/bounced.pb-c.h"

#include "cmocka_all.h"

static enum bd_err read_text(const char *text, const ProtobufCMessageDescriptor *descriptor,
                             ProtobufCMessage **out, struct bd_err_detail *detail)
{
    return bd_json_text_to_message(text, strlen(text), descriptor, out, detail);
}

// Reads, writes and compares: what comes out is the canonical form of what went in.
static void assert_round_trip(const ProtobufCMessageDescriptor *descriptor, const char *in,
                              const char *expected)
{
    ProtobufCMessage *message = NULL;
    struct bd_err_detail detail = {0};
    if (read_text(in, descriptor, &message, &detail)) fail_msg("%s", detail.message);
    char *out = bd_json_text_from_message(message);
    assert_string_equal(out, expected);
    free(out);
    protobuf_c_message_free_unpacked(message, NULL);
}

static void report_has_the_documented_shape(void **state)
{
    (void)state;
    static const char report[] =
        "{\"scene\":\"sha256:00\",\"revision\":3,\"size\":[1024,512],\"camera\":\"main\","
        "\"technique\":\"rsm\",\"parameters\":{\"vpls\":1024,\"brdf\":\"lambert\",\"near\":0.5},"
        "\"seed\":0,\"aa\":1,\"device\":{\"name\":\"n\",\"class\":\"c\",\"software\":true},"
        "\"build\":\"b\",\"time_ms\":{\"total\":1.5,\"encode\":0.0},"
        "\"passes\":[{\"name\":\"rsm\",\"ms\":0.9,\"state\":\"ran\"}],"
        "\"omitted\":[{\"pass\":\"specular\",\"reason\":\"no specular surface\"}],"
        "\"counts\":{\"lights\":1,\"vpls\":1024},\"memory_mib\":{\"gpu\":0.25},"
        "\"flags\":[\"default_lights\"],\"nonfinite_pixels\":0,\"exposure_stops\":-2.5,"
        "\"error\":[],\"stopped\":\"complete\"}";
    assert_round_trip(&bounced__report__descriptor, report, report);
}

static void tables_are_objects(void **state)
{
    (void)state;
    assert_round_trip(&bounced__scene_add__descriptor,
                      "{\"files\":{\"a b.bin\":\"sha256:1\",\"c\":\"sha256:2\"}}",
                      "{\"files\":{\"a b.bin\":\"sha256:1\",\"c\":\"sha256:2\"}}");
    assert_round_trip(&bounced__frame_request__descriptor,
                      "{\"parameters\":{\"vpls\":\"256\",\"x\":0.1,\"y\":\"1e9999\"},\"aa\":null}",
                      "{\"parameters\":{\"vpls\":256,\"x\":0.1,\"y\":\"1e9999\"},"
                      "\"size\":[],\"layers\":[],\"region\":[]}");
}

#define EMPTY_LISTS "{\"parameters\":{},\"size\":[],\"layers\":[],"

static void wide_numbers_are_strings(void **state)
{
    (void)state;
    assert_round_trip(&bounced__frame_request__descriptor, "{\"seed\":9007199254740992}",
                      EMPTY_LISTS "\"seed\":9007199254740992,\"region\":[]}");
    assert_round_trip(&bounced__frame_request__descriptor, "{\"seed\":\"18446744073709551615\"}",
                      EMPTY_LISTS "\"seed\":\"18446744073709551615\",\"region\":[]}");
    assert_round_trip(&bounced__frame_request__descriptor, "{\"seed\":\"12\"}",
                      EMPTY_LISTS "\"seed\":12,\"region\":[]}");
}

static void numbers_beyond_json_are_null(void **state)
{
    (void)state;
    Bounced__ReportTime time = BOUNCED__REPORT_TIME__INIT;
    time.has_total = 1;
    time.total = NAN;
    char *text = bd_json_text_from_message(&time.base);
    assert_string_equal(text, "{\"total\":null}");
    free(text);
}

static void text_that_is_not_utf8_is_replaced(void **state)
{
    (void)state;
    char name[] = "\xff\xfe";
    Bounced__SceneGet scene = BOUNCED__SCENE_GET__INIT;
    scene.id = name;
    char *text = bd_json_text_from_message(&scene.base);
    assert_string_equal(text, "{\"id\":\"(not UTF-8)\"}");
    free(text);
}

static void oneof_takes_one(void **state)
{
    (void)state;
    assert_round_trip(&bounced__envelope__descriptor,
                      "{\"request_id\":1,\"scene_get\":{\"id\":\"x\"}}",
                      "{\"request_id\":1,\"scene_get\":{\"id\":\"x\"}}");
    ProtobufCMessage *message = NULL;
    assert_int_equal(
        read_text("{\"stats\":{},\"devices\":{}}", &bounced__envelope__descriptor, &message, NULL),
        BD_ERR_BAD_INPUT);
    assert_null(message);
}

static void wrong_types_are_refused_with_their_path(void **state)
{
    (void)state;
    static const struct {
        const char *text, *path;
    } bad[] = {
        {"{\"frame\":{\"size\":[64,\"x\"]}}", "frame.size[1]"},
        {"{\"frame\":{\"size\":64}}", "frame.size"},
        {"{\"frame\":{\"size\":[-1,4]}}", "frame.size[0]"},
        {"{\"frame\":{\"size\":[4294967296]}}", "frame.size[0]"},
        {"{\"frame\":{\"aa\":1.5}}", "frame.aa"},
        {"{\"frame\":{\"aa\":\"4\"}}", "frame.aa"},
        {"{\"frame\":{\"seed\":\"\"}}", "frame.seed"},
        {"{\"frame\":{\"seed\":\"18446744073709551616\"}}", "frame.seed"},
        {"{\"frame\":{\"plan_only\":1}}", "frame.plan_only"},
        {"{\"frame\":{\"layers\":[\"a\",7]}}", "frame.layers[1]"},
        {"{\"frame\":{\"parameters\":{\"vpls\":[]}}}", "frame.parameters.vpls"},
        {"{\"frame\":{\"parameters\":[]}}", "frame.parameters"},
        {"{\"frame\":[]}", "frame"},
        {"{\"scene\":{}}", "scene"},
        {"{\"files\":{\"a\":null}}", "files.a"},
        {"[]", ""},
        {"{\"scene\":\"a\",\"scene\":\"b\"}", "body"},
        {"{\"scene\":\"a\"} x", "body"},
        {"{\"scene\":\"a\\u0000b\"}", "body"},
        {"", "body"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        ProtobufCMessage *message = NULL;
        struct bd_err_detail detail = {0};
        assert_int_equal(read_text(bad[i].text, &bounced__render__descriptor, &message, &detail),
                         BD_ERR_BAD_INPUT);
        assert_null(message);
        assert_string_equal(detail.field, bad[i].path);
        assert_true(detail.message[0] != 0);
    }
}

static void unknown_names_are_refused_with_their_path(void **state)
{
    (void)state;
    static const struct {
        const char *text, *path, *hint;
    } bad[] = {
        {"{\"ops\":[{},{\"set_node\":{\"translation\":[1,2,3]}}]}", "ops[1].set_node.translation",
         "; did you mean \"transform.translation\"?"},
        {"{\"ops\":[{\"set_nod\":{}}]}", "ops[0].set_nod", "; did you mean \"set_node\"?"},
        {"{\"scnee\":\"x\"}", "scnee", "; did you mean \"scene\"?"},
        {"{\"\":1}", "", "name"},
        {"{\"nothing_like_it\":null}", "nothing_like_it", "such name"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        ProtobufCMessage *message = NULL;
        struct bd_err_detail detail = {0};
        assert_int_equal(
            read_text(bad[i].text, &bounced__edit_batch__descriptor, &message, &detail),
            BD_ERR_USAGE);
        assert_null(message);
        assert_string_equal(detail.field, bad[i].path);
        const size_t length = strlen(detail.message), end = strlen(bad[i].hint);
        assert_true(length >= end);
        assert_string_equal(detail.message + length - end, bad[i].hint);
    }
}

// A request without a body has no text at all.
static void no_body_is_an_empty_one(void **state)
{
    (void)state;
    ProtobufCMessage *message = NULL;
    struct bd_err_detail detail = {0};
    assert_int_equal(
        bd_json_text_to_message(NULL, 0, &bounced__render__descriptor, &message, &detail),
        BD_ERR_BAD_INPUT);
    assert_string_equal(detail.message, "the body is empty");
}

// Truncation of a valid body at every byte is refused and leaks nothing.
static void truncation_at_every_byte_is_refused(void **state)
{
    (void)state;
    static const char body[] =
        "{\"files\":{\"a\":\"b\"},\"frame\":{\"size\":[1,2],\"layers\":[\"x\"]}}";
    for (size_t size = 0; size < sizeof body - 1; size++) {
        ProtobufCMessage *message = NULL;
        assert_int_equal(
            bd_json_text_to_message(body, size, &bounced__render__descriptor, &message, NULL),
            BD_ERR_BAD_INPUT);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(report_has_the_documented_shape),
        cmocka_unit_test(tables_are_objects),
        cmocka_unit_test(unknown_names_are_refused_with_their_path),
        cmocka_unit_test(wide_numbers_are_strings),
        cmocka_unit_test(numbers_beyond_json_are_null),
        cmocka_unit_test(text_that_is_not_utf8_is_replaced),
        cmocka_unit_test(oneof_takes_one),
        cmocka_unit_test(wrong_types_are_refused_with_their_path),
        cmocka_unit_test(no_body_is_an_empty_one),
        cmocka_unit_test(truncation_at_every_byte_is_refused),
    };
    return cmocka_run_group_tests_name("json", tests, NULL, NULL);
}
