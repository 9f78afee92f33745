#include "pass/gbuffer.h"

#include <stdlib.h>

#include "base/assert.h"
#include "pass/scene_draws.h"
#include "shared/bindings.h"

struct gbuffer_texture {
    size_t offset; // of the member in struct bd_gbuffer
    const char *name;
    enum bd_format format;
};

// In the order of the fragment shader's outputs.
static const struct gbuffer_texture layout[] = {
    {offsetof(struct bd_gbuffer, depth), "gbuffer depth", BD_FORMAT_R32F},
    {offsetof(struct bd_gbuffer, normals), "gbuffer normals", BD_FORMAT_RGBA32UI},
    {offsetof(struct bd_gbuffer, albedo), "gbuffer albedo", BD_FORMAT_RGBA16},
    {offsetof(struct bd_gbuffer, material), "gbuffer material", BD_FORMAT_RGBA16},
    {offsetof(struct bd_gbuffer, triangle), "gbuffer triangle", BD_FORMAT_R32UI},
    {offsetof(struct bd_gbuffer, emission), "gbuffer emission", BD_FORMAT_RGBA32F},
};
#define LAYOUT_COUNT (sizeof layout / sizeof layout[0])

static struct bd_tex **texture_at(struct bd_gbuffer *gbuffer, size_t i)
{
    return (struct bd_tex **)((char *)gbuffer + layout[i].offset);
}

static enum bd_err create_textures(struct bd_gpu *gpu, const struct bd_gbuffer_inputs *inputs,
                                   struct bd_gbuffer *gbuffer, struct bd_target *target,
                                   struct bd_err_detail *detail)
{
    size_t count = inputs->emission ? LAYOUT_COUNT : LAYOUT_COUNT - 1;
    for (size_t i = 0; i < count; i++) {
        const struct bd_tex_desc desc = {
            .name = layout[i].name,
            .format = layout[i].format,
            .width_px = inputs->viewpoint->width_px,
            .height_px = inputs->viewpoint->height_px,
        };
        enum bd_err err = bd_tex_create(gpu, &desc, texture_at(gbuffer, i), detail);
        if (err) return err;
        target->color[i].tex = *texture_at(gbuffer, i);
    }
    return BD_ERR_OK;
}

static enum bd_err draw(const struct bd_pass_context *context,
                        const struct bd_gbuffer_inputs *inputs, const struct bd_target *target,
                        struct bd_err_detail *detail)
{
    const struct bd_scene_draws draws = {
        .scene = inputs->scene,
        .viewpoint = inputs->viewpoint,
        .fragment = "pass/gbuffer/gbuffer.frag",
        .surface = true,
        .emission = inputs->emission,
        .glass = inputs->glass,
        .cull_single_sided = true,
        .lambert = inputs->lambert,
        .tracer = inputs->tracer,
    };
    bd_gpu_target_begin(context->gpu, target);
    enum bd_err err = bd_scene_draws_record(context->gpu, &draws, context->slicer, detail);
    bd_gpu_target_end(context->gpu);
    return err;
}

enum bd_err bd_gbuffer_render(const struct bd_pass_context *context,
                              const struct bd_gbuffer_inputs *inputs, struct bd_gbuffer **out,
                              struct bd_err_detail *detail)
{
    struct bd_gbuffer *gbuffer = calloc(1, sizeof *gbuffer);
    BD_ASSERT(gbuffer);
    struct bd_target target = {0};
    const struct bd_tex_desc depth_desc = {
        .name = "gbuffer z",
        .format = BD_FORMAT_DEPTH32F,
        .width_px = inputs->viewpoint->width_px,
        .height_px = inputs->viewpoint->height_px,
    };
    enum bd_err err = create_textures(context->gpu, inputs, gbuffer, &target, detail);
    if (!err) err = bd_tex_create(context->gpu, &depth_desc, &target.depth.tex, detail);
    if (!err) err = draw(context, inputs, &target, detail);
    bd_tex_destroy(context->gpu, &target.depth.tex);
    if (err) {
        bd_gbuffer_destroy(context->gpu, &gbuffer);
        return err;
    }
    *out = gbuffer;
    return BD_ERR_OK;
}

void bd_gbuffer_destroy(struct bd_gpu *gpu, struct bd_gbuffer **gbuffer)
{
    if (!*gbuffer) return;
    for (size_t i = 0; i < LAYOUT_COUNT; i++) bd_tex_destroy(gpu, texture_at(*gbuffer, i));
    free(*gbuffer);
    *gbuffer = NULL;
}

uint64_t bd_gbuffer_bytes(const struct bd_gbuffer *gbuffer)
{
    uint64_t bytes = 0;
    for (size_t i = 0; i < LAYOUT_COUNT; i++) {
        const struct bd_tex *tex = *texture_at((struct bd_gbuffer *)gbuffer, i);
        if (tex) bytes += bd_tex_bytes(tex);
    }
    return bytes;
}

void bd_gbuffer_bind(const struct bd_gbuffer *gbuffer, struct bd_bindings *bindings)
{
    bindings->textures[BD_UNIT_GBUFFER_DEPTH].tex = gbuffer->depth;
    bindings->textures[BD_UNIT_GBUFFER_NORMALS].tex = gbuffer->normals;
    bindings->textures[BD_UNIT_GBUFFER_ALBEDO].tex = gbuffer->albedo;
    bindings->textures[BD_UNIT_GBUFFER_MATERIAL].tex = gbuffer->material;
}
