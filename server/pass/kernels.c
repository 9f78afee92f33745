#include "pass/kernels.h"

#define GROUPS_MAX 65535u // of one dispatch

uint32_t bd_divided_up(uint32_t n, uint32_t by)
{
    return (n + by - 1) / by;
}

enum bd_err bd_compute_get(struct bd_gpu *gpu, const char *compute,
                           const struct bd_defines *defines, const struct bd_program **out,
                           struct bd_err_detail *detail)
{
    struct bd_program_source source = {.compute = compute};
    if (defines) source.defines = *defines;
    struct bd_program *program = NULL;
    enum bd_err err = bd_program_get(gpu, &source, &program, detail);
    *out = program;
    return err;
}

void bd_bind_storage(struct bd_bindings *bindings, uint32_t unit, struct bd_buf *buf, bool read,
                     bool write)
{
    bindings->storage[unit].buf = buf;
    bindings->storage[unit].read = read;
    bindings->storage[unit].write = write;
}

void bd_bind_image(struct bd_bindings *bindings, uint32_t unit, struct bd_tex *tex, bool read,
                   bool write)
{
    if (!tex) return;
    bindings->images[unit].tex = tex;
    bindings->images[unit].read = read;
    bindings->images[unit].write = write;
}

uint32_t bd_list_slice(struct bd_slicer *slicer, double units, uint32_t left)
{
    const uint32_t most = GROUPS_MAX * BD_LIST_GROUP;
    return bd_slicer_rows(slicer, units, left < most ? left : most);
}
