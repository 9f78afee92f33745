#include "pass/direct_native.h"

#include <stdlib.h>
#include <string.h>

#include "kernel/light.h"
#include "pass/direct_look.h"
#include "pass/kernels.h"

// Of the slicer: a fifth of a microsecond at first.
#define UNITS_PER_PIXEL 4.0
// Pixels of a band, unless eight rows are more: what a band is made of stays in a core's cache.
#define BAND_PIXELS 16384u
// Of a shadow map at once, between two looks at the clock.
#define COPY_BYTES (UINT64_C(1) << 20)

// A band of rows, as the G-buffer has it, and what is made of it; and of one light its shadow map.
struct direct {
    const struct bd_pass_context *context;
    const struct bd_direct_inputs *inputs;
    const struct bd_direct *out;
    struct bd_err_detail *detail;
    struct bd_view view;
    struct bd_light_uniform light;
    uint32_t rows_max, group_count;

    struct bd_native_pixels pixels;
    float *depth, *normals;
    uint16_t *albedo, *material;
    uint32_t *triangle;
    struct bd_vec4 *light_sums;
    struct bd_vec4 *fallen;                         // sums of irradiance; NULL: not asked for
    struct bd_native_aim *aims;                     // a group
    struct bd_shadow_rows (*rows)[BD_DIRECT_FACES]; // that they look at
    struct bd_vec4 *triangles;                      // borrowed
    uint32_t *ids;                                  // of all faces
    struct bd_shadow_rows there[BD_DIRECT_FACES];   // of them
    struct bd_shadow_copy shadows;
};

// --- room ---------------------------------------------------------------------------------------

static uint32_t groups_of(size_t pixels)
{
    return (uint32_t)((pixels + BD_LANES - 1) / BD_LANES);
}

// Whole groups, since loops read those.
static enum bd_err make_room(struct direct *d)
{
    const uint32_t width = d->inputs->viewpoint->width_px, height = d->inputs->viewpoint->height_px;
    const uint32_t fit = BAND_PIXELS / width, most = fit > 8 ? fit : 8;
    d->rows_max = most < height ? most : height;
    const size_t groups = groups_of((size_t)d->rows_max * width), pixels = groups * BD_LANES;
    d->depth = calloc(pixels, sizeof *d->depth);
    d->normals = calloc(pixels, 4 * sizeof *d->normals);
    d->albedo = calloc(pixels, 4 * sizeof *d->albedo);
    d->material = calloc(pixels, 4 * sizeof *d->material);
    d->triangle = calloc(pixels, sizeof *d->triangle);
    d->light_sums = calloc(pixels, sizeof *d->light_sums);
    if (d->out->irradiance) d->fallen = calloc(pixels, sizeof *d->fallen);
    d->aims = malloc(groups * sizeof *d->aims);
    d->rows = malloc(groups * sizeof *d->rows);
    if (d->depth && d->normals && d->albedo && d->material && d->triangle && d->light_sums &&
        d->aims && d->rows && (d->fallen || !d->out->irradiance))
        return BD_ERR_OK;
    return bd_err_set(d->detail, BD_ERR_NO_MEMORY, "size", "no memory for %zu pixels of a band",
                      pixels);
}

static void free_room(struct direct *d)
{
    free(d->depth);
    free(d->normals);
    free(d->albedo);
    free(d->material);
    free(d->triangle);
    free(d->light_sums);
    free(d->fallen);
    free(d->aims);
    free(d->rows);
    free(d->ids);
}

// --- what is copied -----------------------------------------------------------------------------

static enum bd_err read_band(struct direct *d, const struct bd_tex *tex, uint32_t first,
                             uint32_t count, void *out, size_t pixel_bytes)
{
    return bd_tex_read_rows(d->context->gpu, tex, 0, first, count, out,
                            (size_t)count * d->inputs->viewpoint->width_px * pixel_bytes);
}

