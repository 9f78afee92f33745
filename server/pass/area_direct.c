#include "pass/area_direct.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "image/light_filter.h"
#include "pass/area_samples.h"
#include "pass/filter_light.h"
#include "pass/lobe.h"
#include "pass/punctual_light.h"
#include "pass/receivers.h"
#include "pass/straight.h"

#define HALVES BD_AREA_HALVES
// Of segments, rays and what they bring at once.
#define ROOM_BYTES ((size_t)16 << 20)
// Few rays are off at neighbours as well.
#define FEW_RAYS 8u
// Of the slicer, one for each evaluation of a VPL: what a ray takes to be chosen.
#define UNITS_PER_RAY 60.0
// Of a punctual light's ray, which is traced too, and a pixel that punctual lights light.
#define UNITS_PER_PUNCTUAL_RAY 200.0
#define UNITS_PER_LIT          500.0
// Pixels along a side of a block that punctual lights are found for.
#define BLOCK_SIDE 8u

struct area {
    struct bd_pass_context context;
    struct bd_processor processor;
    const struct bd_area_direct_inputs *inputs;
    struct bd_area_sampling sampling;
    struct bd_punctual_light punctuals;
    uint32_t width_px, height_px;
    bd_dvec3 eye; // render space
    // Of the picture.
    struct bd_image *irradiance[HALVES], *beyond[HALVES];
    struct bd_image *irradiance_doubt, *beyond_doubt; // image/light_filter.h
    struct bd_image *albedo, *normal, *depth;
    // Of a part: of each receiver its halves, of each half its rays.
    const struct bd_receiver_part *part;
    struct bd_segment *segments;
    struct bd_area_light_found *found;
    uint32_t *occluded;
    struct bd_area_lobe *lobes;
    struct bd_area_shares *shares;
    struct bd_ray *rays;
    struct bd_ray_hit *hits;
    f3 *passed;                       // of each ray, through panes
    uint32_t *lobe_count, *first_ray; // of each group
    uint32_t ray_count;
    struct bd_err_detail *detail;
};

// --- room ---------------------------------------------------------------------------------------

static size_t receiver_bytes(const struct area *a)
{
    return HALVES * (a->sampling.rays * (sizeof *a->segments + sizeof *a->found) +
                     a->sampling.lobes * (sizeof *a->lobes + sizeof *a->rays + sizeof *a->hits +
                                          sizeof *a->passed) +
                     sizeof *a->shares);
}

static uint32_t receivers_at_once(const struct area *a)
{
    const size_t groups = ROOM_BYTES / (receiver_bytes(a) * BD_LANES);
    return (uint32_t)(groups > 1 ? groups : 1) * BD_LANES;
}

static enum bd_err no_memory(const struct area *a)
{
    return bd_err_set(a->detail, BD_ERR_NO_MEMORY, "size", "no memory to light %ux%u pixels",
                      a->width_px, a->height_px);
}

static enum bd_err make_room(struct area *a, uint32_t group_count)
{
    const size_t halves = (size_t)group_count * BD_LANES * HALVES;
    const size_t rays = halves * a->sampling.rays, lobes = halves * a->sampling.lobes;
    if (!a->inputs->lights || a->segments) return BD_ERR_OK; // the first part is the largest
    a->segments = malloc(rays * sizeof *a->segments);
    a->found = malloc(rays * sizeof *a->found);
    a->occluded = malloc((rays + 31) / 32 * sizeof *a->occluded);
    a->lobes = malloc(lobes * sizeof *a->lobes);
    a->shares = malloc(halves * sizeof *a->shares);
    a->rays = malloc(lobes * sizeof *a->rays);
    a->hits = malloc(lobes * sizeof *a->hits);
    a->passed = malloc(lobes * sizeof *a->passed);
    a->lobe_count = malloc(group_count * sizeof *a->lobe_count);
    a->first_ray = malloc(group_count * sizeof *a->first_ray);
    const bool all = a->segments && a->found && a->occluded && a->lobes && a->shares && a->rays &&
                     a->hits && a->passed && a->lobe_count && a->first_ray;
    return all ? BD_ERR_OK : no_memory(a);
}

