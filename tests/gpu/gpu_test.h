// What the device tests share: one device for the whole executable, and small helpers.

#ifndef BD_TESTS_GPU_TEST_H
#define BD_TESTS_GPU_TEST_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "gpu/gpu.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

// Opens the device that $BOUNCED_TEST_DEVICE names, by default `auto`. Ends the process with 77,
// "skipped", if this machine has none. Every message of the driver is an error.
void gpu_test_open(void);
// Ends the device; returns its argument if nothing stuck to it, else 1.
int gpu_test_close(int result);
extern struct bd_gpu *gpu;

struct bd_tex *make_tex(enum bd_format format, uint32_t width_px, uint32_t height_px,
                        uint32_t layer_count);
struct bd_buf *make_buf(size_t size_bytes, const void *initial);
struct bd_program *compute_program(const char *name);
struct bd_program *raster_program(const char *vertex, const char *fragment,
                                  const struct bd_defines *defines);
void read_tex(const struct bd_tex *tex, uint32_t layer, void *bytes, size_t size_bytes);

#endif
