// The scan that comes before the parser.

#include <math.h>
#include <stdio.h>

#include "scene/gltf/gltf_scan.h"
#include "tests/unit/scene/read_text.h"

static enum bd_err scan(const char *text, struct bd_gltf_text *out, struct bd_err_detail *detail)
{
    char *json = quoted(text);
    *detail = (struct bd_err_detail){0};
    enum bd_err err = bd_gltf_scan(json, strlen(json), out, detail);
    free(json);
    return err;
}

static void assert_scan(const char *text, enum bd_err err, const char *field)
{
    struct bd_gltf_text out;
    struct bd_err_detail detail;
    enum bd_err got = scan(text, &out, &detail);
    bd_gltf_text_free(&out);
    if (got != err || strcmp(detail.field, field) != 0)
        fail_msg("%s -> %s at \"%s\": %s", text, bd_err_name(got), detail.field, detail.message);
}

static void nesting_is_limited(void **state)
{
    (void)state;
    for (int depth = BD_GLTF_NESTING_MAX - 1; depth <= BD_GLTF_NESTING_MAX; depth++) {
        char text[4 * BD_GLTF_NESTING_MAX + 64] = "{'asset':{'version':'2.0'},'extras':";
        size_t used = strlen(text);
        memset(text + used, '[', (size_t)depth);
        memset(text + used + depth, ']', (size_t)depth);
        strcpy(text + used + 2 * depth, "}");
        assert_scan(text, depth < BD_GLTF_NESTING_MAX ? BD_ERR_OK : BD_ERR_LIMIT, "");
    }
}

// tinygltf would spend 1.1 GB on this; it gets to see none of it.
static void cheap_objects_are_limited(void **state)
{
    (void)state;
    const size_t count = 500000;
    char *text = malloc(3 * count + 100);
    assert_non_null(text);
    char *at = text + sprintf(text, "{'asset':{'version':'2.0'},'materials':[{}");
    for (size_t i = 1; i < count; i++) at += sprintf(at, ",{}");
    strcpy(at, "]}");
    struct bd_gltf_text out;
    struct bd_err_detail detail;
    assert_int_equal(scan(text, &out, &detail), BD_ERR_LIMIT);
    assert_memory_equal(detail.field, "materials[", 10);
    bd_gltf_text_free(&out);
    free(text);
}