static enum bd_err make_images(struct area *a)
{
    struct bd_image **const of_three[] = {&a->irradiance[0], &a->irradiance[1], &a->beyond[0],
                                          &a->beyond[1],     &a->albedo,        &a->normal};
    bool all = true;
    for (size_t i = 0; i < sizeof of_three / sizeof *of_three; i++)
        all &= (*of_three[i] = bd_image_create(a->width_px, a->height_px, 3)) != NULL;
    all &= (a->depth = bd_image_create(a->width_px, a->height_px, 1)) != NULL;
    all &= (a->irradiance_doubt = bd_image_create(a->width_px, a->height_px, 4)) != NULL;
    all &= (a->beyond_doubt = bd_image_create(a->width_px, a->height_px, 4)) != NULL;
    return all ? BD_ERR_OK : no_memory(a);
}

static void free_all(struct area *a)
{
    void *arrays[] = {a->segments, a->found, a->occluded, a->lobes,      a->shares,
                      a->rays,     a->hits,  a->passed,   a->lobe_count, a->first_ray};
    struct bd_image **images[] = {&a->irradiance[0], &a->irradiance[1], &a->beyond[0],
                                  &a->beyond[1],     &a->albedo,        &a->normal,
                                  &a->depth,         &a->beyond_doubt,  &a->irradiance_doubt};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) free(arrays[i]);
    for (size_t i = 0; i < sizeof images / sizeof *images; i++) bd_image_destroy(images[i]);
}

// --- receivers ----------------------------------------------------------------------------------

static void keep_guides(const struct area *a, const struct bd_area_receiver *at)
{
    const size_t pixel = (size_t)at->y_px * a->width_px + at->x_px;
    const bd_dvec3 z = a->inputs->viewpoint->axis_z;
    const float albedo = a->inputs->lambert ? 1 : 1 - at->metallic;
    const f3 parts[] = {at->normal, f3_scale(at->base_color, albedo)};
    struct bd_image *const images[] = {a->normal, a->albedo};
    for (int i = 0; i < 2; i++) {
        images[i]->pixels[3 * pixel] = parts[i].x;
        images[i]->pixels[3 * pixel + 1] = parts[i].y;
        images[i]->pixels[3 * pixel + 2] = parts[i].z;
    }
    a->depth->pixels[pixel] =
        (float)((a->eye.x - at->position.x) * z.x + (a->eye.y - at->position.y) * z.y +
                (a->eye.z - at->position.z) * z.z);
}

// --- a part -------------------------------------------------------------------------------------

static void see_group(void *user, uint32_t group)
{
    const struct area *a = user;
    for (uint32_t lane = 0; lane < BD_LANES; lane++) {
        struct bd_area_receiver at;
        if (bd_lobe_receiver_at(a->part, group, lane, &at)) keep_guides(a, &at);
    }
}

static void sample_group(void *user, uint32_t group)
{
    const struct area *a = user;
    const size_t rays = a->sampling.rays, lobes = a->sampling.lobes;
    a->lobe_count[group] = 0;
    for (uint32_t lane = 0; lane < BD_LANES; lane++) {
        struct bd_area_receiver at;
        struct bd_emitter_cut cut;
        const bool is_lit = bd_lobe_receiver_at(a->part, group, lane, &at);
        if (is_lit && !bd_area_all_are_weighed(&a->sampling)) {
            bd_emitter_tree_cut(&a->inputs->lights->tree, at.position, at.normal, &cut);
            at.cut = &cut;
        }
        const size_t i = ((size_t)group * BD_LANES + lane) * HALVES;
        memset(a->segments + i * rays, 0, HALVES * rays * sizeof *a->segments);
        memset(a->found + i * rays, 0, HALVES * rays * sizeof *a->found);
        memset(a->lobes + i * lobes, 0, HALVES * lobes * sizeof *a->lobes);
        memset(a->shares + i, 0, HALVES * sizeof *a->shares);
        if (!is_lit) continue;
        bd_area_sample(&a->sampling, &at, HALVES, a->segments + i * rays, a->found + i * rays,
                       a->lobes + i * lobes, a->shares + i);
        for (size_t l = i * lobes; l < (i + HALVES) * lobes; l++)
            a->lobe_count[group] += a->lobes[l].density > 0;
    }
}

static size_t lobes_of_group(const struct area *a)
{
    return (size_t)BD_LANES * HALVES * a->sampling.lobes;
}

