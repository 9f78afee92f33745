// What passes share that run compute kernels: programs, bindings, slices of lists.
//
// Thread: render thread, context current.

#ifndef BD_PASS_KERNELS_H
#define BD_PASS_KERNELS_H

#include "pass/pass.h"

// Work-group size of kernels that walk a list, an item an invocation.
#define BD_LIST_GROUP 64u

uint32_t bd_divided_up(uint32_t n, uint32_t by);

// The program of one compute shader. `defines` may be NULL.
BD_MUST_CHECK
enum bd_err bd_compute_get(struct bd_gpu *gpu, const char *compute,
                           const struct bd_defines *defines, const struct bd_program **out,
                           struct bd_err_detail *detail);

void bd_bind_storage(struct bd_bindings *bindings, uint32_t unit, struct bd_buf *buf, bool read,
                     bool write);
// Nothing for a texture that is NULL.
void bd_bind_image(struct bd_bindings *bindings, uint32_t unit, struct bd_tex *tex, bool read,
                   bool write);

// How many of `left` items of a list fit into one slice and one dispatch, `units` each.
uint32_t bd_list_slice(struct bd_slicer *slicer, double units, uint32_t left);

#endif
