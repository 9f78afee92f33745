#include "pass/scene_points.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/huge_pages.h"
#include "pass/scene_material.h"
#include "shared/bindings.h"
#include "shared/instance.h"
#include "upload/seen.h"

#define POINTS_PER_PIECE 128u
#define POINTS_MAX       (1u << 16) // of a slice
#define PIXELS_PER_PAUSE (1u << 14)
#define ROW_FLOATS       (4 * BD_INSTANCE_VEC4S)
// Draws of a slice; each is a binding of everything.
#define DRAWS_MAX 64u

// A vertex, as shaders/pass/gbuffer/scene.vert reads it of points.
struct point {
    float position[3];           // relative to the viewpoint, in its axes
    float normal[3], tangent[4]; // in the mesh's space, of a length that makes its corners' one
    float uv[2][2], color[4];
    uint32_t instance[2]; // place in the view's array; triangles behind the run's first
    uint32_t pixel[2];
};

// Pixels that see something, grouped by the run of what they see, row by row in each.
struct point_order {
    uint32_t *numbers; // of all pixels
    uint32_t *pixels;
    uint32_t *run_ends; // of each run, in `pixels`
    uint32_t count;
};

static void finish_order(struct point_order *order)
{
    free(order->numbers);
    free(order->pixels);
    free(order->run_ends);
}

static enum bd_err make_room(const struct bd_scene_draws *draws, struct point_order *order,
                             struct bd_err_detail *detail)
{
    const size_t pixels = (size_t)draws->viewpoint->width_px * draws->viewpoint->height_px;
    const size_t runs = (size_t)draws->scene->order.run_count + 1;
    *order = (struct point_order){.numbers = bd_huge_pages_alloc(pixels * sizeof *order->numbers),
                                  .pixels = bd_huge_pages_alloc(pixels * sizeof *order->pixels),
                                  .run_ends = calloc(runs, sizeof *order->run_ends)};
    if (order->numbers && order->pixels && order->run_ends) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_NO_MEMORY, "size", "no memory for what %zu pixels see",
                      pixels);
}

// Calls `each` for all pixels that see something, with the run of what they see.
static enum bd_err for_each(const struct bd_scene_draws *draws, struct point_order *order,
                            struct bd_slicer *slicer,
                            void (*each)(struct point_order *order, uint32_t run, uint32_t pixel))
{
    const uint64_t pixels = (uint64_t)draws->viewpoint->width_px * draws->viewpoint->height_px;
    enum bd_err err = BD_ERR_OK;
    for (uint64_t p = 0; !err && p < pixels; p++) {
        const uint32_t number = order->numbers[p];
        if (number != BD_NO_TRIANGLE)
            each(order, bd_triangle_order_run(&draws->scene->order, number), (uint32_t)p);
        if (p % PIXELS_PER_PAUSE == 0) err = bd_slicer_pause(slicer);
    }
    return err;
}

static void count_pixel(struct point_order *order, uint32_t run, uint32_t pixel)
{
    (void)pixel;
    order->run_ends[run]++;
    order->count++;
}

static void place_pixel(struct point_order *order, uint32_t run, uint32_t pixel)
{
    order->pixels[order->run_ends[run]++] = pixel;
}

static enum bd_err group(const struct bd_scene_draws *draws, struct point_order *order,
                         struct bd_slicer *slicer)
{
    enum bd_err err = for_each(draws, order, slicer, count_pixel);
    uint32_t begin = 0;
    for (uint32_t r = 0; r < draws->scene->order.run_count; r++) {
        const uint32_t count = order->run_ends[r];
        order->run_ends[r] = begin;
        begin += count;
    }
    return err ? err : for_each(draws, order, slicer, place_pixel);
}

// --- a point ----------------------------------------------------------------------------------

// A slice of points.
struct points {
    const struct bd_scene_draws *draws;
    const struct bd_seen *seen;
    const struct point_order *order;
    uint32_t first, count;
    struct point *points;
};

