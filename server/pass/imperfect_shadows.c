#include "pass/imperfect_shadows.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/hash.h"
#include "base/pool.h"
#include "kernel/choice.h"
#include "kernel/imperfect_shadow.h"
#include "kernel/lift.h"
#include "pass/f3_arrays.h"
#include "pass/kernels.h"
#include "pass/native/native.h"
#include "pass/receivers.h"
#include "shared/bindings.h"
#include "shared/vpl.h"

_Static_assert(BD_SHADOW_POINTS_MAX <= DISKS_MOST, "a key has a disk's number");

// Of the slicer: a point of a map, by either.
#define UNITS_PER_POINT 8.0

// --- which maps ---------------------------------------------------------------------------------

uint32_t bd_shadow_map_side_of(uint32_t side, uint32_t map_count)
{
    while (side > BD_SHADOW_MAP_SIDE_MIN &&
           (size_t)side * side * map_count * sizeof(uint32_t) > BD_SHADOW_MAPS_BYTES_MAX)
        side /= 2;
    return side > BD_SHADOW_MAP_SIDE_MIN ? side : BD_SHADOW_MAP_SIDE_MIN;
}

static uint32_t number_maps(const struct bd_imperfect_shadows_inputs *inputs, uint32_t vpls_each,
                            struct bd_shadow_maps_of_list *lists)
{
    uint32_t count = 0;
    for (uint32_t l = 0; l < inputs->list_count; l++) {
        lists[l] = (struct bd_shadow_maps_of_list){count, vpls_each};
        count += bd_divided_up(inputs->lists[l]->count, vpls_each);
    }
    return count;
}

// As few VPLs a map as leave no more maps than there may be; neighbours of a list share one.
#define VPLS_EACH_MAX 4096u

static void share_maps(const struct bd_imperfect_shadows_inputs *inputs,
                       struct bd_imperfect_shadows *s)
{
    uint32_t each = 1;
    while ((s->count = number_maps(inputs, each, s->lists)) > BD_SHADOW_MAPS_MAX &&
           each < VPLS_EACH_MAX)
        each++;
}

struct bd_shadow_maps_of_list bd_imperfect_maps_of(const struct bd_imperfect_view *view,
                                                   const struct bd_vpl_list *list)
{
    for (uint32_t l = 0; view && l < view->shadows->list_count; l++)
        if (view->lists[l] == list) return view->shadows->lists[l];
    return (struct bd_shadow_maps_of_list){0};
}

// --- where they look from -----------------------------------------------------------------------

static f3 across_of(f3 n)
{
    const f3 axis = f_abs(n.x) < 0.6f ? f3_of(1, 0, 0) : f3_of(0, 1, 0);
    return f3_unit(f3_cross(axis, n));
}

static bool sends(const struct bd_vec4 *vpl)
{
    return vpl[2].x > 0 || vpl[2].y > 0 || vpl[2].z > 0;
}

// Lifted off the surface that it stands for, which does not hide it.
static struct bd_shadow_centre centre_of(const struct bd_vec4 *vpl, const struct bd_vec4 *quad,
                                         uint32_t first)
{
    const f3 normal = f3_from(vpl + 1), across = across_of(normal);
    const f3 end = end_of_segment(f3_from(vpl), f3_from(quad), f3_from(quad + 1), quad->w, vpl[2].w,
                                  quad[1].w);
    const f3 place = f3_add(end, f3_scale(normal, lift_of_segment(0, end, end)));
    return (struct bd_shadow_centre){{place.x, place.y, place.z, (float)first},
                                     {normal.x, normal.y, normal.z, 1},
                                     {across.x, across.y, across.z, 0}};
}

// Of those that share a map the middle one, or the next that sends anything.
static uint32_t middle_of(const struct bd_vec4 *vpls, uint32_t first, uint32_t end)
{
    const uint32_t count = end - first;
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t at = first + (count / 2 + i) % count;
        if (sends(vpls + (size_t)at * BD_VPL_VEC4S)) return at;
    }
    return end;
}

static void find_centres(const struct bd_vec4 *vpls, const struct bd_vec4 *quads, uint32_t count,
                         const struct bd_shadow_maps_of_list *of, uint32_t per_set,
                         struct bd_shadow_centre *centres)
{
    for (uint32_t at = 0, map = of->first; at < count; at += of->vpls_each, map++) {
        const uint32_t end = count - at < of->vpls_each ? count : at + of->vpls_each;
        const uint32_t middle = middle_of(vpls, at, end);
        const uint32_t set = (uint32_t)(bd_hash64(&map, sizeof map, 0) % BD_SURFACE_POINT_SETS);
        if (middle < end)
            centres[map] = centre_of(vpls + (size_t)middle * BD_VPL_VEC4S,
                                     quads + (size_t)middle * BD_VPL_QUAD_VEC4S, set * per_set);
    }
}

