// Which barriers are issued, and that no others are: software devices run dispatch after dispatch
// and would show nothing of a missing one. libepoxy's entry points are variables, so
// glMemoryBarrier is replaced by a recorder.

#include <epoxy/gl.h>

#include "gpu_test.h"
#include "test/size.h"

static GLbitfield issued;

static void GLAPIENTRY record(GLbitfield bits)
{
    issued |= bits;
}

static struct bd_tex *tex;
static struct bd_buf *sums;

static int set_up(void **state)
{
    (void)state;
    tex = make_tex(BD_FORMAT_R32F, TEST_WIDTH, TEST_HEIGHT, 0);
    sums = make_buf(TEST_WIDTH * TEST_HEIGHT * sizeof(float), NULL);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    bd_buf_destroy(gpu, &sums);
    bd_tex_destroy(gpu, &tex);
    return 0;
}

static GLbitfield fill_image(void)
{
    const float offset = 0;
    const struct bd_bindings bindings = {
        .images[0] = {.tex = tex, .write = true},
        .uniforms[0] = {&offset, sizeof offset},
    };
    issued = 0;
    bd_gpu_dispatch(gpu, compute_program("test/fill.comp"), &bindings, 2, 2, 1);
    return issued;
}

static GLbitfield add_to_storage(void)
{
    const struct bd_bindings bindings = {
        .textures[3] = {.tex = tex},
        .storage[1] = {.buf = sums, .read = true, .write = true},
    };
    issued = 0;
    bd_gpu_dispatch(gpu, compute_program("test/sum.comp"), &bindings, 2, 2, 1);
    return issued;
}

// Counts of 0: what is dispatched does nothing, its barriers are issued all the same.
static GLbitfield write_counts(struct bd_buf *counts)
{
    const uint32_t none[4] = {0};
    const struct bd_bindings bindings = {
        .storage[0] = {.buf = counts, .write = true},
        .uniforms[0] = {none, sizeof none},
    };
    issued = 0;
    bd_gpu_dispatch(gpu, compute_program("test/counts.comp"), &bindings, 1, 1, 1);
    return issued;
}

static GLbitfield dispatch_counted(const struct bd_buf *counts)
{
    const float offset = 0;
    const struct bd_bindings bindings = {
        .images[0] = {.tex = tex, .write = true},
        .uniforms[0] = {&offset, sizeof offset},
    };
    issued = 0;
    bd_gpu_dispatch_indirect(gpu, compute_program("test/fill.comp"), &bindings, counts, 8);
    return issued;
}

static GLbitfield read_storage(void)
{
    float value;
    issued = 0;
    assert_int_equal(bd_buf_read(gpu, sums, 0, &value, sizeof value), BD_ERR_OK);
    return issued;
}

static GLbitfield read_image(void)
{
    float texels[TEST_WIDTH * TEST_HEIGHT];
    issued = 0;
    read_tex(tex, 0, texels, sizeof texels);
    return issued;
}

static GLbitfield draw_into_image(void)
{
    const struct bd_target target = {.color[0].tex = tex};
    issued = 0;
    bd_gpu_target_begin(gpu, &target);
    bd_gpu_target_end(gpu);
    return issued;
}

static void each_use_waits_for_the_write_before_it(void **state)
{
    (void)state;
    assert_int_equal(fill_image(), 0); // nothing was written by a shader yet
    assert_int_equal(add_to_storage(), GL_TEXTURE_FETCH_BARRIER_BIT);
    assert_int_equal(add_to_storage(), GL_SHADER_STORAGE_BARRIER_BIT);
    // An image is written after it was sampled, and after it was written.
    assert_int_equal(fill_image(), GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
    assert_int_equal(fill_image(), GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
    assert_int_equal(read_storage(), GL_BUFFER_UPDATE_BARRIER_BIT);
    assert_int_equal(read_storage(), 0); // once is enough
    assert_int_equal(read_image(), GL_TEXTURE_UPDATE_BARRIER_BIT);
    assert_int_equal(draw_into_image(), GL_FRAMEBUFFER_BARRIER_BIT);
    assert_int_equal(draw_into_image(), 0);
}

static void what_the_api_wrote_needs_none(void **state)
{
    (void)state;
    const float zero[4] = {0};
    issued = 0;
    bd_tex_clear(gpu, tex, zero);
    bd_buf_clear(gpu, sums);
    assert_int_equal(add_to_storage(), 0);
    assert_int_equal(read_image(), 0);
}

static void counts_of_a_dispatch_wait_for_who_wrote_them(void **state)
{
    (void)state;
    struct bd_buf *counts = make_buf(5 * sizeof(uint32_t), NULL);
    assert_int_equal(dispatch_counted(counts), 0);
    assert_int_equal(write_counts(counts), 0);
    assert_int_equal(dispatch_counted(counts),
                     GL_COMMAND_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
    assert_int_equal(dispatch_counted(counts), GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
    bd_buf_clear(gpu, counts);
    bd_buf_destroy(gpu, &counts);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(each_use_waits_for_the_write_before_it, set_up, tear_down),
        cmocka_unit_test_setup_teardown(what_the_api_wrote_needs_none, set_up, tear_down),
        cmocka_unit_test_setup_teardown(counts_of_a_dispatch_wait_for_who_wrote_them, set_up,
                                        tear_down),
    };
    gpu_test_open();
    // Warm-up has barriers of its own: have it done with before recording.
    set_up(NULL);
    fill_image();
    add_to_storage();
    write_counts(sums);
    tear_down(NULL);
    PFNGLMEMORYBARRIERPROC real = epoxy_glMemoryBarrier;
    epoxy_glMemoryBarrier = record;
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    epoxy_glMemoryBarrier = real;
    return gpu_test_close(failed);
}
