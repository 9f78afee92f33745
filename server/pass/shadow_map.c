#include "pass/shadow_map.h"

#include <stdlib.h>

#include "base/assert.h"
#include "base/huge_pages.h"
#include "pass/scene_draws.h"
#include "pass/scene_material.h"

static enum bd_err create_ids(struct bd_gpu *gpu, uint32_t side_px, uint32_t face_count,
                              struct bd_tex **ids, struct bd_err_detail *detail)
{
    const struct bd_tex_desc desc = {
        .name = "shadow ids",
        .format = BD_FORMAT_R32UI,
        .width_px = side_px,
        .height_px = side_px,
        .layer_count = face_count,
    };
    return bd_tex_create(gpu, &desc, ids, detail);
}

static enum bd_err draw_face(const struct bd_pass_context *context,
                             const struct bd_gpu_scene *scene, const struct bd_viewpoint *viewpoint,
                             const struct bd_target *target, struct bd_err_detail *detail)
{
    const struct bd_scene_draws draws = {
        .scene = scene,
        .viewpoint = viewpoint,
        .fragment = "pass/shadow_map/shadow_map.frag",
    };
    bd_gpu_target_begin(context->gpu, target);
    enum bd_err err = bd_scene_draws_record(context->gpu, &draws, context->slicer, detail);
    bd_gpu_target_end(context->gpu);
    return err;
}

// --- by rays ----------------------------------------------------------------------------------

#define ROWS_PER_PIECE 64u
#define MASKED         (UINT32_C(1) << 31)

static uint32_t id_of(const struct bd_gpu_scene *scene, uint32_t number)
{
    if (number == BD_NO_TRIANGLE) return 0;
    const struct bd_features *features = &scene->scene->features;
    if (!features->has_mask && !features->has_blend) return number + 1;
    const uint32_t run = bd_triangle_order_run(&scene->order, number);
    return (number + 1) | (bd_material_has_holes(scene->draws[run].material) ? MASKED : 0);
}

static enum bd_err send_rows(const struct bd_pass_context *context,
                             const struct bd_gpu_scene *scene, uint32_t *numbers, uint32_t side_px,
                             struct bd_tex *to, uint32_t face)
{
    enum bd_err err = BD_ERR_OK;
    for (uint32_t row = 0; !err && row < side_px; row += ROWS_PER_PIECE) {
        const uint32_t left = side_px - row, rows = left < ROWS_PER_PIECE ? left : ROWS_PER_PIECE;
        uint32_t *ids = numbers + (size_t)row * side_px;
        const size_t count = (size_t)rows * side_px;
        for (size_t i = 0; i < count; i++) ids[i] = id_of(scene, ids[i]);
        bd_tex_upload_rows(context->gpu, to, face, row, rows, ids, count * sizeof *ids);
        err = bd_slicer_pause(context->slicer);
    }
    return err;
}

static enum bd_err trace_faces(const struct bd_pass_context *context,
                               const struct bd_gpu_scene *scene, const struct bd_light_setup *light,
                               const struct bd_tracer *tracer, struct bd_shadow_map *map,
                               struct bd_err_detail *detail)
{
    const uint32_t side = map->side_px;
    uint32_t *numbers = bd_huge_pages_alloc((size_t)side * side * sizeof *numbers);
    if (!numbers)
        return bd_err_set(detail, BD_ERR_NO_MEMORY, "shadow_size",
                          "no memory for what %u x %u texels see", side, side);
    enum bd_err err = BD_ERR_OK;
    for (uint32_t face = 0; !err && face < light->face_count; face++) {
        const struct bd_viewpoint viewpoint = bd_light_setup_viewpoint(light, face, side);
        err = bd_first_hits(tracer, &viewpoint, &scene->space, false, context->slicer, numbers);
        if (!err) err = send_rows(context, scene, numbers, side, map->ids, face);
    }
    free(numbers);
    return err;
}

// --- by drawing -------------------------------------------------------------------------------

static enum bd_err draw_faces(const struct bd_pass_context *context,
                              const struct bd_gpu_scene *scene, const struct bd_light_setup *light,
                              struct bd_shadow_map *map, struct bd_err_detail *detail)
{
    const struct bd_tex_desc depth_desc = {
        .name = "shadow z",
        .format = BD_FORMAT_DEPTH32F,
        .width_px = map->side_px,
        .height_px = map->side_px,
    };
    struct bd_tex *depth = NULL;
    enum bd_err err = bd_tex_create(context->gpu, &depth_desc, &depth, detail);
    for (uint32_t face = 0; !err && face < light->face_count; face++) {
        const struct bd_viewpoint viewpoint = bd_light_setup_viewpoint(light, face, map->side_px);
        const struct bd_target target = {
            .color = {{map->ids, face}},
            .depth = {depth, 0},
        };
        err = draw_face(context, scene, &viewpoint, &target, detail);
    }
    bd_tex_destroy(context->gpu, &depth);
    return err;
}

enum bd_err bd_shadow_map_render(const struct bd_pass_context *context,
                                 const struct bd_gpu_scene *scene,
                                 const struct bd_light_setup *light, uint32_t side_px,
                                 const struct bd_tracer *tracer, struct bd_shadow_map **out,
                                 struct bd_err_detail *detail)
{
    struct bd_shadow_map *map = calloc(1, sizeof *map);
    BD_ASSERT(map);
    map->side_px = side_px;
    enum bd_err err = create_ids(context->gpu, side_px, light->face_count, &map->ids, detail);
    if (!err && tracer) err = trace_faces(context, scene, light, tracer, map, detail);
    if (!err && !tracer) err = draw_faces(context, scene, light, map, detail);
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