static void list_lobes(void *user, uint32_t group)
{
    const struct area *a = user;
    const struct bd_area_lobe *lobes = a->lobes + group * lobes_of_group(a);
    struct bd_ray *to = a->rays + a->first_ray[group];
    for (size_t i = 0; i < lobes_of_group(a); i++)
        if (lobes[i].density > 0) *to++ = lobes[i].ray;
}

static enum bd_err follow_lobes(struct area *a)
{
    const uint32_t groups = a->part->group_count;
    a->ray_count = 0;
    for (uint32_t g = 0; g < groups; g++) {
        a->first_ray[g] = a->ray_count;
        a->ray_count += a->lobe_count[g];
    }
    for (uint32_t g = 0; g < groups; g++) list_lobes(a, g);
    struct bd_ray_counts traced = {0};
    return bd_straight_nearest(&a->context, &a->inputs->visibility, a->rays, a->ray_count, a->hits,
                               a->passed, &traced, a->detail);
}

static void add_to(struct bd_area_light_found *sum, const struct bd_area_light_found *more)
{
    sum->irradiance = f3_add(sum->irradiance, more->irradiance);
    sum->beyond = f3_add(sum->beyond, more->beyond);
}

static void keep(struct bd_image *image, size_t pixel, f3 value)
{
    image->pixels[3 * pixel] = value.x;
    image->pixels[3 * pixel + 1] = value.y;
    image->pixels[3 * pixel + 2] = value.z;
}

// The rays' light in their order, then the lobe's.
static void sum_half(const struct area *a, const struct bd_area_receiver *at, size_t i,
                     uint32_t half, size_t *ray)
{
    const size_t rays = a->sampling.rays, lobes = a->sampling.lobes;
    const size_t pixel = (size_t)at->y_px * a->width_px + at->x_px;
    struct bd_area_light_found sum = {0};
    for (size_t r = i * rays; r < (i + 1) * rays; r++)
        if (!(a->occluded[r / 32] >> r % 32 & 1)) add_to(&sum, &a->found[r]);
    for (size_t l = i * lobes; l < (i + 1) * lobes; l++) {
        if (!(a->lobes[l].density > 0)) continue;
        const struct bd_area_light_found more =
            bd_area_lobe_light(&a->sampling, at, &a->shares[i], &a->lobes[l], &a->hits[*ray]);
        const f3 passed = a->passed[(*ray)++];
        add_to(&sum, &(struct bd_area_light_found){f3_mul(more.irradiance, passed),
                                                   f3_mul(more.beyond, passed)});
    }
    keep(a->irradiance[half], pixel, sum.irradiance);
    keep(a->beyond[half], pixel, sum.beyond);
}

static void sum_group(void *user, uint32_t group)
{
    const struct area *a = user;
    size_t ray = a->first_ray[group];
    for (uint32_t lane = 0; lane < BD_LANES; lane++) {
        struct bd_area_receiver at;
        if (!bd_lobe_receiver_at(a->part, group, lane, &at)) continue;
        for (uint32_t half = 0; half < HALVES; half++)
            sum_half(a, &at, ((size_t)group * BD_LANES + lane) * HALVES + half, half, &ray);
    }
}

static enum bd_err light_by_areas(struct area *a)
{
    const struct bd_receiver_part *part = a->part;
    struct bd_ray_counts traced = {0};
    const double rays = (double)BD_LANES * HALVES * (a->sampling.rays + a->sampling.lobes);
    enum bd_err err = make_room(a, part->group_count);
    bd_slicer_work(a->context.slicer, "area sample");
    if (!err)
        err = bd_receivers_each(&a->context, part->group_count, UNITS_PER_RAY * rays, sample_group,
                                a);
    if (!err) err = follow_lobes(a);
    if (!err)
        err = bd_straight_ask(&a->context, &a->inputs->visibility, a->segments,
                              (size_t)part->group_count * BD_LANES * HALVES * a->sampling.rays,
                              a->occluded, &a->found->irradiance, BD_AREA_LIGHT_PARTS, &traced,
                              a->detail);
    bd_slicer_work(a->context.slicer, "area sum");
    if (!err) err = bd_receivers_each(&a->context, part->group_count, rays, sum_group, a);
    return err;
}

// --- punctual lights -----------------------------------------------------------------------------

static f3 pixel_of(const struct bd_image *image, size_t pixel)
{
    return f3_of(image->pixels[3 * pixel], image->pixels[3 * pixel + 1],
                 image->pixels[3 * pixel + 2]);
}