static enum bd_err fetch_sums(struct direct *d, const struct bd_tex *tex, uint32_t first,
                              uint32_t count, bool is_first, struct bd_vec4 *sums)
{
    if (!is_first) return read_band(d, tex, first, count, sums, sizeof *sums);
    memset(sums, 0, (size_t)count * d->inputs->viewpoint->width_px * sizeof *sums);
    return BD_ERR_OK;
}

static enum bd_err fetch_band(struct direct *d, uint32_t first, uint32_t count, bool is_first)
{
    const struct bd_gbuffer *from = d->inputs->gbuffer;
    enum bd_err err = read_band(d, from->depth, first, count, d->depth, sizeof *d->depth);
    if (!err) err = read_band(d, from->normals, first, count, d->normals, 4 * sizeof *d->normals);
    if (!err) err = read_band(d, from->albedo, first, count, d->albedo, 4 * sizeof *d->albedo);
    if (!err)
        err = read_band(d, from->material, first, count, d->material, 4 * sizeof *d->material);
    if (!err) err = read_band(d, from->triangle, first, count, d->triangle, sizeof *d->triangle);
    const uint32_t pixels = count * d->inputs->viewpoint->width_px;
    d->pixels = (struct bd_native_pixels){d->depth,    d->normals, d->albedo, d->material,
                                          d->triangle, &d->view,   first,     pixels};
    d->group_count = groups_of(pixels);
    if (!err) err = fetch_sums(d, d->out->radiance, first, count, is_first, d->light_sums);
    if (!err && d->fallen)
        err = fetch_sums(d, d->out->irradiance, first, count, is_first, d->fallen);
    return err;
}

static enum bd_err copy_rows(struct direct *d, const struct bd_tex *ids, uint32_t face,
                             uint32_t first, uint32_t end)
{
    const size_t side = d->shadows.side_px, row_bytes = side * sizeof *d->ids;
    const uint32_t step = row_bytes < COPY_BYTES ? (uint32_t)(COPY_BYTES / row_bytes) : 1;
    enum bd_err err = BD_ERR_OK;
    for (uint32_t row = first; !err && row < end; row += step) {
        const uint32_t count = end - row < step ? end - row : step;
        err = bd_tex_read_rows(d->context->gpu, ids, face, row, count,
                               d->ids + (face * side + row) * side, count * row_bytes);
        if (!err) err = bd_slicer_pause(d->context->slicer);
    }
    return err;
}

// Those of a face that the band's pixels look at, if they are not there.
static enum bd_err fetch_rows(struct direct *d, const struct bd_tex *ids, uint32_t face,
                              uint32_t seen_as)
{
    struct bd_shadow_rows want = {d->shadows.side_px, 0}, *there = &d->there[face];
    for (uint32_t g = 0; g < d->group_count; g++) {
        const struct bd_shadow_rows *rows = &d->rows[g][seen_as];
        if (rows->first < want.first) want.first = rows->first;
        if (rows->end > want.end) want.end = rows->end;
    }
    if (want.first >= want.end) return BD_ERR_OK;
    if (there->first >= there->end) *there = (struct bd_shadow_rows){want.first, want.first};
    enum bd_err err = BD_ERR_OK;
    if (want.first < there->first) err = copy_rows(d, ids, face, want.first, there->first);
    if (!err && want.end > there->end) err = copy_rows(d, ids, face, there->end, want.end);
    if (want.first < there->first) there->first = want.first;
    if (want.end > there->end) there->end = want.end;
    return err;
}

static uint32_t seen_as(const struct direct *d, uint32_t face)
{
    return d->light.face_count == 1 ? LIGHT_ONE_FACE : face;
}

static enum bd_err fetch_shadows(struct direct *d, const struct bd_tex *ids)
{
    enum bd_err err = BD_ERR_OK;
    for (uint32_t face = 0; !err && face < d->light.face_count; face++)
        err = fetch_rows(d, ids, face, seen_as(d, face));
    return err;
}

// --- a light ------------------------------------------------------------------------------------

static void aim_group(void *user, uint32_t group)
{
    const struct direct *d = user;
    d->context->processor->loops->aim(&d->pixels, group * BD_LANES, &d->light, d->inputs->lambert,
                                      &d->aims[group]);
    bd_direct_rows_of(&d->aims[group], d->shadows.side_px, d->rows[group]);
}

