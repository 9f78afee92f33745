// The parts of net/ that need no socket: addresses, buckets, browser rules, routes, queries,
// multipart bodies.

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "net/access/auth.h"
#include "net/command/command.h"
#include "net/http/http_guard.h"
#include "net/http/http_route.h"
#include "net/loop/address.h"
#include "net/loop/client.h"
#include "net/wire/frame_options.h"
#include "net/wire/multipart.h"

#include "../protocol/cmocka_all.h"

static void addresses_and_who_can_reach_them(void **state)
{
    (void)state;
    static const struct {
        const char *text, *canonical;
        bool local;
    } good[] = {
        {"unix:/run/x", "unix:/run/x", true},
        {"tcp:127.0.0.1:80", "127.0.0.1:80", true},
        {"127.9.9.9:1", "127.9.9.9:1", true},
        {"localhost:7", "127.0.0.1:7", true},
        {"tcp:[::1]:80", "[::1]:80", true},
        {"0.0.0.0:80", "0.0.0.0:80", false},
        {"[::]:80", "[::]:80", false},
        {"10.0.0.1:65535", "10.0.0.1:65535", false},
        {"[::ffff:127.0.0.1]:1", "[::ffff:127.0.0.1]:1", false},
    };
    for (size_t i = 0; i < sizeof good / sizeof good[0]; i++) {
        struct bd_address address;
        char text[128];
        assert_int_equal(bd_address_parse(good[i].text, &address, NULL), BD_ERR_OK);
        bd_address_text(&address, text, sizeof text);
        assert_string_equal(text, good[i].canonical);
        assert_int_equal(bd_address_is_local(&address), good[i].local);
    }
}

static void bucket_holds_twice_the_rate(void **state)
{
    (void)state;
    struct bd_limits limits = bd_limits_default;
    limits.requests_per_second = 1;
    limits.jobs_per_client = 2;
    struct bd_clients *clients = bd_clients_create(&limits);
    struct bd_client *one = bd_client_get(clients, "one"), *other = bd_client_get(clients, "other");
    assert_ptr_equal(bd_client_get(clients, "one"), one);
    one->references--;
    assert_int_equal(bd_client_take_request(clients, one, NULL), BD_ERR_OK);
    assert_int_equal(bd_client_take_request(clients, one, NULL), BD_ERR_OK);
    assert_int_equal(bd_client_take_request(clients, one, NULL), BD_ERR_BUSY);
    assert_int_equal(bd_client_take_request(clients, other, NULL), BD_ERR_OK);

    assert_int_equal(bd_client_begin_job(clients, one, NULL), BD_ERR_OK);
    assert_int_equal(bd_client_begin_job(clients, one, NULL), BD_ERR_OK);
    assert_int_equal(bd_client_begin_job(clients, one, NULL), BD_ERR_BUSY);
    bd_client_end_job(one);
    assert_int_equal(bd_client_begin_job(clients, one, NULL), BD_ERR_OK);

    // Going away is no way around the rate.
    struct bd_client *gone = one;
    bd_client_release(&gone);
    bd_clients_sweep(clients);
    one = bd_client_get(clients, "one");
    assert_int_equal(bd_client_take_request(clients, one, NULL), BD_ERR_BUSY);
    bd_client_release(&one);
    bd_client_release(&other);
    bd_clients_destroy(&clients);
}

static void media_types_are_whole_words(void **state)
{
    (void)state;
    assert_true(bd_http_media_is("application/json", "application/json"));
    assert_true(bd_http_media_is("Application/JSON; charset=utf-8", "application/json"));
    assert_false(bd_http_media_is("application/jsonp", "application/json"));
    assert_false(bd_http_media_is("application/jso", "application/json"));
    assert_false(bd_http_media_is(NULL, "application/json"));
}

static void routes(void **state)
{
    (void)state;
    struct bd_http_target target;
    bd_http_route_find("/v1/scenes/abc/frame.exr?size=1x2&x", &target);
    assert_int_equal(target.route, BD_HTTP_ROUTE_FRAME);
    assert_string_equal(target.id, "abc");
    assert_string_equal(target.extension, "exr");
    assert_string_equal(target.query, "size=1x2&x");
    static const char *const nothing[] = {"",
                                          "/index.html",
                                          "/v1/scenes/",
                                          "/v1/scenes//frame.png",
                                          "/v1/scenes/a/frame.",
                                          "/v1/scenes/a/frame.pngx",
                                          "/v1/scenes/a/frame.png/",
                                          "/v1/scenesx",
                                          "/v1/blobs/sha256:",
                                          "/v1/blobs/md5:00",
                                          "/healthz/",
                                          "/v1/blobs/sha256:a/b",
                                          "http://127.0.0.1/healthz"};
    for (size_t i = 0; i < sizeof nothing / sizeof nothing[0]; i++) {
        bd_http_route_find(nothing[i], &target);
        assert_int_equal(target.route, BD_HTTP_ROUTE_NONE);
    }
}

