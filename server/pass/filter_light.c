#include "pass/filter_light.h"

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "pass/kernels.h"
#include "shared/bindings.h"

#define TEXEL_FLOATS 4
#define TEXEL_BYTES  (TEXEL_FLOATS * sizeof(float))

struct filtering {
    const struct bd_pass_context *context;
    const struct bd_gather_inputs *inputs;
    struct bd_pool *pool;
    struct bd_smoothing smoothing;
    uint32_t width_px, height_px;
    struct bd_image *normal, *depth;
    struct bd_light_filter *filter;
    uint32_t pass, first_row; // of the loop under way
};

// --- textures and images ----------------------------------------------------------------------

// Rows of a slice; `use` is given them one slice after the other, four floats a texel.
typedef void use_rows_fn(void *user, uint32_t first_row, uint32_t row_count, float *rgba);

static enum bd_err read_rows(const struct filtering *f, const struct bd_tex *tex, uint32_t first,
                             uint32_t count, float *rgba, struct bd_err_detail *detail)
{
    struct bd_readback *pending;
    enum bd_err err =
        bd_gpu_readback_rows_start(f->context->gpu, tex, 0, first, count, &pending, detail);
    if (err) return err;
    return bd_gpu_readback_finish(f->context->gpu, &pending, rgba,
                                  f->width_px * TEXEL_BYTES * count);
}

static enum bd_err read_texture(const struct filtering *f, const struct bd_tex *tex,
                                use_rows_fn *use, void *user, struct bd_err_detail *detail)
{
    enum bd_err err = BD_ERR_OK;
    bd_slicer_work(f->context->slicer, "readback");
    for (uint32_t row = 0, rows; !err && row < f->height_px; row += rows) {
        rows = bd_slicer_rows(f->context->slicer, f->width_px, f->height_px - row);
        float *rgba = malloc(f->width_px * TEXEL_BYTES * rows);
        BD_ASSERT(rgba);
        err = read_rows(f, tex, row, rows, rgba, detail);
        if (!err) use(user, row, rows, rgba);
        free(rgba);
        if (!err) err = bd_slicer_checkpoint(f->context->slicer, (double)f->width_px * rows);
    }
    return err;
}

static void take_guides(void *user, uint32_t first_row, uint32_t row_count, float *rgba)
{
    struct filtering *f = user;
    const size_t first = (size_t)first_row * f->width_px, count = (size_t)row_count * f->width_px;
    for (size_t i = 0; i < count; i++) {
        memcpy(f->normal->pixels + 3 * (first + i), rgba + TEXEL_FLOATS * i, 3 * sizeof *rgba);
        f->depth->pixels[first + i] = rgba[TEXEL_FLOATS * i + 3];
    }
}

// The light, the halves that it is the mean of, and what doubt of it is left.
struct halves {
    uint32_t width_px;
    struct bd_image *light, *half[2], *doubt;
    struct bd_image *parts; // of the noise that edges may drown in, or NULL
};

static void take_light(void *user, uint32_t first_row, uint32_t row_count, float *rgba)
{
    const struct halves *h = user;
    const size_t first = (size_t)first_row * h->width_px, count = (size_t)row_count * h->width_px;
    for (size_t i = 0; i < count; i++)
        for (int c = 0; c < 3; c++)
            h->light->pixels[3 * (first + i) + c] = h->half[0]->pixels[3 * (first + i) + c] =
                h->half[1]->pixels[3 * (first + i) + c] = rgba[TEXEL_FLOATS * i + c];
}

static void take_noise(void *user, uint32_t first_row, uint32_t row_count, float *rgba)
{
    const struct halves *h = user;
    const size_t first = (size_t)first_row * h->width_px, count = (size_t)row_count * h->width_px;
    for (size_t i = 0; i < count; i++)
        for (int c = 0; c < 3; c++) {
            h->half[0]->pixels[3 * (first + i) + c] += rgba[TEXEL_FLOATS * i + c];
            h->half[1]->pixels[3 * (first + i) + c] -= rgba[TEXEL_FLOATS * i + c];
        }
    for (size_t i = 0; h->parts && i < count; i++)
        h->parts->pixels[first + i] = rgba[TEXEL_FLOATS * i + 3];
}