static double clamped(double x, double most)
{
    return x > 0 ? fmin(x, most) : 0; // no number: 0
}

static bd_dvec3 in_view(const struct bd_viewpoint *v, double scale, bd_dvec3 world)
{
    const bd_dvec3 d = bd_dvec3_sub(world, v->position_m);
    return bd_dvec3_scale((bd_dvec3){bd_dvec3_dot(v->axis_x, d), bd_dvec3_dot(v->axis_y, d),
                                     bd_dvec3_dot(v->axis_z, d)},
                          scale);
}

// Where the pixel's ray meets the triangle's plane: shares of the corners, held to the triangle,
// and the place on the ray. In double precision, relative to the viewpoint, as what is drawn is.
static void intersect(const struct bd_sample_ray *ray, const bd_dvec3 corner[3], double shares[3],
                      float position[3])
{
    const bd_dvec3 from = {ray->origin[0], ray->origin[1], ray->origin[2]};
    const bd_dvec3 along = {ray->direction[0], ray->direction[1], ray->direction[2]};
    const bd_dvec3 e1 = bd_dvec3_sub(corner[1], corner[0]), e2 = bd_dvec3_sub(corner[2], corner[0]);
    const bd_dvec3 s = bd_dvec3_sub(from, corner[0]);
    const bd_dvec3 p = bd_dvec3_cross(along, e2), q = bd_dvec3_cross(s, e1);
    const double determinant = bd_dvec3_dot(e1, p);
    shares[1] = clamped(bd_dvec3_dot(s, p) / determinant, 1);
    shares[2] = clamped(bd_dvec3_dot(along, q) / determinant, 1 - shares[1]);
    shares[0] = 1 - shares[1] - shares[2];
    const double depth = -(corner[0].z + shares[1] * e1.z + shares[2] * e2.z);
    for (int c = 0; c < 3; c++) position[c] = (float)(ray->origin[c] + ray->direction[c] * depth);
}

// `rows` of three columns and an offset that is not looked at.
static double length_by(const float *rows, const float v[3])
{
    double square = 0;
    for (int r = 0; r < 3; r++) {
        const double sum = (double)rows[4 * r] * v[0] + (double)rows[4 * r + 1] * v[1] +
                           (double)rows[4 * r + 2] * v[2];
        square += sum * sum;
    }
    return sqrt(square);
}

// Of directions that are made unit at the corners, once `rows` have turned them: so that turning
// what is interpolated gives what would be interpolated of what was turned.
static void mix_directions(const float *rows, const float *stream, uint32_t stride,
                           const uint32_t corner[3], const double shares[3], float out[3])
{
    double sum[3] = {0};
    for (int k = 0; k < 3; k++) {
        const float *v = stream + (size_t)stride * corner[k];
        const double length = length_by(rows, v);
        for (int c = 0; c < 3 && length > 0; c++) sum[c] += shares[k] / length * v[c];
    }
    for (int c = 0; c < 3; c++) out[c] = (float)sum[c];
}

static void mix(const float *stream, uint32_t components, const uint32_t corner[3],
                const double shares[3], float *out)
{
    for (uint32_t c = 0; stream && c < components; c++)
        out[c] = (float)(shares[0] * stream[(size_t)components * corner[0] + c] +
                         shares[1] * stream[(size_t)components * corner[1] + c] +
                         shares[2] * stream[(size_t)components * corner[2] + c]);
}

// In the view's array; its own place where bounds have left it out by a rounding: no point then.
static bool find_instance(const struct bd_seen *seen, uint32_t run, uint32_t place, uint32_t *out)
{
    const struct bd_seen_run *of = &seen->runs[run];
    uint32_t begin = of->first, end = of->first + of->count;
    while (end - begin > 1) {
        const uint32_t middle = begin + (end - begin) / 2;
        *(seen->instances[middle].place <= place ? &begin : &end) = middle;
    }
    *out = begin;
    return of->count > 0 && seen->instances[begin].place == place;
}

