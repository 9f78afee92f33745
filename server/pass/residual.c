#include "pass/residual.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "pass/f3_arrays.h"
#include "pass/kernels.h"
#include "pass/receivers.h"
#include "shared/bindings.h"

// Of the slicer, one for each evaluation of a VPL: a block of pixels and all parts it looks at.
#define UNITS_PER_BLOCK  16000.0
#define UNITS_PER_TEXEL  1.0
#define UNITS_PER_BOUNDS 400.0
#define SIDE             ((uint32_t)BD_SCREEN_BLOCK_SIDE)

struct residual {
    struct bd_pass_context context; // with a processor
    struct bd_processor processor;
    const struct bd_residual_inputs *inputs;
    const struct bd_program *program; // NULL: by the processor's loops
    struct bd_screen *screen;         // borrowed
    struct bd_native_screen native;
    struct bd_uvec4 *bounds; // of blocks: where their pixels look
    uint32_t width_px, height_px, blocks_across;
    float radius;        // beyond which nothing is given
    float *fallen, *sum; // irradiance of the last iteration, and of all: three floats a pixel
    float *lobes, *lobe_sum; // the same of lobes, or NULL
    float *looked;           // of each pixel
    struct bd_buf *parts, *patches, *receivers, *surfaces, *bounds_buf, *light,
        *lobe_light; // the device's
    struct bd_err_detail *detail;
};

static uint32_t block_count(const struct residual *s)
{
    return s->blocks_across * ((s->height_px + SIDE - 1) / SIDE);
}

static bool any_asks(const struct bd_screen *screen)
{
    const size_t pixels = (size_t)screen->width_px * screen->height_px;
    bool any = false;
    for (size_t i = 0; i < pixels && !any; i++) any = screen->receivers[i].place_lit.w > 0;
    return any;
}

// --- textures -----------------------------------------------------------------------------------

// Adds a texture's first three channels to `into`, or what is there to the texture, which is then
// the sum.
static enum bd_err add_texture(struct residual *s, struct bd_tex *tex, bool writes, float *into)
{
    const size_t row_floats = 4 * (size_t)s->width_px;
    enum bd_err err = BD_ERR_OK;
    bd_slicer_work(s->context.slicer, "residual light");
    for (uint32_t row = 0, rows; !err && row < s->height_px; row += rows) {
        rows = bd_slicer_rows(s->context.slicer, UNITS_PER_TEXEL * s->width_px, s->height_px - row);
        float *rgba = malloc(rows * row_floats * sizeof *rgba);
        BD_ASSERT(rgba);
        err = bd_tex_read_rows(s->context.gpu, tex, 0, row, rows, rgba,
                               rows * row_floats * sizeof *rgba);
        for (size_t i = 0; !err && i < (size_t)rows * s->width_px; i++)
            for (size_t c = 0; c < 3; c++) {
                float *own = into + 3 * ((size_t)row * s->width_px + i) + c;
                float *held = rgba + 4 * i + c;
                *(writes ? held : own) += *(writes ? own : held);
            }
        if (!err && writes)
            bd_tex_upload_rows(s->context.gpu, tex, 0, row, rows, rgba,
                               rows * row_floats * sizeof *rgba);
        free(rgba);
        if (!err)
            err = bd_slicer_checkpoint(s->context.slicer, UNITS_PER_TEXEL * s->width_px * rows);
    }
    return err;
}

// --- where a receiver looks ---------------------------------------------------------------------

static void widen(const struct residual *s, f3 position, struct bd_uvec4 *all)
{
    const uint32_t shift = s->screen->level_count - 1, size = 1u << shift;
    uint32_t bounds[4];
    bd_screen_bounds(s->screen, position, s->radius, bounds);
    const uint32_t left = bounds[0] >> shift, right = (bounds[1] + size - 1) >> shift;
    const uint32_t top = bounds[2] >> shift, bottom = (bounds[3] + size - 1) >> shift;
    all->x = left < all->x ? left : all->x;
    all->z = right > all->z ? right : all->z;
    all->y = top < all->y ? top : all->y;
    all->w = bottom > all->w ? bottom : all->w;
}

// The pixel of a lane; false beyond the picture.
static bool pixel_of(const struct residual *s, uint32_t block, uint32_t lane, size_t *pixel)
{
    const uint32_t x = block % s->blocks_across * SIDE + lane % SIDE;
    const uint32_t y = block / s->blocks_across * SIDE + lane / SIDE;
    *pixel = (size_t)y * s->width_px + x;
    return x < s->width_px && y < s->height_px;
}

