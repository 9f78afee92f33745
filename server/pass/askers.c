// Receivers that ask which VPLs they see, as shaders find them.

#include "pass/choose.h"

#include "kernel/lift.h"
#include "pass/f3_arrays.h"
#include "pass/kernels.h"
#include "shared/bindings.h"

void bd_askers_define(const struct bd_askers *askers, struct bd_defines *defines)
{
    if (askers->fragments) bd_define(defines, "BD_FRAGMENTS", 1);
    if (askers->lobes_alone) bd_define(defines, "BD_LOBES_ALONE", 1);
    if (askers->vector) bd_define(defines, "BD_VECTOR", 1);
}

size_t bd_askers_count(const struct bd_askers *askers, const struct bd_askers_slice *slice)
{
    return askers->fragments ? slice->count : (size_t)slice->tile.width * slice->tile.height;
}

uint64_t bd_askers_count_all(const struct bd_askers *askers)
{
    return askers->fragments ? askers->fragments->count
                             : (uint64_t)askers->viewpoint->width_px * askers->viewpoint->height_px;
}

float bd_askers_reach(const struct bd_askers *askers)
{
    if (!askers->viewpoint) return 0;
    const struct bd_view view = bd_viewpoint_uniform(askers->viewpoint, askers->space);
    return largest_coordinate(f3_from(&view.position));
}

struct bd_askers_slice bd_askers_of_list(uint32_t first, uint32_t count)
{
    return (struct bd_askers_slice){
        {0, 0, BD_ASKERS_ROW, bd_divided_up(count, BD_ASKERS_ROW)}, first, count};
}

static void bind_fragments(const struct bd_askers *askers, struct bd_bindings *bindings)
{
    bindings->textures[BD_UNIT_BLOCK_REPRESENTATIVE].tex = askers->discontinuity->representative;
    bindings->uniforms[BD_UNIFORM_MULTIRES].bytes = &askers->fragments->layout;
    bindings->uniforms[BD_UNIFORM_MULTIRES].size_bytes = sizeof askers->fragments->layout;
    bd_bind_storage(bindings, BD_STORAGE_FRAGMENTS, askers->fragments->list, true, false);
}

void bd_askers_bind(const struct bd_askers *askers, const struct bd_askers_slice *slice,
                    struct bd_asking *out)
{
    const struct bd_tile *tile = &slice->tile;
    *out = (struct bd_asking){
        .view = bd_viewpoint_uniform(askers->viewpoint, askers->space),
        .args.tile_x = tile->x,
        .args.tile_y = tile->y,
        .args.tile_width = tile->width,
        .args.tile_height = tile->height,
        .args.first_fragment = slice->first,
        .args.fragment_count = slice->count,
        .args.finest_level = askers->finest_level,
    };
    bd_gbuffer_bind(askers->gbuffer, &out->bindings);
    out->bindings.textures[BD_UNIT_GBUFFER_TRIANGLE].tex = askers->gbuffer->triangle;
    if (askers->fragments) bind_fragments(askers, &out->bindings);
}

void bd_askers_set_uniforms(struct bd_asking *asking)
{
    asking->bindings.uniforms[BD_UNIFORM_VIEW].bytes = &asking->view;
    asking->bindings.uniforms[BD_UNIFORM_VIEW].size_bytes = sizeof asking->view;
    asking->bindings.uniforms[BD_UNIFORM_ARGS].bytes = &asking->args;
    asking->bindings.uniforms[BD_UNIFORM_ARGS].size_bytes = sizeof asking->args;
}

void bd_askers_dispatch(struct bd_gpu *gpu, const struct bd_program *program,
                        struct bd_asking *asking)
{
    uint32_t group[3];
    bd_askers_set_uniforms(asking);
    bd_program_group_size(program, group);
    bd_gpu_dispatch(gpu, program, &asking->bindings,
                    bd_divided_up(asking->args.tile_width, group[0]),
                    bd_divided_up(asking->args.tile_height, group[1]), 1);
}