static void add_to_pixel(const struct area *a, const struct bd_area_receiver *at,
                         const struct bd_area_light_found halves[HALVES])
{
    const size_t pixel = (size_t)at->y_px * a->width_px + at->x_px;
    for (uint32_t h = 0; h < HALVES; h++) {
        struct bd_image *irradiance = a->irradiance[h], *beyond = a->beyond[h];
        keep(irradiance, pixel, f3_add(pixel_of(irradiance, pixel), halves[h].irradiance));
        keep(beyond, pixel, f3_add(pixel_of(beyond, pixel), halves[h].beyond));
    }
}

static uint32_t blocks_across(const struct area *a)
{
    return (a->part->slice.tile.width + BLOCK_SIDE - 1) / BLOCK_SIDE;
}

static void light_block(void *user, uint32_t block)
{
    const struct area *a = user;
    const struct bd_tile *tile = &a->part->slice.tile;
    const uint32_t left = block % blocks_across(a) * BLOCK_SIDE;
    const uint32_t top = block / blocks_across(a) * BLOCK_SIDE;
    struct bd_area_receiver at[BD_PUNCTUAL_BLOCK] = {0};
    struct bd_area_light_found halves[BD_PUNCTUAL_BLOCK][HALVES] = {0};
    uint32_t count = 0;
    for (uint32_t y = top; y < top + BLOCK_SIDE && y < tile->height; y++)
        for (uint32_t x = left; x < left + BLOCK_SIDE && x < tile->width; x++) {
            const uint32_t index = y * tile->width + x;
            count += bd_lobe_receiver_at(a->part, index / BD_LANES, index % BD_LANES, &at[count]);
        }
    bd_punctual_light_block(&a->punctuals, at, count, halves);
    for (uint32_t i = 0; i < count; i++) add_to_pixel(a, &at[i], halves[i]);
}

static enum bd_err light_by_punctuals(struct area *a)
{
    const uint32_t down = (a->part->slice.tile.height + BLOCK_SIDE - 1) / BLOCK_SIDE;
    const double units =
        BD_PUNCTUAL_BLOCK * (UNITS_PER_LIT + UNITS_PER_PUNCTUAL_RAY * (double)a->punctuals.rays);
    bd_slicer_work(a->context.slicer, "lamps");
    return bd_receivers_each(&a->context, blocks_across(a) * down, units, light_block, a);
}

static enum bd_err light_part(void *user, const struct bd_receiver_part *part)
{
    struct area *a = user;
    a->part = part;
    enum bd_err err = bd_receivers_each(&a->context, part->group_count, BD_LANES, see_group, a);
    if (!err && a->inputs->lights) err = light_by_areas(a);
    if (!err && a->inputs->punctuals) err = light_by_punctuals(a);
    return err;
}

// --- the picture --------------------------------------------------------------------------------

// The mean of both halves, into the first.
static enum bd_err join(struct area *a, struct bd_image *half[HALVES], struct bd_image *doubt)
{
    const struct bd_light_filter_inputs inputs = {.half = {half[0], half[1]},
                                                  .normal = a->normal,
                                                  .depth = a->depth,
                                                  .level_count =
                                                      a->sampling.rays < FEW_RAYS ? 2 : 1,
                                                  .variance_part = a->inputs->variance_part};
    if (a->inputs->filtered)
        return bd_filter_halves(&a->context, a->processor.pool, &inputs, half[0], doubt, a->detail);
    const size_t count = 3 * (size_t)a->width_px * a->height_px;
    for (size_t i = 0; i < count; i++) {
        const float first = half[0]->pixels[i], other = half[1]->pixels[i];
        half[0]->pixels[i] = 0.5f * (first + other);
        doubt->pixels[4 * (i / 3) + i % 3] = 0.5f * (first - other);
    }
    return bd_slicer_pause(a->context.slicer);
}

static bool is_lit(const struct area *a, size_t pixel)
{
    const float *n = a->normal->pixels + 3 * pixel;
    return n[0] != 0 || n[1] != 0 || n[2] != 0;
}