// What a connection does itself (net/session/session.h): no commands.
static bool is_of_connections(const char *name)
{
    static const char *const names[] = {"hello",     "blob_put",    "cancel",     "scene_watch",
                                        "view_open", "view_update", "view_close", "view_credit"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
        if (strcmp(names[i], name) == 0) return true;
    return false;
}

// Answers and events have numbers from 40 on.
static void every_request_of_the_schema_has_a_row(void **state)
{
    (void)state;
    const ProtobufCMessageDescriptor *envelope = &bounced__envelope__descriptor;
    for (unsigned i = 0; i < envelope->n_fields; i++) {
        const ProtobufCFieldDescriptor *field = &envelope->fields[i];
        if (field->type != PROTOBUF_C_TYPE_MESSAGE || field->id >= BOUNCED__ENVELOPE__BODY_ERROR)
            continue;
        const bool has_row = bd_command_row_of((Bounced__Envelope__BodyCase)field->id) != NULL;
        if (has_row == is_of_connections(field->name)) fail_msg("%s", field->name);
    }
}

static void rows_lead_to_themselves(void **state)
{
    (void)state;
    const struct bd_command_row *row;
    for (uint32_t i = 0; (row = bd_command_row_at(i)); i++) {
        const ProtobufCMessageDescriptor *message = bd_command_message(row);
        assert_ptr_equal(bd_command_row_of(row->body), row);
        assert_true(!row->scene ||
                    protobuf_c_message_descriptor_get_field_by_name(message, row->scene));
        if (!row->http) continue;
        struct bd_http_target target;
        const char *path = strchr(row->http, ' ') + 1;
        assert_int_equal(strstr(path, "/ID") != NULL, row->scene != NULL);
        bd_http_route_find(path, &target);
        assert_int_equal(target.route, BD_HTTP_ROUTE_COMMAND);
        if (row->scene) assert_string_equal(target.id, "ID");
        int found = 0;
        for (int method = BD_HTTP_GET; method <= BD_HTTP_DELETE; method++)
            found += bd_http_command_by(target.command, (enum bd_http_method)method) == row;
        assert_int_equal(found, 1);
    }
}

static void queries(void **state)
{
    (void)state;
    Bounced__Render *render;
    assert_int_equal(bd_http_query_read("size=640x480&set=vpls%3d256&set=brdf=lambert&layers=a,b&"
                                        "camera=My+cam%2e&size=64x48&aa=4",
                                        "json", &render, NULL),
                     BD_ERR_OK);
    const Bounced__FrameRequest *frame = render->frame;
    assert_int_equal(frame->n_size, 2);
    assert_int_equal(frame->size[0], 64); // the last one wins
    assert_int_equal(frame->n_parameters, 2);
    assert_string_equal(frame->parameters[0]->key, "vpls");
    assert_string_equal(frame->parameters[0]->value, "256");
    assert_int_equal(frame->n_layers, 2);
    assert_string_equal(frame->layers[1], "b");
    assert_string_equal(frame->camera, "My cam.");
    assert_string_equal(frame->encoding, "none");
    assert_true(frame->has_aa && frame->aa == 4 && !frame->has_seed);
    assert_null(render->environment);
    bounced__render__free_unpacked(render, NULL);
}

static void environments_in_queries(void **state)
{
    (void)state;
    Bounced__Render *render;
    assert_int_equal(bd_http_query_read("environment=9,9,9&environment=0.5,1e3,0&"
                                        "environment=sha256%3Aabc",
                                        "", &render, NULL),
                     BD_ERR_OK);
    assert_int_equal(render->environment->n_radiance, 3);
    assert_true(render->environment->radiance[0] == 0.5); // the last one wins
    assert_true(render->environment->radiance[1] == 1000);
    assert_string_equal(render->environment->map, "sha256:abc");
    bounced__render__free_unpacked(render, NULL);
    static const char *const wrong[] = {"", "1", "1,2", "1,2,3,4", "1,2,x", "1,,3", "sky.exr"};
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        char query[40];
        struct bd_err_detail detail = {0};
        snprintf(query, sizeof query, "environment=%s", wrong[i]);
        assert_int_equal(bd_http_query_read(query, "png", &render, &detail), BD_ERR_USAGE);
        assert_string_equal(detail.field, "environment");
    }
}