static enum bd_err read_list(const struct bd_pass_context *context, const struct bd_vpl_list *list,
                             const struct bd_shadow_maps_of_list *of,
                             struct bd_imperfect_shadows *s, struct bd_err_detail *detail)
{
    const size_t vpl_bytes = (size_t)list->count * BD_VPL_VEC4S * sizeof(struct bd_vec4);
    const size_t quad_bytes = (size_t)list->count * BD_VPL_QUAD_VEC4S * sizeof(struct bd_vec4);
    if (list->count == 0) return BD_ERR_OK;
    struct bd_vec4 *vpls = malloc(vpl_bytes), *quads = malloc(quad_bytes);
    enum bd_err err = BD_ERR_OK;
    if (!vpls || !quads)
        err = bd_err_set(detail, BD_ERR_NO_MEMORY, "vpls", "no memory for %u", list->count);
    if (!err) err = bd_buf_read(context->gpu, list->vpls, 0, vpls, vpl_bytes);
    if (!err) err = bd_buf_read(context->gpu, list->quads, 0, quads, quad_bytes);
    if (!err) find_centres(vpls, quads, list->count, of, s->per_set, s->centres);
    free(vpls);
    free(quads);
    return err;
}

// --- by the processor ---------------------------------------------------------------------------

struct drawing {
    const struct bd_pass_context *context;
    const struct bd_shadow_points *points;
    struct bd_imperfect_shadows *shadows;
};

static void draw_map(void *user, uint32_t map)
{
    const struct drawing *d = user;
    const struct bd_imperfect_shadows *s = d->shadows;
    const struct bd_shadow_centre *centre = &s->centres[map];
    const size_t texels = (size_t)s->side_px * s->side_px;
    const struct bd_native_shadow shadow = {
        .centre = centre,
        .points = d->points->points + u_of(centre->place_first.w),
        .count = s->per_set,
        .side_px = s->side_px,
    };
    memset(s->maps + map * texels, 0xff, texels * sizeof *s->maps);
    if (centre->normal_there.w > 0)
        d->context->processor->loops->shadow(&shadow, s->maps + map * texels);
}

// --- by the device ------------------------------------------------------------------------------

static struct bd_imperfect_args args_of(const struct bd_imperfect_shadows *s)
{
    return (struct bd_imperfect_args){.side = s->side_px, .points = s->per_set};
}

static void bind(const struct bd_imperfect_shadows *s, const struct bd_shadow_points *points,
                 const struct bd_imperfect_args *args, struct bd_bindings *bindings)
{
    bd_bind_storage(bindings, BD_STORAGE_SHADOW_POINTS, points->buf, true, false);
    bd_bind_storage(bindings, BD_STORAGE_SHADOW_CENTRES, s->centre_buf, true, false);
    bd_bind_storage(bindings, BD_STORAGE_SHADOW_TEXELS, s->texels, true, true);
    bindings->uniforms[BD_UNIFORM_ARGS].bytes = args;
    bindings->uniforms[BD_UNIFORM_ARGS].size_bytes = sizeof *args;
}

static enum bd_err make_buffers(const struct bd_pass_context *context,
                                struct bd_imperfect_shadows *s, struct bd_err_detail *detail)
{
    const size_t texels = (size_t)s->side_px * s->side_px * s->count;
    enum bd_err err = bd_buf_create(context->gpu, "shadow centres", s->count * sizeof *s->centres,
                                    s->centres, &s->centre_buf, detail);
    if (!err)
        err = bd_buf_create_unset(context->gpu, "imperfect shadows", texels * sizeof *s->maps,
                                  &s->texels, detail);
    return err;
}

