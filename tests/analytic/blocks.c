#include "blocks.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "shared/vpl.h"

// --- textures -----------------------------------------------------------------------------------

static struct bd_tex *make_tex(struct bd_gpu *gpu, enum bd_format format, uint32_t width_px,
                               uint32_t height_px, const void *texels, size_t size_bytes)
{
    struct bd_tex *tex;
    struct bd_err_detail detail = {0};
    const struct bd_tex_desc desc = {
        .name = "test", .format = format, .width_px = width_px, .height_px = height_px};
    if (bd_tex_create(gpu, &desc, &tex, &detail)) fail_msg("%s", detail.message);
    bd_tex_upload(gpu, tex, 0, texels, size_bytes);
    return tex;
}

static struct bd_buf *make_buf(struct bd_gpu *gpu, size_t size_bytes, const void *initial)
{
    struct bd_buf *buf;
    struct bd_err_detail detail = {0};
    if (bd_buf_create(gpu, "test", size_bytes, initial, &buf, &detail))
        fail_msg("%s", detail.message);
    return buf;
}

float *blocks_texels(struct bd_gpu *gpu, const struct bd_tex *tex)
{
    const struct bd_tex_desc *desc = bd_tex_desc(tex);
    size_t size_bytes = (size_t)desc->width_px * desc->height_px * 4 * sizeof(float);
    float *texels = malloc(size_bytes);
    struct bd_readback *readback;
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_gpu_readback_start(gpu, tex, 0, &readback, &detail), BD_ERR_OK);
    assert_int_equal(bd_gpu_readback_finish(gpu, &readback, texels, size_bytes), BD_ERR_OK);
    return texels;
}

// --- the picture --------------------------------------------------------------------------------

static bool is_lit(const struct blocks_scene *scene, uint32_t x, uint32_t y)
{
    return !scene->lit || scene->lit(x, y);
}

static void octahedral(const double n[3], float out[2])
{
    double sum = fabs(n[0]) + fabs(n[1]) + fabs(n[2]);
    for (int a = 0; a < 2; a++) out[a] = (float)(n[a] / sum);
}

static void make_gbuffer(struct bd_gpu *gpu, const struct blocks_scene *scene,
                         struct bd_gbuffer *out)
{
    uint32_t width = scene->width_px, height = scene->height_px;
    size_t count = (size_t)width * height;
    float *depth = calloc(count, sizeof *depth), (*normals)[4] = calloc(count, sizeof *normals);
    uint16_t(*material)[4] = calloc(count, sizeof *material);
    for (size_t i = 0; i < count; i++) {
        uint32_t x = (uint32_t)(i % width), y = (uint32_t)(i / width);
        if (!is_lit(scene, x, y)) continue;
        double n[3] = {0, 0, 1};
        const double up[3] = {0, 0, 1};
        if (scene->normal) scene->normal(x, y, n);
        depth[i] = (float)(1 - (scene->height ? scene->height(x, y) : 0));
        octahedral(n, normals[i]);
        octahedral(up, normals[i] + 2);
        material[i][0] = material[i][3] = 65535;
    }
    out->depth = make_tex(gpu, BD_FORMAT_R32F, width, height, depth, count * sizeof *depth);
    out->normals =
        make_tex(gpu, BD_FORMAT_RGBA32UI, width, height, normals, count * sizeof *normals);
    out->albedo =
        make_tex(gpu, BD_FORMAT_RGBA16, width, height, material, count * sizeof *material);
    out->material =
        make_tex(gpu, BD_FORMAT_RGBA16, width, height, material, count * sizeof *material);
    free(depth), free(normals), free(material);
}

static struct bd_viewpoint look_down(const struct blocks_scene *scene)
{
    return (struct bd_viewpoint){
        .position_m = {0, 0, 1},
        .axis_x = {1, 0, 0},
        .axis_y = {0, 1, 0},
        .axis_z = {0, 0, 1},
        .orthographic = true,
        .half_width = 1,
        .half_height = 1,
        .far_m = 2,
        .width_px = scene->width_px,
        .height_px = scene->height_px,
        .sample_x_px = 0.5,
        .sample_y_px = 0.5,
    };
}

// --- blocks -------------------------------------------------------------------------------------

void blocks_pixels(uint32_t level, uint32_t at, uint32_t side_px, uint32_t *first, uint32_t *last)
{
    uint32_t end = (at + 1) << level;
    *first = at << level;
    *last = (end < side_px ? end : side_px) - 1;
}

struct block {
    uint32_t flags, representative;
};

