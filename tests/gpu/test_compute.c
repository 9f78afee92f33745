#include <string.h>

#include "gpu/gpu_internal.h"
#include "gpu_test.h"
#include "test/size.h"

static void fill(struct bd_tex *tex, float offset)
{
    const struct bd_program *program = compute_program("test/fill.comp");
    uint32_t group[3];
    bd_program_group_size(program, group);
    assert_int_equal(group[0], 8);
    assert_int_equal(group[1], 4);
    const struct bd_bindings bindings = {
        .images[0] = {.tex = tex, .write = tex != NULL},
        .uniforms[0] = {&offset, sizeof offset},
    };
    bd_gpu_dispatch(gpu, program, &bindings, TEST_WIDTH / group[0], TEST_HEIGHT / group[1], 1);
}

static void dispatch_writes_what_it_computes(void **state)
{
    (void)state;
    struct bd_tex *tex = make_tex(BD_FORMAT_R32F, TEST_WIDTH, TEST_HEIGHT, 0);
    fill(tex, 0.25f);
    float texels[TEST_HEIGHT][TEST_WIDTH];
    read_tex(tex, 0, texels, sizeof texels);
    for (int y = 0; y < TEST_HEIGHT; y++)
        for (int x = 0; x < TEST_WIDTH; x++)
            assert_true(texels[y][x] == 100.0f * (float)y + (float)x + 0.25f);
    bd_tex_destroy(gpu, &tex);
}

// A shader that stores to an image which the call does not have writes nowhere: not to the one that
// an earlier call had there.
static void nothing_is_stored_where_no_image_is(void **state)
{
    (void)state;
    struct bd_tex *tex = make_tex(BD_FORMAT_R32F, TEST_WIDTH, TEST_HEIGHT, 0);
    fill(tex, 0.25f);
    fill(NULL, 7);
    float texels[TEST_HEIGHT][TEST_WIDTH];
    read_tex(tex, 0, texels, sizeof texels);
    assert_true(texels[0][0] == 0.25f && texels[1][2] == 102.25f);
    bd_tex_destroy(gpu, &tex);
}

// image store -> sampled + storage -> storage read -> image store -> sampled ..., many times over
// the same resources: each step reads what the one before wrote.
static void chain_of_dispatches_sees_every_write(void **state)
{
    (void)state;
    struct bd_tex *tex = make_tex(BD_FORMAT_R32F, TEST_WIDTH, TEST_HEIGHT, 0);
    struct bd_buf *sums = make_buf(TEST_WIDTH * TEST_HEIGHT * sizeof(float), NULL);
    const struct bd_program *sum = compute_program("test/sum.comp");
    const struct bd_program *unsum = compute_program("test/unsum.comp");
    const struct bd_bindings to_buffer = {
        .textures[3] = {.tex = tex, .wrap_s = BD_TEX_CLAMP, .wrap_t = BD_TEX_CLAMP},
        .storage[1] = {.buf = sums, .read = true, .write = true},
    };
    const struct bd_bindings to_image = {
        .storage[0] = {.buf = sums, .read = true},
        .images[0] = {.tex = tex, .write = true},
    };
    fill(tex, 0);
    for (int i = 0; i < 6; i++) {
        bd_gpu_dispatch(gpu, sum, &to_buffer, TEST_WIDTH / 8, TEST_HEIGHT / 4, 1);
        bd_gpu_dispatch(gpu, unsum, &to_image, TEST_WIDTH / 8, TEST_HEIGHT / 4, 1);
    }
    float expected_tex[TEST_HEIGHT][TEST_WIDTH], expected_sum[TEST_HEIGHT][TEST_WIDTH] = {{0}};
    for (int y = 0; y < TEST_HEIGHT; y++)
        for (int x = 0; x < TEST_WIDTH; x++) expected_tex[y][x] = 100.0f * (float)y + (float)x;
    for (int i = 0; i < 6; i++) {
        for (int y = 0; y < TEST_HEIGHT; y++)
            for (int x = 0; x < TEST_WIDTH; x++)
                expected_sum[y][x] += expected_tex[TEST_HEIGHT - 1 - y][TEST_WIDTH - 1 - x];
        memcpy(expected_tex, expected_sum, sizeof expected_tex);
    }
    float texels[TEST_HEIGHT][TEST_WIDTH], values[TEST_HEIGHT][TEST_WIDTH];
    read_tex(tex, 0, texels, sizeof texels);
    assert_int_equal(bd_buf_read(gpu, sums, 0, values, sizeof values), BD_ERR_OK);
    assert_memory_equal(texels, expected_tex, sizeof texels);
    assert_memory_equal(values, expected_sum, sizeof values);
    bd_buf_destroy(gpu, &sums);
    bd_tex_destroy(gpu, &tex);
}