// Nothing there, then the points: a slice of maps after the other.
static enum bd_err draw_by_device(const struct bd_pass_context *context,
                                  const struct bd_shadow_points *points,
                                  struct bd_imperfect_shadows *s, struct bd_err_detail *detail)
{
    const struct bd_program *clear, *draw;
    struct bd_imperfect_args args = args_of(s);
    struct bd_gpu *gpu = context->gpu;
    const uint32_t texels = s->side_px * s->side_px;
    enum bd_err err = make_buffers(context, s, detail);
    if (!err) err = bd_compute_get(gpu, "pass/imperfect_shadows/clear.comp", NULL, &clear, detail);
    if (!err) err = bd_compute_get(gpu, "pass/imperfect_shadows/draw.comp", NULL, &draw, detail);
    bd_slicer_work(context->slicer, "imperfect shadows");
    for (uint32_t at = 0, maps; !err && at < s->count; at += maps) {
        const double units = UNITS_PER_POINT * s->per_set;
        struct bd_bindings bindings = {0};
        maps = bd_list_slice(context->slicer, units, s->count - at);
        args.first_map = at;
        bind(s, points, &args, &bindings);
        bd_gpu_dispatch(gpu, clear, &bindings, bd_divided_up(texels, BD_LIST_GROUP), maps, 1);
        bd_gpu_dispatch(gpu, draw, &bindings, bd_divided_up(s->per_set, BD_LIST_GROUP), maps, 1);
        err = bd_slicer_checkpoint(context->slicer, units * maps);
    }
    return err;
}

// --- all ----------------------------------------------------------------------------------------

static enum bd_err make_room(struct bd_imperfect_shadows *s, bool draws,
                             struct bd_err_detail *detail)
{
    const size_t texels = (size_t)s->side_px * s->side_px * s->count;
    s->centres = calloc(s->count + 1, sizeof *s->centres);
    if (draws) s->maps = malloc(texels * sizeof *s->maps + 1);
    if (s->centres && (s->maps || !draws)) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_NO_MEMORY, "ism_size", "no memory for %u maps", s->count);
}

static enum bd_err make(const struct bd_pass_context *context,
                        const struct bd_imperfect_shadows_inputs *inputs,
                        struct bd_imperfect_shadows *s, struct bd_err_detail *detail)
{
    struct drawing drawing = {context, inputs->points, s};
    const bool draws = context->processor != NULL;
    s->side_px = bd_shadow_map_side_of(inputs->side_px, s->count);
    enum bd_err err = make_room(s, draws, detail);
    for (uint32_t l = 0; !err && l < inputs->list_count; l++)
        err = read_list(context, inputs->lists[l], &s->lists[l], s, detail);
    if (err || s->count == 0 || s->per_set == 0) return err;
    if (!draws) return draw_by_device(context, inputs->points, s, detail);
    bd_slicer_work(context->slicer, "native shadows");
    return bd_receivers_each(context, s->count, UNITS_PER_POINT * s->per_set, draw_map, &drawing);
}

enum bd_err bd_imperfect_shadows_run(const struct bd_pass_context *context,
                                     const struct bd_imperfect_shadows_inputs *inputs,
                                     struct bd_imperfect_shadows **out,
                                     struct bd_err_detail *detail)
{
    struct bd_imperfect_shadows *s = *out = calloc(1, sizeof *s);
    BD_ASSERT(s);
    s->per_set = inputs->points->per_set;
    s->list_count = inputs->list_count;
    s->lists = calloc(inputs->list_count + 1, sizeof *s->lists);
    BD_ASSERT(s->lists);
    share_maps(inputs, s);
    enum bd_err err = make(context, inputs, s, detail);
    if (err) bd_imperfect_shadows_destroy(context->gpu, out);
    return err;
}

void bd_imperfect_shadows_destroy(struct bd_gpu *gpu, struct bd_imperfect_shadows **shadows)
{
    struct bd_imperfect_shadows *s = *shadows;
    *shadows = NULL;
    if (!s) return;
    bd_buf_destroy(gpu, &s->centre_buf);
    bd_buf_destroy(gpu, &s->texels);
    free(s->lists);
    free(s->centres);
    free(s->maps);
    free(s);
}

uint64_t bd_imperfect_shadows_bytes(const struct bd_imperfect_shadows *shadows)
{
    const uint64_t texels = (uint64_t)shadows->side_px * shadows->side_px;
    return shadows->count * (texels * sizeof *shadows->maps + sizeof *shadows->centres);
}

// --- answers ------------------------------------------------------------------------------------

// What a texel says; -1 where no disk is there.
static int say(const struct bd_imperfect_view *view, const struct bd_shadow_centre *centre,
               const uint32_t *map, uint32_t u, uint32_t v, f3 to, f3 normal)
{
    const uint32_t key = map[v * view->shadows->side_px + u];
    if (key == NO_DISK) return -1;
    const size_t at = u_of(centre->place_first.w) + (key & DISKS_MOST);
    const struct bd_shadow_point *point = &view->points->points[at];
    return hides(f3_sub(f3_from(&point->place), f3_from(&centre->place_first)),
                 f3_from(&point->normal_radius2), point->normal_radius2.w, to, normal, view->bias);
}