static void bound_block(void *user, uint32_t block)
{
    const struct residual *s = user;
    struct bd_uvec4 *bounds = &s->bounds[block];
    size_t pixel;
    *bounds = (struct bd_uvec4){UINT32_MAX, UINT32_MAX, 0, 0};
    for (uint32_t i = 0; i < BD_SCREEN_LANES; i++) {
        if (!pixel_of(s, block, i, &pixel)) continue;
        const struct bd_vec4 *place = &s->screen->receivers[pixel].place_lit;
        if (place->w > 0) widen(s, f3_from(place), bounds);
    }
}

// --- by the processor ---------------------------------------------------------------------------

static void put_lane(const struct bd_screen_receiver *own, uint32_t i,
                     struct bd_screen_receivers *r)
{
    r->x[i] = own->place_lit.x;
    r->y[i] = own->place_lit.y;
    r->z[i] = own->place_lit.z;
    r->normal_x[i] = own->normal.x;
    r->normal_y[i] = own->normal.y;
    r->normal_z[i] = own->normal.z;
    r->geometric_x[i] = own->normal_geometric.x;
    r->geometric_y[i] = own->normal_geometric.y;
    r->geometric_z[i] = own->normal_geometric.z;
    r->lit[i] = own->place_lit.w;
}

static void put_surface(const struct bd_screen_surface *own, uint32_t i,
                        struct bd_screen_surfaces *s)
{
    s->viewer_x[i] = own->viewer_lobe.x;
    s->viewer_y[i] = own->viewer_lobe.y;
    s->viewer_z[i] = own->viewer_lobe.z;
    s->has_lobe[i] = own->viewer_lobe.w;
    s->red[i] = own->color_metallic.x;
    s->green[i] = own->color_metallic.y;
    s->blue[i] = own->color_metallic.z;
    s->metallic[i] = own->color_metallic.w;
    s->roughness[i] = own->roughness_f0.x;
    s->f0_dielectric[i] = own->roughness_f0.y;
}

static void light_block(void *user, uint32_t block)
{
    const struct residual *s = user;
    const struct bd_screen *screen = s->screen;
    struct bd_screen_receivers r = {.bounds = s->bounds[block]};
    struct bd_screen_surfaces surfaces = {0};
    struct bd_screen_light light = {0};
    size_t pixel;
    for (uint32_t i = 0; i < BD_SCREEN_LANES; i++) {
        if (!pixel_of(s, block, i, &pixel)) continue;
        put_lane(&screen->receivers[pixel], i, &r);
        if (screen->surfaces) put_surface(&screen->surfaces[pixel], i, &surfaces);
    }
    s->processor.loops->residual(&s->native, &r, screen->surfaces ? &surfaces : NULL, &light);
    for (uint32_t i = 0; i < BD_SCREEN_LANES; i++) {
        if (!pixel_of(s, block, i, &pixel)) continue;
        float *to = s->fallen + 3 * pixel;
        to[0] = light.red[i];
        to[1] = light.green[i];
        to[2] = light.blue[i];
        if (s->lobes)
            f3_store(s->lobes + 3 * pixel,
                     f3_of(light.lobe_red[i], light.lobe_green[i], light.lobe_blue[i]));
        s->looked[pixel] = light.looked[i];
    }
}

// --- by the device ------------------------------------------------------------------------------

static enum bd_err make_buffers(struct residual *s)
{
    struct bd_gpu *gpu = s->context.gpu;
    const struct bd_screen *screen = s->screen;
    const size_t pixels = (size_t)s->width_px * s->height_px;
    enum bd_err err =
        bd_buf_create(gpu, "parts of the screen", screen->part_count * sizeof *screen->parts, NULL,
                      &s->parts, s->detail);
    if (!err)
        err = bd_buf_create(gpu, "patches of the screen", pixels * sizeof *screen->patches,
                            screen->patches, &s->patches, s->detail);
    if (!err)
        err = bd_buf_create(gpu, "receivers of the screen", pixels * sizeof *screen->receivers,
                            screen->receivers, &s->receivers, s->detail);
    if (!err && screen->surfaces)
        err = bd_buf_create(gpu, "surfaces of the screen", pixels * sizeof *screen->surfaces,
                            screen->surfaces, &s->surfaces, s->detail);
    if (!err && screen->surfaces)
        err = bd_buf_create(gpu, "lobes of the screen", pixels * sizeof(struct bd_vec4), NULL,
                            &s->lobe_light, s->detail);
    if (!err)
        err = bd_buf_create(gpu, "bounds of the screen", block_count(s) * sizeof *s->bounds,
                            s->bounds, &s->bounds_buf, s->detail);
    if (!err)
        err = bd_buf_create(gpu, "light of the screen", pixels * sizeof(struct bd_vec4), NULL,
                            &s->light, s->detail);
    return err;
}

