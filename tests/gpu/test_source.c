// Assembled shader text. Needs no device.

#include <string.h>

#include "gpu/source.h"
#include "gpu_test.h"

static size_t count_of(const char *text, const char *part)
{
    size_t count = 0;
    for (; (text = strstr(text, part)); text += strlen(part)) count++;
    return count;
}

static void includes_once_and_keeps_line_numbers(void **state)
{
    (void)state;
    struct bd_defines defines = {0};
    struct bd_source source;
    struct bd_err_detail detail = {0};
    bd_define(&defines, "WITH_TEXTURES", 1);
    bd_define(&defines, "OFFSET", -3);
    assert_int_equal(bd_source_assemble("test/sum.comp", &defines, false, &source, &detail),
                     BD_ERR_OK);
    const char *start = "#version 450 core\n#define BD_GLSL 1\n#define WITH_TEXTURES 1\n"
                        "#define OFFSET -3\n#line 1 0\n";
    assert_int_equal(strncmp(source.text, start, strlen(start)), 0);
    // sum.comp includes size.glsl on its second line, that size.h on its first.
    assert_non_null(strstr(source.text, "#line 1 1\n#line 1 2\n#ifndef TEST_SIZE_H\n"));
    assert_non_null(strstr(source.text, "#endif\n#line 2 1\n#line 3 0\nlayout(local_size_x"));
    assert_int_equal(count_of(source.text, "#define TEST_WIDTH"), 1);
    assert_null(strstr(source.text, "#include"));
    assert_null(strstr(source.text, "BD_SOFTWARE"));
    assert_string_equal(source.files[2], "test/size.h");
    bd_source_finish(&source);
}

static void a_missing_include_is_named_with_its_place(void **state)
{
    (void)state;
    const struct bd_defines none = {0};
    struct bd_source source;
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_source_assemble("test/lost.comp", &none, true, &source, &detail),
                     BD_ERR_INTERNAL);
    assert_string_equal(detail.message, "test/lost.comp:3: no shader file \"test/no_such.glsl\"");
    assert_null(source.text);
    assert_int_equal(bd_source_assemble("test/none.comp", &none, true, &source, &detail),
                     BD_ERR_INTERNAL);
}

static void logs_name_files(void **state)
{
    (void)state;
    const struct bd_source source = {.files = {"a.comp", "common/b.glsl"}, .file_count = 2};
    char out[200], small[12];
    bd_source_name_files(&source, "1:17(4): error: x\n0(3) : error C0000\nERROR: 0:9: y\n7:1: z",
                         out, sizeof out);
    assert_string_equal(out, "common/b.glsl:17(4): error: x\na.comp(3) : error C0000\n"
                             "ERROR: a.comp:9: y\n7:1: z\n");
    bd_source_name_files(&source, "1:17: a long line that does not fit", small, sizeof small);
    assert_string_equal(small, "common/b.gl");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(includes_once_and_keeps_line_numbers),
        cmocka_unit_test(a_missing_include_is_named_with_its_place),
        cmocka_unit_test(logs_name_files),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
