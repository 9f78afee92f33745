#include "pass/shadow_map.h"

#include <stdlib.h>

#include "base/assert.h"
#include "pass/scene_draws.h"

static enum bd_err create_textures(struct bd_gpu *gpu, uint32_t side_px, uint32_t face_count,
                                   struct bd_tex **ids, struct bd_tex **depth,
                                   struct bd_fault *fault)
{
    const struct bd_tex_desc ids_desc = {
        .name = "shadow ids",
        .format = BD_FORMAT_R32UI,
        .width_px = side_px,
        .height_px = side_px,
        .layer_count = face_count,
    };
    const struct bd_tex_desc depth_desc = {
        .name = "shadow z",
        .format = BD_FORMAT_DEPTH32F,
        .width_px = side_px,
        .height_px = side_px,
    };
    enum bd_err err = bd_tex_create(gpu, &ids_desc, ids, fault);
    return err ? err : bd_tex_create(gpu, &depth_desc, depth, fault);
}

static enum bd_err draw_face(const struct bd_pass_context *context,
                             const struct bd_gpu_scene *scene, const struct bd_viewpoint *viewpoint,
                             const struct bd_target *target, struct bd_fault *fault)
{
    const struct bd_scene_draws draws = {
        .scene = scene,
        .viewpoint = viewpoint,
        .fragment = "pass/shadow_map/shadow_map.frag",
    };
    bd_gpu_target_begin(context->gpu, target);
    enum bd_err err = bd_scene_draws_record(context->gpu, &draws, context->slicer, fault);
    bd_gpu_target_end(context->gpu);
    return err;
}

enum bd_err bd_shadow_map_render(const struct bd_pass_context *context,
                                 const struct bd_gpu_scene *scene,
                                 const struct bd_light_setup *light, uint32_t side_px,
                                 struct bd_shadow_map **out, struct bd_fault *fault)
{
    struct bd_shadow_map *map = calloc(1, sizeof *map);
    BD_ASSERT(map);
    map->side_px = side_px;
    struct bd_tex *depth = NULL;
    enum bd_err err =
        create_textures(context->gpu, side_px, light->face_count, &map->ids, &depth, fault);
    for (uint32_t face = 0; !err && face < light->face_count; face++) {
        const struct bd_viewpoint viewpoint = bd_light_setup_viewpoint(light, face, side_px);
        const struct bd_target target = {
            .color = {{map->ids, face}},
            .depth = {depth, 0},
        };
        err = draw_face(context, scene, &viewpoint, &target, fault);
    }
    bd_tex_destroy(context->gpu, &depth);
    if (err) {
        bd_shadow_map_destroy(context->gpu, &map);
        return err;
    }
    *out = map;
    return BD_ERR_OK;
}

void bd_shadow_map_destroy(struct bd_gpu *gpu, struct bd_shadow_map **map)
{
    if (!*map) return;
    bd_tex_destroy(gpu, &(*map)->ids);
    free(*map);
    *map = NULL;
}

uint64_t bd_shadow_map_bytes(const struct bd_shadow_map *map)
{
    return bd_tex_bytes(map->ids);
}