static struct block look_at(const struct blocks_scene *scene, uint32_t level, uint32_t bx,
                            uint32_t by)
{
    uint32_t x0, x1, y0, y1;
    blocks_pixels(level, bx, scene->width_px, &x0, &x1);
    blocks_pixels(level, by, scene->height_px, &y0, &y1);
    struct block block = {BD_BLOCK_EMPTY, 0};
    double nearest = INFINITY;
    for (uint32_t y = y0; y <= y1; y++) {
        for (uint32_t x = x0; x <= x1; x++) {
            if (!is_lit(scene, x, y)) continue;
            bool jumps = scene->discontinuous && scene->discontinuous(x, y);
            if (jumps || block.flags == BD_BLOCK_EMPTY)
                block.flags = jumps ? BD_BLOCK_DISCONTINUOUS : BD_BLOCK_SMOOTH;
            double far = hypot(x - 0.5 * (x0 + x1), y - 0.5 * (y0 + y1));
            if (far >= nearest) continue;
            nearest = far;
            block.representative = BD_PIXEL_PACK(x, y);
        }
    }
    return block;
}

size_t blocks_texel(const struct blocks *blocks, uint32_t level, uint32_t x, uint32_t y)
{
    const struct bd_multires_layout *layout = &blocks->fragments.layout;
    uint32_t wide, high;
    bd_multires_stack_size(layout, &wide, &high);
    return level ? (size_t)(y + layout->levels[level].first_row) * wide + x
                 : (size_t)y * layout->width_px + x;
}

// With a bit for each child that holds something lit.
static uint32_t word_of(const struct blocks_scene *scene, const struct bd_multires_layout *layout,
                        uint32_t k, uint32_t x, uint32_t y, uint32_t kind)
{
    uint32_t word = kind;
    for (uint32_t i = 0; i < 4; i++) {
        uint32_t cx = 2 * x + i % 2, cy = 2 * y + i / 2;
        if (cx >= layout->levels[k - 1].columns || cy >= layout->levels[k - 1].rows) continue;
        if (look_at(scene, k - 1, cx, cy).flags != BD_BLOCK_EMPTY) word |= BD_BLOCK_WITH_CHILD(i);
    }
    return word;
}

static void make_discontinuity(const struct blocks_scene *scene, struct blocks *out)
{
    const struct bd_multires_layout *layout = &out->fragments.layout;
    uint32_t wide, high;
    bd_multires_stack_size(layout, &wide, &high);
    uint32_t *flags = calloc((size_t)wide * high, sizeof *flags);
    uint32_t *pixels = calloc((size_t)wide * high, sizeof *pixels);
    for (uint32_t k = 1; k < layout->level_count; k++) {
        for (uint32_t y = 0; y < layout->levels[k].rows; y++) {
            for (uint32_t x = 0; x < layout->levels[k].columns; x++) {
                struct block block = look_at(scene, k, x, y);
                flags[blocks_texel(out, k, x, y)] = word_of(scene, layout, k, x, y, block.flags);
                pixels[blocks_texel(out, k, x, y)] = block.representative;
            }
        }
    }
    size_t size_bytes = (size_t)wide * high * sizeof *flags;
    out->discontinuity.layout = *layout;
    out->discontinuity.flags = make_tex(out->gpu, BD_FORMAT_R32UI, wide, high, flags, size_bytes);
    out->discontinuity.representative =
        make_tex(out->gpu, BD_FORMAT_R32UI, wide, high, pixels, size_bytes);
    free(flags), free(pixels);
}

static bool is_fragment(const struct blocks_scene *scene, const struct bd_multires_layout *layout,
                        uint32_t k, uint32_t x, uint32_t y)
{
    uint32_t own = look_at(scene, k, x, y).flags;
    if (own == BD_BLOCK_EMPTY || (k > 0 && own == BD_BLOCK_DISCONTINUOUS)) return false;
    if (k + 1 == layout->level_count) return true;
    return look_at(scene, k + 1, x / 2, y / 2).flags == BD_BLOCK_DISCONTINUOUS;
}

static uint32_t tile_count(struct bd_multires_level level)
{
    return (level.columns + 7) / 8 * ((level.rows + 7) / 8);
}