static void dispatch(const struct residual *s, uint32_t row, uint32_t rows)
{
    struct bd_screen_args args = s->native.args;
    struct bd_bindings bindings = {0};
    uint32_t group[3];
    args.first_row = row;
    args.row_count = rows;
    bindings.arrays[BD_UNIT_SCREEN_PARTS] = s->parts;
    bindings.arrays[BD_UNIT_SCREEN_PATCHES] = s->patches;
    bindings.arrays[BD_UNIT_SCREEN_RECEIVERS] = s->receivers;
    bindings.arrays[BD_UNIT_SCREEN_SURFACES] = s->surfaces;
    bd_bind_storage(&bindings, BD_STORAGE_SCREEN_BOUNDS, s->bounds_buf, true, false);
    bd_bind_storage(&bindings, BD_STORAGE_SCREEN_LIGHT, s->light, false, true);
    if (s->lobe_light)
        bd_bind_storage(&bindings, BD_STORAGE_SCREEN_LOBES, s->lobe_light, false, true);
    bindings.uniforms[BD_UNIFORM_ARGS].bytes = &args;
    bindings.uniforms[BD_UNIFORM_ARGS].size_bytes = sizeof args;
    bd_program_group_size(s->program, group);
    bd_gpu_dispatch(s->context.gpu, s->program, &bindings, bd_divided_up(s->width_px, group[0]),
                    bd_divided_up(rows, group[1]), 1);
}

// Three floats a pixel, and if asked for the fourth.
static enum bd_err fetch(struct residual *s, struct bd_buf *buf, float *rgb, float *fourth)
{
    const size_t pixels = (size_t)s->width_px * s->height_px;
    struct bd_vec4 *light = malloc(pixels * sizeof *light);
    BD_ASSERT(light);
    const enum bd_err err = bd_buf_read(s->context.gpu, buf, 0, light, pixels * sizeof *light);
    for (size_t i = 0; !err && i < pixels; i++) {
        f3_store(rgb + 3 * i, f3_from(&light[i]));
        if (fourth) fourth[i] = light[i].w;
    }
    free(light);
    return err;
}

static enum bd_err fetch_light(struct residual *s)
{
    const enum bd_err err = fetch(s, s->light, s->fallen, s->looked);
    return err || !s->lobes ? err : fetch(s, s->lobe_light, s->lobes, NULL);
}

static enum bd_err light_rows(struct residual *s)
{
    const double row_units = UNITS_PER_BLOCK / BD_SCREEN_LANES * s->width_px;
    enum bd_err err = BD_ERR_OK;
    bd_buf_upload(s->context.gpu, s->parts, 0, s->screen->parts,
                  s->screen->part_count * sizeof *s->screen->parts);
    for (uint32_t row = 0, rows; !err && row < s->height_px; row += rows) {
        rows = bd_slicer_rows(s->context.slicer, row_units, s->height_px - row);
        dispatch(s, row, rows);
        err = bd_slicer_checkpoint(s->context.slicer, row_units * rows);
    }
    return err ? err : fetch_light(s);
}

// --- all ----------------------------------------------------------------------------------------

static enum bd_err make_room(struct residual *s)
{
    const size_t pixels = (size_t)s->width_px * s->height_px;
    s->fallen = calloc(3 * pixels, sizeof *s->fallen);
    s->sum = calloc(3 * pixels, sizeof *s->sum);
    s->looked = calloc(pixels, sizeof *s->looked);
    s->bounds = calloc(block_count(s), sizeof *s->bounds);
    if (s->screen->surfaces) {
        s->lobes = calloc(3 * pixels, sizeof *s->lobes);
        s->lobe_sum = calloc(3 * pixels, sizeof *s->lobe_sum);
    }
    const bool lobes = !s->screen->surfaces || (s->lobes && s->lobe_sum);
    if (s->fallen && s->sum && s->looked && s->bounds && lobes) return BD_ERR_OK;
    return bd_err_set(s->detail, BD_ERR_NO_MEMORY, "size", "no memory for light of %zu pixels",
                      pixels);
}

static enum bd_err iterate(struct residual *s, uint64_t *looked)
{
    const size_t pixels = (size_t)s->width_px * s->height_px;
    enum bd_err err = bd_screen_shine(&s->context, s->screen, s->fallen);
    bd_slicer_work(s->context.slicer, s->program ? "residual" : "native residual");
    if (!err && s->program) err = light_rows(s);
    if (!err && !s->program)
        err = bd_receivers_each(&s->context, block_count(s), UNITS_PER_BLOCK, light_block, s);
    for (size_t i = 0; !err && i < 3 * pixels; i++) s->sum[i] += s->fallen[i];
    for (size_t i = 0; !err && s->lobes && i < 3 * pixels; i++) s->lobe_sum[i] += s->lobes[i];
    for (size_t i = 0; !err && i < pixels; i++) *looked += (uint64_t)s->looked[i];
    return err;
}