static void sum_array(const struct bd_program *program)
{
    float values[10][4], total[4], expected[4] = {0};
    for (int i = 0; i < 10; i++)
        for (int c = 0; c < 4; c++) {
            values[i][c] = (float)(i * i + c);
            expected[c] += values[i][c];
        }
    struct bd_buf *array = make_buf(sizeof values, values);
    struct bd_buf *result = make_buf(sizeof total, NULL);
    const struct bd_bindings bindings = {
        .arrays[2] = array,
        .storage[2] = {.buf = result, .write = true},
    };
    bd_gpu_dispatch(gpu, program, &bindings, 1, 1, 1);
    assert_int_equal(bd_buf_read(gpu, result, 0, total, sizeof total), BD_ERR_OK);
    assert_memory_equal(total, expected, sizeof total);
    bd_buf_destroy(gpu, &result);
    bd_buf_destroy(gpu, &array);
}

// What the host writes into borrowed bytes the device reads, and the other way round, more than
// once.
static void borrow_and_sum(const struct bd_program *sum, struct bd_buf *array,
                           struct bd_buf *result, float first)
{
    float expected = 0;
    void *bytes = NULL;
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_buf_borrow(gpu, array, BD_BORROW_TO_WRITE, &bytes, &detail), BD_ERR_OK);
    for (int i = 0; i < 40; i++) {
        ((float *)bytes)[i] = first + (float)i;
        if (i % 4 == 0) expected += first + (float)i;
    }
    bd_buf_return(gpu, array, BD_BORROW_TO_WRITE, &bytes);
    assert_null(bytes);
    const struct bd_bindings bindings = {
        .arrays[2] = array,
        .storage[2] = {.buf = result, .write = true},
    };
    bd_gpu_dispatch(gpu, sum, &bindings, 1, 1, 1);
    assert_int_equal(bd_buf_borrow(gpu, result, BD_BORROW_TO_READ, &bytes, &detail), BD_ERR_OK);
    assert_true(*(float *)bytes == expected);
    bd_buf_return(gpu, result, BD_BORROW_TO_READ, &bytes);
}

static void borrowed_bytes_are_the_buffers(void **state)
{
    (void)state;
    const struct bd_program *sum = compute_program("test/array.comp");
    struct bd_buf *array = make_buf(40 * sizeof(float), NULL);
    struct bd_buf *result = make_buf(4 * sizeof(float), NULL);
    for (int i = 0; i < 3; i++) borrow_and_sum(sum, array, result, (float)(10 * i));
    // As on a device with a memory of its own.
    array->bytes = result->bytes = NULL;
    for (int i = 0; i < 3; i++) borrow_and_sum(sum, array, result, (float)(7 * i));
    bd_buf_destroy(gpu, &result);
    bd_buf_destroy(gpu, &array);
}

// Both forms that an array has, whatever the device is.
static void array_is_read_beside_a_storage_block_of_its_number(void **state)
{
    (void)state;
    bool preferred = gpu->arrays_are_textures;
    for (int form = 0; form < 2; form++) {
        struct bd_program_source source = {.compute = "test/array.comp"};
        struct bd_program *program;
        struct bd_err_detail detail = {0};
        bd_define(&source.defines, "FORM", form); // programs are kept by source and defines
        gpu->arrays_are_textures = form == 0;
        assert_int_equal(bd_program_get(gpu, &source, &program, &detail), BD_ERR_OK);
        sum_array(program);
    }
    gpu->arrays_are_textures = preferred;
}