static f3 direction_of(const struct bd_viewpoint *v, size_t pixel)
{
    const double x = (double)(pixel % v->width_px) + v->sample_x_px;
    const double y = (double)(pixel / v->width_px) + v->sample_y_px;
    const double right = v->orthographic ? 0 : v->half_width * (2 * x / v->width_px - 1);
    const double up = v->orthographic ? 0 : v->half_height * (1 - 2 * y / v->height_px);
    const bd_dvec3 to_side = bd_dvec3_scale(v->axis_x, right),
                   to_top = bd_dvec3_scale(v->axis_y, up);
    const bd_dvec3 d = bd_dvec3_sub(bd_dvec3_add(to_side, to_top), v->axis_z);
    return f3_unit(f3_of((float)d.x, (float)d.y, (float)d.z));
}

// Lobes take off what the diffuse one gives too much: never more than that, but for rounding.
static f3 light_of(const struct area *a, size_t pixel)
{
    float rgb[3];
    for (size_t c = 0; c < 3; c++) {
        const size_t at = 3 * pixel + c;
        const float diffuse = a->irradiance[0]->pixels[at] * a->albedo->pixels[at] / F_PI;
        rgb[c] = f_max(diffuse + a->beyond[0]->pixels[at], 0);
    }
    return f3_of(rgb[0], rgb[1], rgb[2]);
}

static void doubt_of(const struct area *a, size_t pixel, float out[4])
{
    const float *fallen = a->irradiance_doubt->pixels + 4 * pixel;
    const float *beyond = a->beyond_doubt->pixels + 4 * pixel;
    out[3] = beyond[3];
    for (size_t c = 0; c < 3; c++) {
        const float share = a->albedo->pixels[3 * pixel + c] / F_PI;
        out[c] = fallen[c] * share + beyond[c];
        out[3] += fallen[3] * share * share / 3;
    }
}

static f3 sky_of(const struct area *a, size_t pixel)
{
    const struct bd_area_lights *lights = a->inputs->lights;
    if (!lights || !lights->sky.shines) return f3_of(0, 0, 0);
    return f3_scale(bd_sky_light_radiance(&lights->sky, direction_of(a->inputs->viewpoint, pixel)),
                    a->sampling.from_cd_m2);
}

typedef void fill_rows_fn(const struct area *a, uint32_t first, uint32_t rows, float *rgba);

static void fill_radiance(const struct area *a, uint32_t first, uint32_t rows, float *rgba)
{
    const size_t from = (size_t)first * a->width_px, count = (size_t)rows * a->width_px;
    for (size_t i = 0; i < count; i++) {
        const bool lit = is_lit(a, from + i);
        const f3 rgb = lit ? light_of(a, from + i) : sky_of(a, from + i);
        memcpy(rgba + 4 * i, &rgb, sizeof rgb);
        rgba[4 * i + 3] = lit;
    }
}

static void fill_doubt(const struct area *a, uint32_t first, uint32_t rows, float *rgba)
{
    const size_t from = (size_t)first * a->width_px, count = (size_t)rows * a->width_px;
    memset(rgba, 0, 4 * count * sizeof *rgba);
    for (size_t i = 0; i < count; i++)
        if (is_lit(a, from + i)) doubt_of(a, from + i, rgba + 4 * i);
}

static void fill_irradiance(const struct area *a, uint32_t first, uint32_t rows, float *rgba)
{
    const size_t from = (size_t)first * a->width_px, count = (size_t)rows * a->width_px;
    for (size_t i = 0; i < count; i++) {
        const bool lit = is_lit(a, from + i);
        const f3 rgb = lit ? pixel_of(a->irradiance[0], from + i) : f3_of(0, 0, 0);
        memcpy(rgba + 4 * i, &rgb, sizeof rgb);
        rgba[4 * i + 3] = lit;
    }
}

static enum bd_err write(struct area *a, fill_rows_fn *fill_rows, struct bd_tex *tex)
{
    enum bd_err err = BD_ERR_OK;
    bd_slicer_work(a->context.slicer, "filter write");
    for (uint32_t row = 0, rows; !err && row < a->height_px; row += rows) {
        rows = bd_slicer_rows(a->context.slicer, a->width_px, a->height_px - row);
        const size_t bytes = (size_t)rows * a->width_px * 4 * sizeof(float);
        float *rgba = malloc(bytes);
        BD_ASSERT(rgba);
        fill_rows(a, row, rows, rgba);
        bd_tex_upload_rows(a->context.gpu, tex, 0, row, rows, rgba, bytes);
        free(rgba);
        err = bd_slicer_checkpoint(a->context.slicer, (double)a->width_px * rows);
    }
    return err;
}