static void types_and_presence_name_a_path(void **state)
{
    (void)state;
    static const struct {
        const char *text, *field;
    } cases[] = {
        {"{}", "asset"},
        {"{'asset':{}}", "asset.version"},
        {"{'asset':{'version':2}}", "asset.version"},
        {"{'asset':{'version':'2.0'},'nodes':{}}", "nodes"},
        {"{'asset':{'version':'2.0'},'nodes':[7]}", "nodes[0]"},
        {"{'asset':{'version':'2.0'},'nodes':[{},{'mesh':-1}]}", "nodes[1].mesh"},
        {"{'asset':{'version':'2.0'},'nodes':[{},{'mesh':1.5}]}", "nodes[1].mesh"},
        {"{'asset':{'version':'2.0'},'nodes':[{'mesh':4294967296}]}", "nodes[0].mesh"},
        {"{'asset':{'version':'2.0'},'nodes':[{'mesh':null}]}", "nodes[0].mesh"},
        {"{'asset':{'version':'2.0'},'nodes':[{'scale':[1,2]}]}", "nodes[0].scale"},
        {"{'asset':{'version':'2.0'},'nodes':[{'scale':[1,2,1e999]}]}", "nodes[0].scale[2]"},
        {"{'asset':{'version':'2.0'},'nodes':[{'scale':[1,'2',3]}]}", "nodes[0].scale[1]"},
        {"{'asset':{'version':'2.0'},'nodes':[{'name':'a','name':'b'}]}", "nodes[0].name"},
        {"{'asset':{'version':'2.0'},'nodes':[{}],'buffers':[{'byteLength':0}]}",
         "buffers[0].byteLength"},
        {"{'asset':{'version':'2.0'},'nodes':[{}],'images':[{}]}", "images[0].uri"},
        {"{'asset':{'version':'2.0'},'nodes':[{}],'materials':[{'alphaMode':'GLASS'}]}",
         "materials[0].alphaMode"},
        {"{'asset':{'version':'2.0'},'meshes':[{'primitives':[{'attributes':{'POSITION':'x'}}]}]}",
         "meshes[0].primitives[0].attributes.POSITION"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
        assert_scan(cases[i].text, BD_ERR_BAD_INPUT, cases[i].field);
    assert_scan("{'asset':{'version':'3.0'}}", BD_ERR_UNSUPPORTED, "asset.version");
    assert_scan("{'asset':{'version':'2.0'},'extensionsRequired':['KHR_lights_punctual','X_y']}",
                BD_ERR_UNSUPPORTED, "extensionsRequired[1]");
}

static void syntax_is_strict(void **state)
{
    (void)state;
    static const char *const bad[] = {"{'asset':{'version':'2.0'}",
                                      "{'asset':{'version':'2.0'},}",
                                      "{'asset':{'version':'2.0'}} x",
                                      "{'asset':{'version':'2.0'},'extras':[1,]}",
                                      "{'asset':{'version':'2.0'} 'a':1}",
                                      "{'asset':{'version':'2.0'},'extras':01}",
                                      "{'asset':{'version':'2.0'},'extras':1.}",
                                      "{'asset':{'version':'2.0'},'extras':tru}",
                                      "{'asset':{'version':'2.0'},'extras':'\\x'}",
                                      "{'asset':{'version':'2.0'},'extras':'\n'}",
                                      "{'asset':{'version':'2.0'},'extras':'\\u12G4'}",
                                      "{'asset'}",
                                      "[1]",
                                      "x",
                                      "{'asset':{'version':'2.0'},'extras':'\xc0\x80'}",
                                      "{'asset':{'version':'2.0'},'extras':'\xed\xa0\x80'}",
                                      "{'asset':{'version':'2.0'},'extras':'\xf4\x90\x80\x80'}",
                                      "{'asset':{'version':'2.0'},'extras':'\xe2\x82'}"};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        struct bd_gltf_text out;
        struct bd_err_detail detail;
        if (scan(bad[i], &out, &detail) != BD_ERR_BAD_INPUT) fail_msg("accepted: %s", bad[i]);
        bd_gltf_text_free(&out);
    }
    assert_scan("{'asset':{'version':'2.0','extras':'\xf0\x9f\x98\x80 \\u00e9 \\n'}}", BD_ERR_OK,
                "");
}

static void what_nobody_reads_is_taken_out(void **state)
{
    (void)state;
    struct bd_gltf_text out;
    struct bd_err_detail detail;
    assert_int_equal(scan("{'asset':{'version':'2.0'},'animations':[{'x':1}],'nodes':[{'mesh':3e0,"
                          "'extras':'secret','extensions':{'X_y':{'secret':1}}}]}",
                          &out, &detail),
                     BD_ERR_OK);
    char *text = strndup((char *)out.bytes, out.size);
    assert_null(strstr(text, "secret"));
    assert_null(strstr(text, "\"x\""));
    assert_non_null(strstr(text, "\"mesh\":3  ,"));
    assert_true(out.has_scene);
    free(text);
    bd_gltf_text_free(&out);
}

static void odd_ends_of_a_glb(void **state)
{
    (void)state;
    // Header, a JSON chunk of 28 bytes, an empty BIN chunk, a chunk of unknown type, 3 odd bytes.
    static const uint8_t glb[] = "glTF\x02\0\0\0\x44\0\0\0"
                                 "\x1c\0\0\0JSON{\"asset\":{\"version\":\"2.0\"}} "
                                 "\0\0\0\0BIN\0"
                                 "\x04\0\0\0WHAT1234"
                                 "xyz";
    struct bd_gltf_text out;
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_gltf_scan(glb, sizeof glb - 1, &out, &detail), BD_ERR_OK);
    assert_true(out.is_glb);
    assert_int_equal(out.size, 12 + 8 + 28);
    bd_gltf_text_free(&out);
    for (size_t size = 0; size < 68; size++) {
        assert_int_not_equal(bd_gltf_scan(glb, size, &out, &detail), BD_ERR_OK);
        bd_gltf_text_free(&out);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nesting_is_limited),
        cmocka_unit_test(cheap_objects_are_limited),
        cmocka_unit_test(types_and_presence_name_a_path),
        cmocka_unit_test(syntax_is_strict),
        cmocka_unit_test(what_nobody_reads_is_taken_out),
        cmocka_unit_test(odd_ends_of_a_glb),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