static void fill_surface(const struct bd_primitive *primitive, const float *rows,
                         const uint32_t corner[3], const double shares[3], struct point *to)
{
    mix_directions(rows + 12, primitive->normal, 3, corner, shares, to->normal);
    mix(primitive->color, 4, corner, shares, to->color);
    if (!primitive->tangent) return;
    mix(primitive->tangent, 4, corner, shares, to->tangent);
    mix_directions(rows, primitive->tangent, 4, corner, shares, to->tangent);
}

// What a pixel sees, as the scene has it.
struct seen_triangle {
    uint32_t run, place, behind; // triangles behind the run's first
    const struct bd_primitive *primitive;
    const uint32_t *corner;
};

static struct seen_triangle triangle_of(const struct points *batch, uint32_t pixel)
{
    const struct bd_gpu_scene *scene = batch->draws->scene;
    const uint32_t number = batch->order->numbers[pixel];
    const uint32_t r = bd_triangle_order_run(&scene->order, number);
    const struct bd_triangle_run *run = &scene->order.runs[r];
    const uint32_t behind = number - (uint32_t)run->first_triangle;
    const struct bd_primitive *primitive =
        &scene->scene->meshes[run->mesh]->primitives[run->primitive];
    return (struct seen_triangle){
        .run = r,
        .place = run->first_instance + behind / run->triangles_per_instance,
        .behind = behind,
        .primitive = primitive,
        .corner = primitive->index + 3 * (size_t)(behind % run->triangles_per_instance),
    };
}

static void place_corners(const struct points *batch, const struct seen_triangle *triangle,
                          bd_dvec3 corner[3])
{
    const struct bd_gpu_scene *scene = batch->draws->scene;
    const uint32_t instance = scene->order.instances[triangle->place];
    for (int k = 0; k < 3; k++) {
        const float *p = triangle->primitive->position + 3 * (size_t)triangle->corner[k];
        const bd_dvec3 world = bd_dmat4_point(&scene->scene->instances[instance].world_from_mesh,
                                              (bd_dvec3){p[0], p[1], p[2]});
        corner[k] = in_view(batch->draws->viewpoint, scene->space.render_per_m, world);
    }
}

// A point that is nowhere is outside of the picture.
static void fill_point(const struct points *batch, const struct seen_triangle *triangle,
                       uint32_t pixel, struct point *to)
{
    const struct bd_viewpoint *v = batch->draws->viewpoint;
    const struct bd_primitive *primitive = triangle->primitive;
    const uint32_t *corner = triangle->corner;
    *to = (struct point){.pixel = {UINT32_MAX, UINT32_MAX}};
    if (!find_instance(batch->seen, triangle->run, triangle->place, &to->instance[0])) return;
    to->instance[1] = triangle->behind;
    to->pixel[0] = pixel % v->width_px;
    to->pixel[1] = pixel / v->width_px;
    const struct bd_sample_ray ray =
        bd_sample_ray_of(v, &batch->draws->scene->space, to->pixel[0], to->pixel[1]);
    bd_dvec3 at[3];
    double shares[3];
    place_corners(batch, triangle, at);
    intersect(&ray, at, shares, to->position);
    mix(primitive->uv[0], 2, corner, shares, to->uv[0]);
    mix(primitive->uv[1], 2, corner, shares, to->uv[1]);
    const float *rows = batch->seen->rows + (size_t)to->instance[0] * ROW_FLOATS;
    fill_surface(primitive, rows, corner, shares, to);
}