static void warm_up_leaves_no_trace(void **state)
{
    (void)state;
    // sum.comp adds to its block: a warm-up on the real one would show.
    struct bd_tex *tex = make_tex(BD_FORMAT_R32F, 64, 64, 0);
    const float one[4] = {1, 0, 0, 0};
    bd_tex_clear(gpu, tex, one);
    struct bd_buf *sums = make_buf(TEST_WIDTH * TEST_HEIGHT * sizeof(float), NULL);
    const struct bd_bindings bindings = {
        .textures[3] = {.tex = tex},
        .storage[1] = {.buf = sums, .read = true, .write = true},
    };
    bd_gpu_dispatch(gpu, compute_program("test/sum.comp"), &bindings, 2, 2, 1);
    float values[TEST_WIDTH * TEST_HEIGHT];
    assert_int_equal(bd_buf_read(gpu, sums, 0, values, sizeof values), BD_ERR_OK);
    for (size_t i = 0; i < COUNT(values); i++) assert_true(values[i] == 1.0f);
    bd_buf_destroy(gpu, &sums);
    bd_tex_destroy(gpu, &tex);
}

// The counts come from a shader, and lie somewhere in their buffer.
static void counts_on_the_device_say_how_much_runs(void **state)
{
    (void)state;
    static const uint32_t cases[][4] = {{1, 2}, {2, 1, 1}, {0, 2, 1}, {1, 2, 1}};
    struct bd_tex *tex = make_tex(BD_FORMAT_R32F, TEST_WIDTH, TEST_HEIGHT, 0);
    struct bd_buf *counts = make_buf(5 * sizeof(uint32_t), NULL);
    for (size_t i = 0; i < COUNT(cases); i++) {
        const struct bd_bindings to_counts = {
            .storage[0] = {.buf = counts, .write = true},
            .uniforms[0] = {cases[i], sizeof cases[i]},
        };
        const float offset = 1;
        const struct bd_bindings to_image = {
            .images[0] = {.tex = tex, .write = true},
            .uniforms[0] = {&offset, sizeof offset},
        };
        bd_tex_clear(gpu, tex, (const float[4]){0});
        bd_gpu_dispatch(gpu, compute_program("test/counts.comp"), &to_counts, 1, 1, 1);
        bd_gpu_dispatch_indirect(gpu, compute_program("test/fill.comp"), &to_image, counts, 8);
        float texels[TEST_HEIGHT][TEST_WIDTH];
        read_tex(tex, 0, texels, sizeof texels);
        for (uint32_t y = 0; y < TEST_HEIGHT; y++)
            for (uint32_t x = 0; x < TEST_WIDTH; x++) {
                bool runs = x < 8 * cases[i][0] && y < 4 * cases[i][1] && cases[i][2] > 0;
                assert_true((texels[y][x] > 0) == runs);
            }
    }
    bd_buf_destroy(gpu, &counts);
    bd_tex_destroy(gpu, &tex);
}

static void upload_clear_and_partial_read(void **state)
{
    (void)state;
    const uint8_t bytes[6] = {1, 2, 3, 4, 5, 6}, patch[2] = {8, 9};
    uint8_t read[6];
    struct bd_buf *buf = make_buf(sizeof bytes, bytes);
    assert_int_equal(bd_buf_size_bytes(buf), sizeof bytes);
    bd_buf_upload(gpu, buf, 3, patch, sizeof patch);
    assert_int_equal(bd_buf_read(gpu, buf, 2, read, 4), BD_ERR_OK);
    assert_memory_equal(read, ((uint8_t[]){3, 8, 9, 6}), 4);
    bd_buf_clear(gpu, buf);
    assert_int_equal(bd_buf_read(gpu, buf, 0, read, 6), BD_ERR_OK);
    assert_memory_equal(read, ((uint8_t[6]){0}), 6);
    bd_buf_destroy(gpu, &buf);
}

