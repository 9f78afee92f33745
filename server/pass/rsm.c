#include "pass/rsm.h"

#include <stdlib.h>

#include "base/assert.h"
#include "pass/rsm_weights.h"
#include "pass/scene_draws.h"

static enum bd_err create_array(struct bd_gpu *gpu, const char *name, enum bd_format format,
                                uint32_t side_px, uint32_t layer_count, struct bd_tex **out,
                                struct bd_err_detail *detail)
{
    const struct bd_tex_desc desc = {
        .name = name,
        .format = format,
        .width_px = side_px,
        .height_px = side_px,
        .layer_count = layer_count,
    };
    return bd_tex_create(gpu, &desc, out, detail);
}

static enum bd_err create_textures(struct bd_gpu *gpu, struct bd_rsm *rsm,
                                   struct bd_err_detail *detail)
{
    uint32_t side = rsm->side_px, faces = rsm->face_count;
    enum bd_err err =
        create_array(gpu, "rsm position", BD_FORMAT_RGBA32F, side, faces, &rsm->position, detail);
    if (!err)
        err =
            create_array(gpu, "rsm normals", BD_FORMAT_RG32UI, side, faces, &rsm->normals, detail);
    if (!err)
        err = create_array(gpu, "rsm albedo", BD_FORMAT_RGBA16, side, faces, &rsm->albedo, detail);
    return err;
}

// --- weights --------------------------------------------------------------------------------

static enum bd_err upload_weights(struct bd_gpu *gpu, const struct bd_rsm_weights *weights,
                                  struct bd_tex **out, struct bd_err_detail *detail)
{
    enum bd_err err = create_array(gpu, "rsm weight", BD_FORMAT_RG32F, weights->side_px,
                                   weights->layer_count, out, detail);
    size_t layer_floats = (size_t)weights->side_px * weights->side_px * 2;
    for (uint32_t layer = 0; !err && layer < weights->layer_count; layer++)
        bd_tex_upload(gpu, *out, layer, weights->values + layer_floats * layer,
                      layer_floats * sizeof(float));
    return err;
}

enum bd_err bd_rsm_weight_map_create(const struct bd_pass_context *context,
                                     const struct bd_rsm_inputs *inputs,
                                     struct bd_rsm_weight_map **out, struct bd_err_detail *detail)
{
    struct bd_gpu *gpu = context->gpu;
    struct bd_rsm_weights weights;
    *out = NULL;
    enum bd_err err =
        bd_rsm_weights_create(inputs->light, inputs->scene->space.render_per_m, inputs->side_px,
                              inputs->paper_mode, context->slicer, &weights);
    if (err) return err;
    struct bd_rsm_weight_map *map = calloc(1, sizeof *map);
    BD_ASSERT(map);
    *map = (struct bd_rsm_weight_map){.layer_count = weights.layer_count, .owner_count = 1};
    err = upload_weights(gpu, &weights, &map->tex, detail);
    bd_rsm_weights_destroy(&weights);
    if (err) bd_rsm_weight_map_release(gpu, &map);
    *out = map;
    return err;
}

void bd_rsm_weight_map_release(struct bd_gpu *gpu, struct bd_rsm_weight_map **map)
{
    struct bd_rsm_weight_map *m = *map;
    *map = NULL;
    if (!m || --m->owner_count > 0) return;
    bd_tex_destroy(gpu, &m->tex);
    free(m);
}

static enum bd_err take_weights(const struct bd_pass_context *context,
                                const struct bd_rsm_inputs *inputs, struct bd_rsm *rsm,
                                struct bd_err_detail *detail)
{
    if (!inputs->weights) return bd_rsm_weight_map_create(context, inputs, &rsm->weights, detail);
    rsm->weights = inputs->weights;
    rsm->weights->owner_count++;
    return BD_ERR_OK;
}

// --- the map --------------------------------------------------------------------------------

static enum bd_err draw_face(const struct bd_pass_context *context,
                             const struct bd_rsm_inputs *inputs, struct bd_rsm *rsm,
                             struct bd_tex *depth, uint32_t face, struct bd_err_detail *detail)
{
    const struct bd_viewpoint viewpoint =
        bd_light_setup_viewpoint(inputs->light, face, inputs->side_px);
    const struct bd_scene_draws draws = {
        .scene = inputs->scene,
        .viewpoint = &viewpoint,
        .fragment = "pass/rsm/rsm.frag",
        .surface = true,
        .lambert = inputs->lambert,
        .tracer = inputs->tracer,
    };
    const struct bd_target target = {
        .color = {{rsm->position, face}, {rsm->normals, face}, {rsm->albedo, face}},
        .depth = {depth, 0},
    };
    bd_gpu_target_begin(context->gpu, &target);
    enum bd_err err = bd_scene_draws_record(context->gpu, &draws, context->slicer, detail);
    bd_gpu_target_end(context->gpu);
    return err;
}

enum bd_err bd_rsm_render(const struct bd_pass_context *context, const struct bd_rsm_inputs *inputs,
                          struct bd_rsm **out, struct bd_err_detail *detail)
{
    struct bd_rsm *rsm = calloc(1, sizeof *rsm);
    BD_ASSERT(rsm);
    rsm->side_px = inputs->side_px;
    rsm->face_count = inputs->light->face_count;
    const struct bd_tex_desc depth_desc = {
        .name = "rsm z",
        .format = BD_FORMAT_DEPTH32F,
        .width_px = inputs->side_px,
        .height_px = inputs->side_px,
    };
    struct bd_tex *depth = NULL;
    enum bd_err err = create_textures(context->gpu, rsm, detail);
    if (!err) err = take_weights(context, inputs, rsm, detail);
    if (!err) err = bd_tex_create(context->gpu, &depth_desc, &depth, detail);
    for (uint32_t face = 0; !err && face < rsm->face_count; face++)
        err = draw_face(context, inputs, rsm, depth, face, detail);
    bd_tex_destroy(context->gpu, &depth);
    if (err) {
        bd_rsm_destroy(context->gpu, &rsm);
        return err;
    }
    *out = rsm;
    return BD_ERR_OK;
}

void bd_rsm_destroy(struct bd_gpu *gpu, struct bd_rsm **rsm)
{
    if (!*rsm) return;
    bd_tex_destroy(gpu, &(*rsm)->position);
    bd_tex_destroy(gpu, &(*rsm)->normals);
    bd_tex_destroy(gpu, &(*rsm)->albedo);
    bd_rsm_weight_map_release(gpu, &(*rsm)->weights);
    free(*rsm);
    *rsm = NULL;
}

uint64_t bd_rsm_bytes(const struct bd_rsm *rsm)
{
    return bd_tex_bytes(rsm->position) + bd_tex_bytes(rsm->normals) + bd_tex_bytes(rsm->albedo);
}