// Of millions of triangles each comes from memory: those of a piece are on their way before the
// first is looked at, its corners' numbers and then what they name.
static void fill_points(void *user, uint32_t piece)
{
    struct points *batch = user;
    struct seen_triangle triangles[POINTS_PER_PIECE];
    const uint32_t begin = piece * POINTS_PER_PIECE, left = batch->count - begin;
    const uint32_t count = left < POINTS_PER_PIECE ? left : POINTS_PER_PIECE;
    const uint32_t *pixels = batch->order->pixels + batch->first + begin;
    for (uint32_t i = 0; i < count; i++) {
        triangles[i] = triangle_of(batch, pixels[i]);
        __builtin_prefetch(triangles[i].corner);
    }
    for (uint32_t i = 0; i < count; i++)
        for (int k = 0; k < 3; k++) {
            const size_t at = 3 * (size_t)triangles[i].corner[k];
            __builtin_prefetch(triangles[i].primitive->position + at);
            __builtin_prefetch(triangles[i].primitive->normal + at);
        }
    for (uint32_t i = 0; i < count; i++)
        fill_point(batch, &triangles[i], pixels[i], &batch->points[begin + i]);
}

// --- draws ------------------------------------------------------------------------------------

static void set_attributes(struct bd_attribute attributes[BD_ATTRIBUTE_MAX],
                           const struct bd_buf *points)
{
    static const struct {
        size_t offset;
        uint32_t count;
        bool is_uint;
    } layout[BD_ATTRIBUTE_MAX] = {
        [BD_STREAM_POSITION] = {offsetof(struct point, position), 3, false},
        [BD_STREAM_NORMAL] = {offsetof(struct point, normal), 3, false},
        [BD_STREAM_TANGENT] = {offsetof(struct point, tangent), 4, false},
        [BD_STREAM_UV0] = {offsetof(struct point, uv[0]), 2, false},
        [BD_STREAM_UV1] = {offsetof(struct point, uv[1]), 2, false},
        [BD_STREAM_COLOR] = {offsetof(struct point, color), 4, false},
        [BD_STREAM_COUNT] = {offsetof(struct point, instance), 2, true},
        [BD_STREAM_COUNT + 1] = {offsetof(struct point, pixel), 2, true},
    };
    for (uint32_t i = 0; i < BD_ATTRIBUTE_MAX; i++)
        attributes[i] = (struct bd_attribute){.buf = points,
                                              .offset_bytes = layout[i].offset,
                                              .stride_bytes = sizeof(struct point),
                                              .component_count = layout[i].count,
                                              .is_uint = layout[i].is_uint};
}

// Points of one run, from the `first` of the buffer's on.
static enum bd_err record_run(struct bd_gpu *gpu, const struct points *batch, uint32_t run,
                              const struct bd_buf *points, uint32_t first, uint32_t count,
                              struct bd_err_detail *detail)
{
    const struct bd_scene_draws *draws = batch->draws;
    const struct bd_scene_draw *draw = &draws->scene->draws[run];
    struct bd_program_source source = {
        .vertex = "pass/gbuffer/scene.vert",
        .fragment = draws->fragment,
        .defines = bd_material_defines(draws, draw),
    };
    const struct bd_material_uniform material = bd_material_uniform_of(draws, draw);
    const struct bd_view view = bd_viewpoint_uniform(draws->viewpoint, &draws->scene->space);
    struct bd_draw call = {
        .index_count = count,
        .base_vertex = (int32_t)first,
        .instance_count = 1,
        .topology = BD_TOPOLOGY_POINTS,
        .depth = BD_DRAW_DEPTH_IGNORE,
    };
    bd_define(&source.defines, "BD_POINTS", 1);
    enum bd_err err = bd_program_get(gpu, &source, (struct bd_program **)&call.program, detail);
    if (err) return err;
    call.bindings.arrays[BD_UNIT_INSTANCES] = batch->seen->array;
    call.bindings.arrays[BD_UNIT_SURFACE_TRIANGLES] = draws->scene->triangles;
    call.bindings.uniforms[BD_UNIFORM_VIEW].bytes = &view;
    call.bindings.uniforms[BD_UNIFORM_VIEW].size_bytes = sizeof view;
    call.bindings.uniforms[BD_UNIFORM_MATERIAL].bytes = &material;
    call.bindings.uniforms[BD_UNIFORM_MATERIAL].size_bytes = sizeof material;
    bd_material_bind_maps(&call.bindings, draws->scene, draw->material);
    set_attributes(call.attributes, points);
    bd_gpu_draw(gpu, &call);
    return BD_ERR_OK;
}