static void sampling_wraps_filters_and_picks_layers(void **state)
{
    (void)state;
    const float row[4] = {0, 1, 2, 3};
    struct bd_tex *tex = make_tex(BD_FORMAT_R32F, 4, 1, 0);
    bd_tex_upload(gpu, tex, 0, row, sizeof row);
    struct bd_tex *layers = make_tex(BD_FORMAT_R32F, 1, 1, 3);
    for (uint32_t i = 0; i < 3; i++)
        bd_tex_upload(gpu, layers, i, &(float){10.0f * (float)(i + 1)}, sizeof(float));
    struct bd_buf *result = make_buf(6 * 4 * sizeof(float), NULL);
    // Samples at -0.375, 0.125 and 0.625: texel 1.5 beyond the left, 0, and 2.
    const float expected[3][3] = {
        [BD_TEX_REPEAT] = {2, 0, 2}, [BD_TEX_CLAMP] = {0, 0, 2}, [BD_TEX_MIRROR] = {1, 0, 2}};
    for (int wrap = BD_TEX_REPEAT; wrap <= BD_TEX_MIRROR; wrap++) {
        const struct bd_bindings bindings = {
            .textures[0] = {.tex = tex,
                            .sampling = BD_SAMPLE_LINEAR,
                            .wrap_s = (enum bd_tex_wrap)wrap},
            .textures[1] = {.tex = layers, .sampling = BD_SAMPLE_NEAREST},
            .storage[0] = {.buf = result, .write = true},
        };
        bd_gpu_dispatch(gpu, compute_program("test/sample.comp"), &bindings, 3, 1, 1);
        float found[6][4];
        assert_int_equal(bd_buf_read(gpu, result, 0, found, sizeof found), BD_ERR_OK);
        for (int i = 0; i < 3; i++) {
            assert_true(found[2 * i][0] == expected[wrap][i]);
            assert_true(found[2 * i + 1][0] == 10.0f * (float)(i + 1));
        }
    }
    bd_buf_destroy(gpu, &result);
    bd_tex_destroy(gpu, &layers);
    bd_tex_destroy(gpu, &tex);
}

static void compile_errors_name_file_and_line(void **state)
{
    (void)state;
    const struct bd_program_source source = {.compute = "test/broken.comp"};
    struct bd_program *program;
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_program_get(gpu, &source, &program, &detail), BD_ERR_DEVICE);
    assert_non_null(strstr(detail.message, "test/broken.comp:5"));
    assert_non_null(strstr(detail.message, "undeclared_name"));
}

static void a_program_is_made_once(void **state)
{
    (void)state;
    const struct bd_program *first = compute_program("test/fill.comp");
    uint32_t count = bd_gpu_program_count(gpu);
    double compile_ms = bd_gpu_compile_ms(gpu);
    assert_ptr_equal(compute_program("test/fill.comp"), first);
    assert_int_equal(bd_gpu_program_count(gpu), count);
    assert_true(bd_gpu_compile_ms(gpu) == compile_ms);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(dispatch_writes_what_it_computes),
        cmocka_unit_test(nothing_is_stored_where_no_image_is),
        cmocka_unit_test(chain_of_dispatches_sees_every_write),
        cmocka_unit_test(array_is_read_beside_a_storage_block_of_its_number),
        cmocka_unit_test(warm_up_leaves_no_trace),
        cmocka_unit_test(counts_on_the_device_say_how_much_runs),
        cmocka_unit_test(upload_clear_and_partial_read),
        cmocka_unit_test(borrowed_bytes_are_the_buffers),
        cmocka_unit_test(sampling_wraps_filters_and_picks_layers),
        cmocka_unit_test(compile_errors_name_file_and_line),
        cmocka_unit_test(a_program_is_made_once),
    };
    gpu_test_open();
    return gpu_test_close(cmocka_run_group_tests(tests, NULL, NULL));
}
