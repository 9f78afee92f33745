// A function of shaders/common by itself: a kernel of tests/analytic/shaders, one buffer in, one
// out.

#ifndef BD_TESTS_ANALYTIC_KERNEL_H
#define BD_TESTS_ANALYTIC_KERNEL_H

#include <stddef.h>
#include <stdint.h>

#include "gpu/gpu.h"

// Group setup and teardown for cmocka; `*state` is the struct bd_gpu. Leaves with 77 where there is
// no device.
int kernel_open_device(void **state);
int kernel_close_device(void **state);

// Storage 0 is `in`, storage 1 is `out`. Fails the test if anything goes wrong.
void kernel_run(struct bd_gpu *gpu, const char *compute, uint32_t groups, const void *in,
                size_t in_bytes, void *out, size_t out_bytes);

#endif
