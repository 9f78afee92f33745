#include "gpu_test.h"

#include <stdio.h>
#include <stdlib.h>

struct bd_gpu *gpu;

void gpu_test_open(void)
{
    const char *device = getenv("BOUNCED_TEST_DEVICE");
    const struct bd_gpu_options options = {.device = device ? device : "auto", .debug = true};
    struct bd_err_detail detail = {0};
    if (bd_gpu_create(&options, &gpu, &detail)) {
        fprintf(stderr, "no device to test on: %s\n", detail.message);
        exit(77);
    }
    fprintf(stderr, "device: %s, class %s\n", bd_gpu_caps(gpu)->name,
            bd_gpu_caps(gpu)->device_class);
}

int gpu_test_close(int result)
{
    // A failed test leaves its resources behind, at which the device would abort.
    if (result) return result;
    enum bd_err err = bd_gpu_wait(gpu);
    if (err) fprintf(stderr, "stuck to the device: %s\n", bd_err_name(err));
    bd_gpu_destroy(&gpu);
    return err ? 1 : result;
}

struct bd_tex *make_tex(enum bd_format format, uint32_t width_px, uint32_t height_px,
                        uint32_t layer_count)
{
    const struct bd_tex_desc desc = {
        .name = "test",
        .format = format,
        .width_px = width_px,
        .height_px = height_px,
        .layer_count = layer_count,
    };
    struct bd_tex *tex;
    struct bd_err_detail detail = {0};
    if (bd_tex_create(gpu, &desc, &tex, &detail)) fail_msg("%s", detail.message);
    return tex;
}

struct bd_buf *make_buf(size_t size_bytes, const void *initial)
{
    struct bd_buf *buf;
    struct bd_err_detail detail = {0};
    if (bd_buf_create(gpu, "test", size_bytes, initial, &buf, &detail))
        fail_msg("%s", detail.message);
    return buf;
}

struct bd_program *compute_program(const char *name)
{
    const struct bd_program_source source = {.compute = name};
    struct bd_program *program;
    struct bd_err_detail detail = {0};
    if (bd_program_get(gpu, &source, &program, &detail)) fail_msg("%s", detail.message);
    return program;
}

struct bd_program *raster_program(const char *vertex, const char *fragment,
                                  const struct bd_defines *defines)
{
    struct bd_program_source source = {.vertex = vertex, .fragment = fragment};
    if (defines) source.defines = *defines;
    struct bd_program *program;
    struct bd_err_detail detail = {0};
    if (bd_program_get(gpu, &source, &program, &detail)) fail_msg("%s", detail.message);
    return program;
}

void read_tex(const struct bd_tex *tex, uint32_t layer, void *bytes, size_t size_bytes)
{
    struct bd_readback *readback;
    struct bd_err_detail detail = {0};
    if (bd_gpu_readback_start(gpu, tex, layer, &readback, &detail)) fail_msg("%s", detail.message);
    assert_int_equal(bd_gpu_readback_finish(gpu, &readback, bytes, size_bytes), BD_ERR_OK);
    assert_null(readback);
}