// The run that the points from `at` on are of, from `run` on.
static uint32_t run_at(const struct point_order *order, uint32_t run, uint32_t at)
{
    while (order->run_ends[run] <= at) run++;
    return run;
}

// How many points the slice has, of no more runs than it may.
static uint32_t points_that_fit(const struct point_order *order, const struct bd_slicer *slicer,
                                uint32_t run, uint32_t at)
{
    const uint32_t fit = (uint32_t)fmax(fmin(bd_slicer_units(slicer), POINTS_MAX), 1);
    uint32_t end = at;
    for (uint32_t d = 0; d < DRAWS_MAX && end < order->count && end - at < fit; d++) {
        run = run_at(order, run, end);
        end = order->run_ends[run];
    }
    return end - at < fit ? end - at : fit;
}

static enum bd_err record_slice(struct bd_gpu *gpu, struct points *batch, uint32_t run,
                                struct bd_slicer *slicer, struct bd_err_detail *detail)
{
    const uint32_t pieces = (batch->count + POINTS_PER_PIECE - 1) / POINTS_PER_PIECE;
    const uint32_t end = batch->first + batch->count;
    struct bd_buf *buf = NULL;
    enum bd_err err = bd_pool_run(batch->draws->tracer->pool, pieces, fill_points, NULL, batch);
    if (!err)
        err = bd_buf_create(gpu, "points", batch->count * sizeof *batch->points, batch->points,
                            &buf, detail);
    for (uint32_t at = batch->first; !err && at < end;) {
        run = run_at(batch->order, run, at);
        const uint32_t run_end =
            batch->order->run_ends[run] < end ? batch->order->run_ends[run] : end;
        err = record_run(gpu, batch, run, buf, at - batch->first, run_end - at, detail);
        at = run_end;
    }
    if (!err) err = bd_slicer_checkpoint(slicer, batch->count);
    bd_buf_destroy(gpu, &buf);
    return err;
}

static enum bd_err record_all(struct bd_gpu *gpu, const struct bd_scene_draws *draws,
                              const struct bd_seen *seen, const struct point_order *order,
                              struct bd_slicer *slicer, struct bd_err_detail *detail)
{
    struct points batch = {draws, seen, order, 0, 0, calloc(POINTS_MAX, sizeof(struct point))};
    BD_ASSERT(batch.points);
    bd_slicer_work(slicer, "points");
    enum bd_err err = BD_ERR_OK;
    for (uint32_t run = 0; !err && batch.first < order->count; batch.first += batch.count) {
        run = run_at(order, run, batch.first);
        batch.count = points_that_fit(order, slicer, run, batch.first);
        err = record_slice(gpu, &batch, run, slicer, detail);
    }
    free(batch.points);
    return err;
}

enum bd_err bd_scene_points_record(struct bd_gpu *gpu, const struct bd_scene_draws *draws,
                                   struct bd_slicer *slicer, struct bd_err_detail *detail)
{
    struct point_order order = {0};
    struct bd_seen seen = {0};
    enum bd_err err = make_room(draws, &order, detail);
    if (!err)
        err = bd_first_hits(draws->tracer, draws->viewpoint, &draws->scene->space,
                            draws->cull_single_sided, slicer, order.numbers);
    if (!err) err = group(draws, &order, slicer);
    if (!err)
        err = bd_seen_init(&seen, gpu, draws->scene, draws->viewpoint, bd_slicer_pause, slicer,
                           detail);
    if (!err) err = record_all(gpu, draws, &seen, &order, slicer, detail);
    bd_seen_finish(&seen, gpu);
    finish_order(&order);
    return err;
}