static void look_from_group(void *user, uint32_t group)
{
    const struct direct *d = user;
    bd_direct_look(d->context->processor->loops, &d->aims[group], &d->shadows,
                   d->light_sums + (size_t)group * BD_LANES,
                   d->fallen ? d->fallen + (size_t)group * BD_LANES : NULL);
}

static enum bd_err light_band(struct direct *d, uint32_t index, uint32_t first, uint32_t count)
{
    struct bd_pool *pool = d->context->processor->pool;
    enum bd_err err = fetch_band(d, first, count, index == 0);
    if (!err) err = bd_pool_run(pool, d->group_count, aim_group, NULL, d);
    if (!err) err = fetch_shadows(d, d->inputs->lights[index].shadow_map->ids);
    if (!err) err = bd_pool_run(pool, d->group_count, look_from_group, NULL, d);
    if (!err)
        bd_tex_upload_rows(d->context->gpu, d->out->radiance, 0, first, count, d->light_sums,
                           d->pixels.count * sizeof *d->light_sums);
    if (!err && d->fallen)
        bd_tex_upload_rows(d->context->gpu, d->out->irradiance, 0, first, count, d->fallen,
                           d->pixels.count * sizeof *d->fallen);
    return err;
}

static enum bd_err take_light(struct direct *d, uint32_t index)
{
    const struct bd_direct_light *light = &d->inputs->lights[index];
    const size_t side = light->shadow_map->side_px;
    d->light = bd_light_setup_uniform(light->setup, &d->inputs->scene->space, (uint32_t)side);
    free(d->ids);
    d->ids = malloc(d->light.face_count * side * side * sizeof *d->ids);
    if (!d->ids)
        return bd_err_set(d->detail, BD_ERR_NO_MEMORY, "shadow_size",
                          "no memory for a copy of %u faces of %zu texels a side",
                          d->light.face_count, side);
    memset(d->there, 0, sizeof d->there);
    d->shadows = (struct bd_shadow_copy){.side_px = (uint32_t)side, .triangles = d->triangles};
    for (uint32_t face = 0; face < d->light.face_count; face++)
        d->shadows.faces[seen_as(d, face)] = d->ids + face * side * side;
    return BD_ERR_OK;
}

static enum bd_err add_light(struct direct *d, uint32_t index)
{
    struct bd_slicer *slicer = d->context->slicer;
    const uint32_t height = d->inputs->viewpoint->height_px;
    const double row_units = UNITS_PER_PIXEL * d->inputs->viewpoint->width_px;
    enum bd_err err = take_light(d, index);
    bd_slicer_work(slicer, "native direct");
    for (uint32_t row = 0; !err && row < height;) {
        const uint32_t left = height - row;
        const uint32_t fit =
            bd_slicer_rows(slicer, row_units, left < d->rows_max ? left : d->rows_max);
        err = light_band(d, index, row, fit);
        if (!err) err = bd_slicer_checkpoint(slicer, row_units * fit);
        row += fit;
    }
    return err;
}

enum bd_err bd_direct_native_run(const struct bd_pass_context *context,
                                 const struct bd_direct_inputs *inputs, const struct bd_direct *out,
                                 struct bd_err_detail *detail)
{
    struct bd_buf *triangles = inputs->scene->triangles;
    struct direct d = {
        .context = context,
        .inputs = inputs,
        .out = out,
        .detail = detail,
        .view = bd_viewpoint_uniform(inputs->viewpoint, &inputs->scene->space),
    };
    enum bd_err err = make_room(&d);
    if (!err)
        err = bd_buf_borrow(context->gpu, triangles, BD_BORROW_TO_READ, (void **)&d.triangles,
                            detail);
    for (uint32_t i = 0; !err && i < inputs->light_count; i++) err = add_light(&d, i);
    bd_buf_return(context->gpu, triangles, BD_BORROW_TO_READ, (void **)&d.triangles);
    free_room(&d);
    return err;
}
