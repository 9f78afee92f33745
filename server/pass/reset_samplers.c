#include "pass/reset_samplers.h"

#define UNIT_COUNT 8

static void dispatch(struct bd_gpu *gpu, const struct bd_program *program, struct bd_tex *tex,
                     struct bd_buf *buf)
{
    struct bd_bindings bindings = {0}; // nearest, repeat: what every pass fetches its inputs with
    for (int unit = 0; unit < UNIT_COUNT; unit++) bindings.textures[unit].tex = tex;
    bindings.storage[0].buf = buf;
    bindings.storage[0].write = true;
    bd_gpu_dispatch(gpu, program, &bindings, 1, 1, 1);
}

void bd_reset_samplers(struct bd_gpu *gpu)
{
    if (!bd_gpu_caps(gpu)->software) return;
    const struct bd_program_source source = {.compute = "pass/reset_samplers/reset_samplers.comp"};
    const struct bd_tex_desc desc = {
        .name = "reset_samplers", .format = BD_FORMAT_RGBA32F, .width_px = 1, .height_px = 1};
    struct bd_program *program;
    struct bd_tex *tex = NULL;
    struct bd_buf *buf = NULL;
    if (bd_program_get(gpu, &source, &program, NULL)) return;
    if (!bd_tex_create(gpu, &desc, &tex, NULL) &&
        !bd_buf_create(gpu, "reset_samplers", 16, NULL, &buf, NULL)) {
        bd_tex_clear(gpu, tex, (const float[4]){0});
        dispatch(gpu, program, tex, buf);
    }
    bd_buf_destroy(gpu, &buf);
    bd_tex_destroy(gpu, &tex);
}