static enum bd_err set_up(struct residual *s)
{
    const struct bd_residual_inputs *in = s->inputs;
    const struct bd_screen *screen = s->screen;
    struct bd_screen_args *args = &s->native.args;
    s->native.parts = screen->parts;
    s->native.patches = screen->patches;
    s->native.printed = screen->printed;
    *args = (struct bd_screen_args){.width_px = s->width_px,
                                    .height_px = s->height_px,
                                    .level_count = screen->level_count,
                                    .clamp = in->clamp,
                                    .smooth_sr = in->smooth_sr,
                                    .edge_sr = in->edge_sr};
    memcpy(args->levels, screen->levels, sizeof args->levels);
    const enum bd_err err =
        bd_receivers_each(&s->context, block_count(s), UNITS_PER_BOUNDS, bound_block, s);
    return err || !s->program ? err : make_buffers(s);
}

static enum bd_err run(struct residual *s, struct bd_indirect *indirect)
{
    const struct bd_residual_inputs *in = s->inputs;
    const struct bd_tex *const fallen[] = {in->direct, in->area_light,
                                           in->once ? NULL : indirect->irradiance};
    if (!any_asks(s->screen)) return BD_ERR_OK;
    enum bd_err err = make_room(s);
    if (!err) err = set_up(s);
    for (int i = 0; !err && i < 3; i++)
        if (fallen[i]) err = add_texture(s, (struct bd_tex *)fallen[i], false, s->fallen);
    for (uint32_t n = 0; !err && n < (in->once ? 1 : in->iterations); n++)
        err = iterate(s, &indirect->screen_parts);
    if (!err) err = add_texture(s, indirect->irradiance, true, s->sum);
    return err || !s->lobes ? err : add_texture(s, indirect->glossy, true, s->lobe_sum);
}

static void finish(struct residual *s)
{
    struct bd_buf **const bufs[] = {&s->parts,      &s->patches, &s->receivers, &s->surfaces,
                                    &s->bounds_buf, &s->light,   &s->lobe_light};
    for (size_t i = 0; i < sizeof bufs / sizeof *bufs; i++) bd_buf_destroy(s->context.gpu, bufs[i]);
    free(s->bounds);
    free(s->fallen);
    free(s->sum);
    free(s->lobes);
    free(s->lobe_sum);
    free(s->looked);
}

// What the device's arrays and buffers cannot hold is the processor's.
static bool fits_device(const struct residual *s)
{
    const struct bd_gpu_caps *caps = bd_gpu_caps(s->context.gpu);
    const uint64_t pixels = (uint64_t)s->width_px * s->height_px;
    return s->screen->part_count * sizeof *s->screen->parts <= caps->array_max_bytes &&
           pixels * sizeof *s->screen->receivers <= caps->array_max_bytes &&
           pixels * sizeof(struct bd_vec4) <= caps->storage_block_max_bytes;
}

enum bd_err bd_residual_run(const struct bd_pass_context *context,
                            const struct bd_residual_inputs *inputs, struct bd_indirect *indirect,
                            struct bd_err_detail *detail)
{
    struct residual s = {
        .context = *context,
        .processor = {inputs->pool, bd_native_loops()},
        .inputs = inputs,
        .screen = inputs->screen,
        .width_px = inputs->screen->width_px,
        .height_px = inputs->screen->height_px,
        .blocks_across = (inputs->screen->width_px + SIDE - 1) / SIDE,
        .radius = 1 / sqrtf(inputs->clamp),
        .detail = detail,
    };
    enum bd_err err = BD_ERR_OK;
    BD_ASSERT(inputs->clamp > 0 && inputs->iterations > 0);
    struct bd_defines defines = {0};
    if (s.screen->printed) bd_define(&defines, "BD_PRINTED", 1);
    if (s.screen->surfaces) bd_define(&defines, "BD_GLOSSY", 1);
    if (!context->processor && fits_device(&s))
        err = bd_compute_get(context->gpu, "pass/residual/residual.comp", &defines, &s.program,
                             detail);
    s.context.processor = &s.processor;
    bd_gpu_pass_begin(context->gpu, "residual");
    if (!err) err = run(&s, indirect);
    bd_gpu_pass_end(context->gpu);
    finish(&s);
    return err;
}