// A bit for each block: tiles of 8 x 8 from the coarsest level on, four rows of one in a word.
static void make_masks(struct blocks *out)
{
    struct bd_fragments *f = &out->fragments;
    uint32_t tiles_before[BD_MULTIRES_LEVEL_MAX], tiles = 0;
    for (uint32_t k = f->layout.level_count; k-- > 0;) {
        tiles_before[k] = tiles;
        tiles += tile_count(f->layout.levels[k]);
    }
    uint32_t *masks = calloc(2 * (size_t)tiles, sizeof *masks);
    for (uint32_t i = 0; i < f->count; i++) {
        uint32_t k = BD_FRAGMENT_LEVEL(out->list[i]);
        uint32_t x = BD_FRAGMENT_X(out->list[i]), y = BD_FRAGMENT_Y(out->list[i]);
        uint32_t tile = tiles_before[k] + y / 8 * ((f->layout.levels[k].columns + 7) / 8) + x / 8;
        masks[2 * tile + y % 8 / 4] |= 1u << (y % 4 * 8 + x % 8);
    }
    f->masks = make_buf(out->gpu, 2 * (size_t)tiles * sizeof *masks, masks);
    free(masks);
}

static void make_fragments(const struct blocks_scene *scene, struct blocks *out)
{
    struct bd_fragments *f = &out->fragments;
    out->list = calloc(bd_multires_block_count(&f->layout), sizeof *out->list);
    for (uint32_t k = f->layout.level_count; k-- > 0;) {
        f->level_first[k] = f->count;
        for (uint32_t y = 0; y < f->layout.levels[k].rows; y++)
            for (uint32_t x = 0; x < f->layout.levels[k].columns; x++)
                if (is_fragment(scene, &f->layout, k, x, y))
                    out->list[f->count++] = BD_FRAGMENT_PACK(k, x, y);
        f->level_count[k] = f->count - f->level_first[k];
    }
    assert_true(f->count > 0);
    f->list = make_buf(out->gpu, f->count * sizeof *out->list, out->list);
    make_masks(out);
}

// In a plane above the picture, facing it; more of them than one dispatch sums.
static void make_vpls(uint32_t count, struct blocks *out)
{
    float(*vpls)[BD_VPL_VEC4S][4] = calloc(count, sizeof *vpls);
    float(*quads)[BD_VPL_QUAD_VEC4S][4] = calloc(count, sizeof *quads);
    for (uint32_t i = 0; i < count; i++) {
        double turn = 2.399963 * i, far = sqrt((i + 0.5) / count);
        const float at[3][4] = {
            {(float)(far * cos(turn)), (float)(far * sin(turn)), 0.4f, 1e-3f},
            {0.6f, 0, -0.8f, 0},
            {1.0f / (float)count, 0.5f / (float)count, 0.25f / (float)count, 0},
        };
        memcpy(vpls[i], at, sizeof at);
    }
    out->vpls = (struct bd_vpl_list){
        .vpls = make_buf(out->gpu, count * sizeof *vpls, vpls),
        .quads = make_buf(out->gpu, count * sizeof *quads, quads),
        .count = count,
    };
    out->lists[0] = &out->vpls;
    free(vpls), free(quads);
}

void blocks_create(struct bd_gpu *gpu, const struct blocks_scene *scene, struct blocks *out)
{
    *out = (struct blocks){
        .gpu = gpu,
        .scene.space = {.render_per_m = 1, .unit_cd_m2 = 1, .radius = 1},
        .viewpoint = look_down(scene),
        .fragments.layout =
            bd_multires_layout_of(scene->width_px, scene->height_px, scene->coarsest_side),
    };
    bd_slicer_init(&out->slicer, gpu, NULL, NULL);
    out->context = (struct bd_pass_context){.gpu = gpu, .slicer = &out->slicer};
    make_gbuffer(gpu, scene, &out->gbuffer);
    make_discontinuity(scene, out);
    make_fragments(scene, out);
    make_vpls(scene->vpl_count ? scene->vpl_count : 1, out);
}

void blocks_destroy(struct blocks *blocks)
{
    bd_tex_destroy(blocks->gpu, &blocks->gbuffer.depth);
    bd_tex_destroy(blocks->gpu, &blocks->gbuffer.normals);
    bd_tex_destroy(blocks->gpu, &blocks->gbuffer.albedo);
    bd_tex_destroy(blocks->gpu, &blocks->gbuffer.material);
    bd_tex_destroy(blocks->gpu, &blocks->discontinuity.flags);
    bd_tex_destroy(blocks->gpu, &blocks->discontinuity.representative);
    bd_buf_destroy(blocks->gpu, &blocks->fragments.list);
    bd_buf_destroy(blocks->gpu, &blocks->fragments.masks);
    bd_buf_destroy(blocks->gpu, &blocks->vpls.vpls);
    bd_buf_destroy(blocks->gpu, &blocks->vpls.quads);
    free(blocks->list);
}

// --- the passes ---------------------------------------------------------------------------------

static float *take_irradiance(struct blocks *blocks, struct bd_indirect **indirect)
{
    float *texels = blocks_texels(blocks->gpu, (*indirect)->irradiance);
    bd_indirect_destroy(blocks->gpu, indirect);
    return texels;
}