static enum bd_err write_texture(const struct filtering *f, const struct bd_image *image,
                                 struct bd_tex *tex)
{
    enum bd_err err = BD_ERR_OK;
    bd_slicer_work(f->context->slicer, "filter write");
    for (uint32_t row = 0, rows; !err && row < f->height_px; row += rows) {
        rows = bd_slicer_rows(f->context->slicer, f->width_px, f->height_px - row);
        const size_t count = (size_t)rows * f->width_px;
        float *rgba = malloc(count * TEXEL_BYTES);
        BD_ASSERT(rgba);
        for (size_t i = 0; i < count; i++) {
            const size_t at = image->channel_count * ((size_t)row * f->width_px + i);
            rgba[TEXEL_FLOATS * i + 3] = 1;
            memcpy(rgba + TEXEL_FLOATS * i, image->pixels + at,
                   image->channel_count * sizeof *rgba);
        }
        bd_tex_upload_rows(f->context->gpu, tex, 0, row, rows, rgba, count * TEXEL_BYTES);
        free(rgba);
        err = bd_slicer_checkpoint(f->context->slicer, (double)count);
    }
    return err;
}

// --- guides -----------------------------------------------------------------------------------

static enum bd_err make_guides(const struct filtering *f, struct bd_tex *guides,
                               struct bd_err_detail *detail)
{
    const struct bd_view view =
        bd_viewpoint_uniform(f->inputs->viewpoint, &f->inputs->scene->space);
    const struct bd_program *program;
    enum bd_err err =
        bd_compute_get(f->context->gpu, "pass/filter_light/guides.comp", NULL, &program, detail);
    if (err) return err;
    struct bd_bindings bindings = {0};
    uint32_t group[3];
    bd_gbuffer_bind(f->inputs->gbuffer, &bindings);
    bd_bind_image(&bindings, 0, guides, false, true);
    bindings.uniforms[BD_UNIFORM_VIEW].bytes = &view;
    bindings.uniforms[BD_UNIFORM_VIEW].size_bytes = sizeof view;
    bd_program_group_size(program, group);
    bd_gpu_dispatch(f->context->gpu, program, &bindings, bd_divided_up(f->width_px, group[0]),
                    bd_divided_up(f->height_px, group[1]), 1);
    return BD_ERR_OK;
}

static enum bd_err read_guides(struct filtering *f, struct bd_err_detail *detail)
{
    const struct bd_tex_desc desc = {.name = "guides of the filter",
                                     .format = BD_FORMAT_RGBA32F,
                                     .width_px = f->width_px,
                                     .height_px = f->height_px};
    struct bd_tex *guides = NULL;
    enum bd_err err = bd_tex_create(f->context->gpu, &desc, &guides, detail);
    if (!err) err = make_guides(f, guides, detail);
    if (!err) err = read_texture(f, guides, take_guides, f, detail);
    bd_tex_destroy(f->context->gpu, &guides);
    return err;
}

// --- the filter -------------------------------------------------------------------------------

static void filter_row(void *user, uint32_t row)
{
    const struct filtering *f = user;
    bd_light_filter_row(f->filter, f->pass, f->first_row + row);
}

// Rows of a slice over the pool's threads; others have their turn between two of those.
static enum bd_err run_pass(struct filtering *f)
{
    enum bd_err err = BD_ERR_OK;
    for (uint32_t rows; !err && f->first_row < f->height_px; f->first_row += rows) {
        rows = bd_slicer_rows(f->context->slicer, f->width_px, f->height_px - f->first_row);
        err = bd_pool_run(f->pool, rows, filter_row, NULL, f);
        if (!err) err = bd_slicer_checkpoint(f->context->slicer, (double)f->width_px * rows);
    }
    return err;
}

// Of images in memory.
static enum bd_err run_filter(struct filtering *f, const struct bd_light_filter_inputs *inputs,
                              struct bd_image *light, struct bd_image *doubt,
                              struct bd_err_detail *detail)
{
    enum bd_err err = bd_light_filter_create(inputs, &f->filter, detail);
    if (err) return err;
    bd_slicer_work(f->context->slicer, "filter");
    const uint32_t passes = bd_light_filter_pass_count(f->filter);
    for (f->pass = 0; !err && f->pass < passes; f->pass++) {
        f->first_row = 0;
        err = run_pass(f);
    }
    if (!err) bd_light_filter_store_doubt(f->filter, doubt);
    if (!err) err = bd_slicer_pause(f->context->slicer);
    if (!err) bd_light_filter_store(f->filter, light);
    bd_light_filter_destroy(&f->filter);
    return err;
}

