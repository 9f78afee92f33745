#include "pass/choose.h"

#include "base/assert.h"
#include "shared/bindings.h"
#include "shared/choose.h"

static uint32_t words_of(uint32_t vpl_count)
{
    return (vpl_count + 31) / 32;
}

uint32_t bd_choose_all_pixels_max(uint32_t vpl_count)
{
    const size_t of_pixel = 32 * (size_t)words_of(vpl_count) * sizeof(struct bd_segment);
    return (uint32_t)(BD_SEGMENTS_BYTES_MAX / of_pixel);
}

enum bd_err bd_choose_all(const struct bd_pass_context *context,
                          const struct bd_choose_inputs *inputs, const struct bd_tile *tile,
                          uint32_t first_vpl, uint32_t vpl_count, struct bd_segments *segments,
                          struct bd_fault *fault)
{
    struct bd_program_source source = {.compute = "pass/choose/all.comp"};
    if (inputs->near_patches) bd_define(&source.defines, "BD_VPL_PATCH", 1);
    struct bd_program *program;
    enum bd_err err = bd_program_get(context->gpu, &source, &program, fault);
    if (err) return err;
    const struct bd_choose_args args = {
        .tile = {tile->x, tile->y, tile->width, tile->height},
        .vpls = {first_vpl, vpl_count, words_of(vpl_count), 0},
    };
    BD_ASSERT_CMP((size_t)tile->width * tile->height, <=, bd_choose_all_pixels_max(vpl_count));
    struct bd_bindings bindings = {0};
    bd_gbuffer_bind(inputs->gbuffer, &bindings);
    bindings.textures[BD_UNIT_GBUFFER_TRIANGLE].tex = inputs->gbuffer->triangle;
    bindings.arrays[BD_UNIT_VPLS] = inputs->list->vpls;
    bindings.arrays[BD_UNIT_VPL_QUADS] = inputs->list->quads;
    bindings.storage[BD_STORAGE_SEGMENTS].buf = segments->segments;
    bindings.storage[BD_STORAGE_SEGMENTS].write = true;
    bindings.uniforms[BD_UNIFORM_VIEW].bytes = inputs->view;
    bindings.uniforms[BD_UNIFORM_VIEW].size_bytes = sizeof *inputs->view;
    bindings.uniforms[BD_UNIFORM_ARGS].bytes = &args;
    bindings.uniforms[BD_UNIFORM_ARGS].size_bytes = sizeof args;
    uint32_t group[3];
    bd_program_group_size(program, group);
    bd_gpu_dispatch(context->gpu, program, &bindings, (tile->width + group[0] - 1) / group[0],
                    (tile->height + group[1] - 1) / group[1], 1);
    return BD_ERR_OK;
}