float *blocks_gathered(struct blocks *blocks)
{
    const struct bd_gather_inputs inputs = {
        .scene = &blocks->scene,
        .viewpoint = &blocks->viewpoint,
        .gbuffer = &blocks->gbuffer,
        .lists = blocks->lists,
        .list_count = 1,
    };
    struct bd_indirect *indirect;
    struct bd_err_detail detail = {0};
    if (bd_gather_run(&blocks->context, &inputs, &indirect, &detail))
        fail_msg("%s", detail.message);
    return take_irradiance(blocks, &indirect);
}

struct bd_multires_light *blocks_light(struct blocks *blocks, enum bd_fragment_visit visit,
                                       bool vector)
{
    const struct bd_gather_fragments_inputs inputs = {
        .scene = &blocks->scene,
        .viewpoint = &blocks->viewpoint,
        .gbuffer = &blocks->gbuffer,
        .discontinuity = &blocks->discontinuity,
        .fragments = &blocks->fragments,
        .lists = blocks->lists,
        .list_count = 1,
        .vector = vector,
        .visit = visit,
    };
    struct bd_multires_light *light;
    struct bd_err_detail detail = {0};
    if (bd_gather_fragments_run(&blocks->context, &inputs, &light, &detail))
        fail_msg("%s", detail.message);
    return light;
}

static void fill_linear(const struct blocks *blocks, float *fine, float *coarse)
{
    for (uint32_t i = 0; i < blocks->fragments.count; i++) {
        uint32_t level = BD_FRAGMENT_LEVEL(blocks->list[i]);
        uint32_t x = BD_FRAGMENT_X(blocks->list[i]), y = BD_FRAGMENT_Y(blocks->list[i]);
        uint32_t x0, x1, y0, y1;
        blocks_pixels(level, x, blocks->viewpoint.width_px, &x0, &x1);
        blocks_pixels(level, y, blocks->viewpoint.height_px, &y0, &y1);
        float *texel = (level ? coarse : fine) + 4 * blocks_texel(blocks, level, x, y);
        texel[0] = 1;
        texel[1] = 0.5f * (float)(x0 + x1);
        texel[2] = 0.5f * (float)(y0 + y1);
        texel[3] = 1;
    }
}

struct bd_multires_light *blocks_linear_light(struct blocks *blocks)
{
    struct bd_multires_light *light;
    struct bd_err_detail detail = {0};
    if (bd_multires_light_create(blocks->gpu, &blocks->fragments.layout, BD_LIGHT_VECTORS_NONE,
                                 &light, &detail))
        fail_msg("%s", detail.message);
    size_t fine_bytes = bd_tex_bytes(light->fine), coarse_bytes = bd_tex_bytes(light->coarse);
    float *fine = calloc(1, fine_bytes), *coarse = calloc(1, coarse_bytes);
    fill_linear(blocks, fine, coarse);
    bd_tex_upload(blocks->gpu, light->fine, 0, fine, fine_bytes);
    bd_tex_upload(blocks->gpu, light->coarse, 0, coarse, coarse_bytes);
    free(fine), free(coarse);
    return light;
}

static struct bd_surfaces *make_surfaces(struct blocks *blocks)
{
    const struct bd_discontinuity_inputs inputs = {
        .gbuffer = &blocks->gbuffer,
        .viewpoint = &blocks->viewpoint,
        .space = &blocks->scene.space,
    };
    struct bd_surfaces *surfaces;
    struct bd_err_detail detail = {0};
    if (bd_surfaces_run(&blocks->context, &inputs, &blocks->discontinuity, &surfaces, &detail))
        fail_msg("%s", detail.message);
    return surfaces;
}

float *blocks_upsampled(struct blocks *blocks, struct bd_multires_light **light,
                        enum bd_surface_detail detail)
{
    struct bd_surfaces *surfaces = make_surfaces(blocks);
    const struct bd_upsample_inputs inputs = {
        .scene = &blocks->scene,
        .viewpoint = &blocks->viewpoint,
        .gbuffer = &blocks->gbuffer,
        .fragments = &blocks->fragments,
        .parts = blocks->parts,
        .part_count = blocks->part_count,
        .surfaces = surfaces,
        .light = *light,
        .detail = detail,
    };
    struct bd_indirect *indirect;
    struct bd_err_detail error = {0};
    if (bd_upsample_run(&blocks->context, &inputs, &indirect, &error))
        fail_msg("%s", error.message);
    bd_surfaces_destroy(blocks->gpu, &surfaces);
    bd_multires_light_destroy(blocks->gpu, light);
    return take_irradiance(blocks, &indirect);
}