static void boundaries(void **state)
{
    (void)state;
    char boundary[80];
    assert_true(bd_multipart_boundary("multipart/form-data; boundary=abc", boundary, 80));
    assert_string_equal(boundary, "abc");
    assert_true(
        bd_multipart_boundary("Multipart/Form-Data; a=b; BOUNDARY=\"a b\"; c", boundary, 80));
    assert_string_equal(boundary, "a b");
    assert_false(bd_multipart_boundary("multipart/form-data", boundary, 80));
    assert_false(bd_multipart_boundary("multipart/form-data; boundary=", boundary, 80));
    assert_false(bd_multipart_boundary("text/plain; boundary=abc", boundary, 80));
}

// Two parts, the second of them empty; truncated at every byte it is refused, and nothing is read
// behind its end (the copies are exactly as long as they say).
static void multipart_truncated_at_every_byte(void **state)
{
    (void)state;
    static const char body[] =
        "--b\r\nContent-Disposition: form-data; name=\"scene\"\r\n\r\n"
        "data\r\n--b\r\nX: y\r\nContent-Disposition: form-data; name=\"e\"\r\n"
        "\r\n\r\n--b--\r\n";
    size_t whole = sizeof body - 1, last = whole - 2; // the final line end may be missing
    for (size_t size = 0; size <= whole; size++) {
        char *copy = malloc(size ? size : 1);
        memcpy(copy, body, size);
        struct bd_multipart_part *parts;
        uint32_t count;
        enum bd_err err = bd_multipart_parse(copy, size, "b", 8, &parts, &count, NULL);
        assert_int_equal(err, size >= last ? BD_ERR_OK : BD_ERR_BAD_INPUT);
        if (!err) {
            assert_int_equal(count, 2);
            assert_string_equal(parts[0].name, "scene");
            assert_int_equal(parts[0].size_bytes, 4);
            assert_memory_equal(parts[0].bytes, "data", 4);
            assert_string_equal(parts[1].name, "e");
            assert_int_equal(parts[1].size_bytes, 0);
            free(parts);
        }
        free(copy);
    }
    struct bd_multipart_part *parts;
    uint32_t count;
    assert_int_equal(bd_multipart_parse(body, whole, "b", 1, &parts, &count, NULL), BD_ERR_LIMIT);
}

// Whoever does not say is measured against all of the light, on every face: this is where requests
// of all of them are read.
static void errors_are_against_the_whole_equation(void **state)
{
    (void)state;
    static const struct {
        const char *said;
        enum bd_err err;
        enum bd_against against;
    } cases[] = {{NULL, BD_ERR_OK, BD_AGAINST_FULL},
                 {"full", BD_ERR_OK, BD_AGAINST_FULL},
                 {"model", BD_ERR_OK, BD_AGAINST_MODEL},
                 {"", BD_ERR_USAGE, BD_AGAINST_FULL},
                 {"truth", BD_ERR_USAGE, BD_AGAINST_FULL}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        Bounced__FrameRequest request = BOUNCED__FRAME_REQUEST__INIT;
        struct bd_frame_options options;
        struct bd_err_detail detail = {0};
        request.against = (char *)cases[i].said;
        assert_int_equal(bd_frame_options_read(&request, &options, &detail), cases[i].err);
        assert_int_equal(options.frame.against, cases[i].against);
        if (cases[i].err) assert_string_equal(detail.field, "against");
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(addresses_and_who_can_reach_them),
        cmocka_unit_test(bucket_holds_twice_the_rate),
        cmocka_unit_test(media_types_are_whole_words),
        cmocka_unit_test(routes),
        cmocka_unit_test(every_request_of_the_schema_has_a_row),
        cmocka_unit_test(rows_lead_to_themselves),
        cmocka_unit_test(queries),
        cmocka_unit_test(environments_in_queries),
        cmocka_unit_test(boundaries),
        cmocka_unit_test(errors_are_against_the_whole_equation),
        cmocka_unit_test(multipart_truncated_at_every_byte),
    };
    return cmocka_run_group_tests_name("net units", tests, NULL, NULL);
}