// What most of the four beside it say.
static int say_around(const struct bd_imperfect_view *view, const struct bd_shadow_centre *centre,
                      const uint32_t *map, uint32_t u, uint32_t v, f3 to, f3 normal)
{
    const uint32_t side = view->shadows->side_px;
    int hidden = 0, asked = 0;
    for (uint32_t i = 1; i < 9; i += 2) {
        const uint32_t at_u = u + i % 3 - 1, at_v = v + i / 3 - 1;
        if (at_u >= side || at_v >= side) continue;
        const int said = say(view, centre, map, at_u, at_v, to, normal);
        asked += said >= 0;
        hidden += said > 0;
    }
    return 2 * hidden > asked;
}

static uint32_t held_texel(float place, uint32_t side)
{
    const float at = f_min(f_max(texel_of_place(place, (float)side), 0), (float)(side - 1));
    return u_of(at);
}

static bool is_hidden(const struct bd_imperfect_view *view, const struct bd_segment *segment)
{
    const struct bd_imperfect_shadows *s = view->shadows;
    if (segment->to_triangle >= s->count || s->per_set == 0) return false;
    const struct bd_shadow_centre *centre = &s->centres[segment->to_triangle];
    const f3 up = f3_from(&centre->normal_there), across = f3_from(&centre->across);
    const f3 normal = f3_of(segment->to[0], segment->to[1], segment->to[2]);
    const f3 from = f3_of(segment->from[0], segment->from[1], segment->from[2]);
    const f3 to = f3_sub(from, f3_from(&centre->place_first));
    const f3 way = in_axes(to, across, f3_cross(up, across), up);
    if (!(way.z > 0)) return false;
    const f3 place = place_of_way(way);
    const uint32_t *map = s->maps + (size_t)segment->to_triangle * s->side_px * s->side_px;
    const uint32_t u = held_texel(place.x, s->side_px), v = held_texel(place.y, s->side_px);
    const int said = say(view, centre, map, u, v, to, normal);
    return said < 0 && view->filled ? say_around(view, centre, map, u, v, to, normal) : said > 0;
}

struct asking {
    const struct bd_imperfect_view *view;
    const struct bd_segment *segments;
    size_t count;
    uint32_t *occluded;
};

#define WORDS_AT_ONCE 256u

static void answer(void *user, uint32_t part)
{
    const struct asking *a = user;
    const size_t words = (a->count + 31) / 32, first = (size_t)part * WORDS_AT_ONCE;
    for (size_t word = first; word < words && word < first + WORDS_AT_ONCE; word++) {
        uint32_t bits = 0;
        for (size_t i = 0; i < 32 && word * 32 + i < a->count; i++)
            bits |= (uint32_t)is_hidden(a->view, &a->segments[word * 32 + i]) << i;
        a->occluded[word] = bits;
    }
}

void bd_imperfect_ask(const struct bd_imperfect_view *view, struct bd_pool *pool,
                      const struct bd_segment *segments, size_t count, uint32_t *occluded)
{
    struct asking asking = {view, segments, count, occluded};
    const uint32_t parts = bd_divided_up((uint32_t)((count + 31) / 32), WORDS_AT_ONCE);
    const enum bd_err err = bd_pool_run(pool, parts, answer, NULL, &asking);
    BD_ASSERT(!err);
}

enum bd_err bd_imperfect_ask_device(const struct bd_pass_context *context,
                                    const struct bd_imperfect_view *view, struct bd_buf *segments,
                                    struct bd_buf *occluded, size_t first, size_t count,
                                    struct bd_err_detail *detail)
{
    const struct bd_imperfect_shadows *s = view->shadows;
    const struct bd_program *program;
    struct bd_imperfect_args args = args_of(s);
    struct bd_bindings bindings = {0};
    enum bd_err err =
        bd_compute_get(context->gpu, "pass/visibility/imperfect.comp", NULL, &program, detail);
    if (err) return err;
    args.first_segment = (uint32_t)first;
    args.end_segment = (uint32_t)(first + count);
    args.bias = view->bias;
    args.fills = view->filled;
    bind(s, view->points, &args, &bindings);
    bd_bind_storage(&bindings, BD_STORAGE_SEGMENTS, segments, true, false);
    bd_bind_storage(&bindings, BD_STORAGE_OCCLUDED, occluded, false, true);
    bd_gpu_dispatch(context->gpu, program, &bindings, bd_divided_up((uint32_t)count, BD_LIST_GROUP),
                    1, 1);
    return BD_ERR_OK;
}