static enum bd_err light_all(struct area *a)
{
    const struct bd_area_direct_inputs *inputs = a->inputs;
    const struct bd_receivers_inputs receivers = {
        .askers = {.viewpoint = inputs->viewpoint,
                   .space = &inputs->scene->space,
                   .gbuffer = inputs->gbuffer},
        .glossy = true,
        .starts = true,
        .receivers_max = receivers_at_once(a),
        .light = light_part,
        .user = a,
    };
    enum bd_err err = make_images(a);
    if (!err) err = bd_receivers_run(&a->context, &receivers, a->detail);
    if (!err) err = join(a, a->irradiance, a->irradiance_doubt);
    if (!err) err = join(a, a->beyond, a->beyond_doubt);
    return err;
}

static struct area area_of(const struct bd_pass_context *context,
                           const struct bd_area_direct_inputs *inputs, struct bd_err_detail *detail)
{
    const struct bd_render_space *space = &inputs->scene->space;
    const struct bd_viewpoint *viewpoint = inputs->viewpoint;
    struct area a = {
        .context = *context,
        .processor = {inputs->visibility.pool, NULL},
        .inputs = inputs,
        .sampling = bd_area_sampling_of(inputs->lights, inputs->rays, inputs->seed),
        .punctuals = {.punctuals = inputs->punctuals,
                      .visibility = &inputs->visibility,
                      .rays = inputs->rays,
                      .lambert = inputs->lambert},
        .width_px = viewpoint->width_px,
        .height_px = viewpoint->height_px,
        .eye = bd_render_from_world(space, viewpoint->position_m),
        .detail = detail,
    };
    a.sampling.reach = 1.01f * (float)space->radius;
    a.sampling.from_cd_m2 = (float)(1 / space->unit_cd_m2);
    a.sampling.lambert = inputs->lambert;
    a.punctuals.seed = a.sampling.seed;
    return a;
}

// A texture, black where nothing shines.
static enum bd_err make(struct area *a, const char *name, bool shines, fill_rows_fn *fill_rows,
                        struct bd_tex **out)
{
    const struct bd_tex_desc desc = {.name = name,
                                     .format = BD_FORMAT_RGBA32F,
                                     .width_px = a->width_px,
                                     .height_px = a->height_px};
    enum bd_err err = bd_tex_create(a->context.gpu, &desc, out, a->detail);
    if (!err && shines) return write(a, fill_rows, *out);
    if (!err) bd_tex_clear(a->context.gpu, *out, (const float[4]){0});
    return err;
}

enum bd_err bd_area_direct_run(const struct bd_pass_context *context,
                               const struct bd_area_direct_inputs *inputs,
                               struct bd_area_direct **out, struct bd_err_detail *detail)
{
    struct area a = area_of(context, inputs, detail);
    const bool shines =
        inputs->punctuals || (inputs->lights && bd_area_lights_shine(inputs->lights));
    struct bd_area_direct *light = *out = calloc(1, sizeof *light);
    BD_ASSERT(light);
    a.context.processor = &a.processor;
    enum bd_err err = shines ? light_all(&a) : BD_ERR_OK;
    if (!err) err = make(&a, "light of areas", shines, fill_radiance, &light->radiance);
    if (!err) err = make(&a, "doubt of light of areas", shines, fill_doubt, &light->doubt);
    if (!err && inputs->irradiance)
        err = make(&a, "irradiance of areas", shines, fill_irradiance, &light->irradiance);
    free_all(&a);
    if (err) bd_area_direct_destroy(context->gpu, out);
    return err;
}

void bd_area_direct_destroy(struct bd_gpu *gpu, struct bd_area_direct **light)
{
    if (!*light) return;
    bd_tex_destroy(gpu, &(*light)->radiance);
    bd_tex_destroy(gpu, &(*light)->doubt);
    bd_tex_destroy(gpu, &(*light)->irradiance);
    free(*light);
    *light = NULL;
}

uint64_t bd_area_direct_bytes(const struct bd_area_direct *light)
{
    return bd_tex_bytes(light->radiance) + bd_tex_bytes(light->doubt) +
           (light->irradiance ? bd_tex_bytes(light->irradiance) : 0);
}