enum bd_err bd_filter_halves(const struct bd_pass_context *context, struct bd_pool *pool,
                             const struct bd_light_filter_inputs *inputs, struct bd_image *light,
                             struct bd_image *doubt, struct bd_err_detail *detail)
{
    struct filtering f = {.context = context,
                          .pool = pool,
                          .width_px = light->width_px,
                          .height_px = light->height_px};
    return run_filter(&f, inputs, light, doubt, detail);
}

static enum bd_err filter_both(struct filtering *f, const struct halves *halves,
                               struct bd_err_detail *detail)
{
    const struct bd_light_filter_inputs inputs = {.half = {halves->half[0], halves->half[1]},
                                                  .normal = f->normal,
                                                  .depth = f->depth,
                                                  .level_count = f->smoothing.level_count,
                                                  .variance_part = f->smoothing.variance_part,
                                                  .parts = halves->parts};
    return run_filter(f, &inputs, halves->light, halves->doubt, detail);
}

static enum bd_err filter_texture(struct filtering *f, struct bd_tex *light, struct bd_tex *noise,
                                  bool of_lobes, struct bd_err_detail *detail)
{
    if (!light || !noise) return BD_ERR_OK;
    struct halves halves = {.width_px = f->width_px};
    const struct {
        struct bd_image **image;
        uint32_t channels;
    } images[] = {{&halves.light, 3},
                  {&halves.half[0], 3},
                  {&halves.half[1], 3},
                  {&halves.doubt, 4},
                  {&halves.parts, 1}};
    const int image_count = of_lobes ? 5 : 4;
    enum bd_err err = BD_ERR_OK;
    for (int i = 0; i < image_count; i++) {
        *images[i].image = bd_image_create(f->width_px, f->height_px, images[i].channels);
        if (!*images[i].image)
            err = bd_err_set(detail, BD_ERR_NO_MEMORY, "size", "no memory to filter %ux%u pixels",
                             f->width_px, f->height_px);
    }
    if (!err) err = read_texture(f, light, take_light, &halves, detail);
    if (!err) err = read_texture(f, noise, take_noise, &halves, detail);
    if (!err) err = filter_both(f, &halves, detail);
    if (!err) err = write_texture(f, halves.light, light);
    if (!err) err = write_texture(f, halves.doubt, noise);
    for (int i = 0; i < image_count; i++) bd_image_destroy(images[i].image);
    return err;
}

enum bd_err bd_filter_light_run(const struct bd_pass_context *context,
                                const struct bd_gather_inputs *inputs,
                                const struct bd_smoothing *smoothing, struct bd_indirect *indirect,
                                struct bd_err_detail *detail)
{
    struct filtering f = {
        .context = context,
        .inputs = inputs,
        .pool = inputs->visibility->pool,
        .smoothing = *smoothing,
        .width_px = inputs->viewpoint->width_px,
        .height_px = inputs->viewpoint->height_px,
    };
    enum bd_err err = BD_ERR_OK;
    f.normal = bd_image_create(f.width_px, f.height_px, 3);
    f.depth = bd_image_create(f.width_px, f.height_px, 1);
    if (!f.normal || !f.depth)
        err = bd_err_set(detail, BD_ERR_NO_MEMORY, "size", "no memory to filter %ux%u pixels",
                         f.width_px, f.height_px);
    bd_gpu_pass_begin(context->gpu, "filter");
    if (!err) err = read_guides(&f, detail);
    if (!err) err = filter_texture(&f, indirect->glossy, indirect->noise_glossy, true, detail);
    if (!err && !smoothing->glossy_alone)
        err = filter_texture(&f, indirect->irradiance, indirect->noise, false, detail);
    if (!err && !smoothing->glossy_alone)
        err = filter_texture(&f, indirect->rough, indirect->noise_rough, false, detail);
    bd_gpu_pass_end(context->gpu);
    bd_image_destroy(&f.normal);
    bd_image_destroy(&f.depth);
    return err;
}
