#include "kernel.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

static struct bd_buf *create_buf(struct bd_gpu *gpu, size_t size_bytes, const void *initial)
{
    struct bd_buf *buf;
    struct bd_err_detail detail = {0};
    if (bd_buf_create(gpu, "test", size_bytes, initial, &buf, &detail))
        fail_msg("%s", detail.message);
    return buf;
}

void kernel_run(struct bd_gpu *gpu, const char *compute, uint32_t groups, const void *in,
                size_t in_bytes, void *out, size_t out_bytes)
{
    const struct bd_program_source source = {.compute = compute};
    struct bd_program *program;
    struct bd_err_detail detail = {0};
    if (bd_program_get(gpu, &source, &program, &detail)) fail_msg("%s", detail.message);
    struct bd_buf *in_buf = create_buf(gpu, in_bytes, in);
    struct bd_buf *out_buf = create_buf(gpu, out_bytes, NULL);
    const struct bd_bindings bindings = {
        .storage[0] = {.buf = in_buf, .read = true},
        .storage[1] = {.buf = out_buf, .write = true},
    };
    bd_gpu_dispatch(gpu, program, &bindings, groups, 1, 1);
    assert_int_equal(bd_buf_read(gpu, out_buf, 0, out, out_bytes), BD_ERR_OK);
    bd_buf_destroy(gpu, &in_buf);
    bd_buf_destroy(gpu, &out_buf);
}

int kernel_open_device(void **state)
{
    const struct bd_gpu_options options = {.device = "auto", .debug = true};
    struct bd_err_detail detail = {0};
    if (bd_gpu_create(&options, (struct bd_gpu **)state, &detail)) {
        fprintf(stderr, "skipped: %s\n", detail.message);
        exit(77);
    }
    return 0;
}

int kernel_close_device(void **state)
{
    bd_gpu_destroy((struct bd_gpu **)state);
    return 0;
}
