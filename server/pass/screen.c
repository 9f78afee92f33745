#include "pass/screen.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "kernel/residual.h"
#include "kernel/sent.h"
#include "pass/f3_arrays.h"
#include "pass/lobe.h"
#include "pass/receivers.h"

// Of the slicer, one for each evaluation of a VPL: a part that is put together.
#define UNITS_PER_PART 10.0
// Parts that are so much longer than their area would be, if it were round, span a step in depth.
#define LONG 4.0f
// A pixel whose middle is nearer to a crease than this part of half a pixel is lifted by as much.
#define LIFTED 0.1f
// Of what both cover, a gap between two pixels that no surface fills.
#define TORN 1.0f

struct build {
    const struct bd_pass_context *context;
    const struct bd_gather_inputs *gather;
    struct bd_screen *screen;
    const struct bd_receiver_part *part;
    const float *irradiance;
    uint32_t level; // of the loop under way
    bool lambert, mirrors;
    float reach;
};

static struct bd_screen_part *part_at(const struct bd_screen *screen, uint32_t level, uint32_t x,
                                      uint32_t y)
{
    const struct bd_uvec4 *l = &screen->levels[level];
    return &screen->parts[l->z + (size_t)y * l->x + x];
}

static struct bd_vec4 vec4_of(f3 v, float w)
{
    return (struct bd_vec4){v.x, v.y, v.z, w};
}

// --- pixels -------------------------------------------------------------------------------------

// Half a pixel to the right and up, of a ray that is as long as to depth 1.
static f3 step_of(const struct build *b, bd_dvec3 axis, double half, uint32_t side_px)
{
    const bd_dvec3 step = bd_dvec3_scale(axis, half * b->screen->per_m / side_px);
    return f3_of((float)step.x, (float)step.y, (float)step.z);
}

// What a pixel covers if no other surface is there.
static void cover(const struct build *b, const struct bd_area_receiver *at,
                  struct bd_screen_patch *patch)
{
    const struct bd_viewpoint *v = b->gather->viewpoint;
    const f3 normal = at->normal_geometric, ray = f3_scale(at->viewer, -1);
    const bd_dvec3 to = {at->position.x - b->screen->eye.x, at->position.y - b->screen->eye.y,
                         at->position.z - b->screen->eye.z};
    const float depth = v->orthographic ? 1 : (float)-bd_dvec3_dot(to, v->axis_z);
    const f3 right = step_of(b, v->axis_x, v->half_width, v->width_px);
    const f3 up = step_of(b, v->axis_y, v->half_height, v->height_px);
    patch->u_part = vec4_of(f3_scale(side_of_pixel(ray, normal, right), depth),
                            part_of_grazing(f3_dot(normal, at->viewer)));
    patch->v = vec4_of(f3_scale(side_of_pixel(ray, normal, up), depth), 0);
}

static float part_sent(const struct build *b, const struct bd_area_receiver *at)
{
    return b->mirrors && at->roughness <= BD_BRUSHED_ROUGHNESS ? 1 - at->metallic : 1;
}

static void take_pixel(const struct build *b, const struct bd_area_receiver *at)
{
    struct bd_screen *s = b->screen;
    struct bd_screen_part *part = part_at(s, 0, at->x_px, at->y_px);
    const size_t pixel = (size_t)at->y_px * s->width_px + at->x_px;
    const f3 sends = b->lambert ? at->base_color
                                : sent_from_everywhere(at->base_color, at->metallic, at->roughness,
                                                       at->f0_dielectric);
    const float view = f_max(f3_dot(at->normal, at->viewer), 0);
    part->normal_radius = vec4_of(at->normal_geometric, 0);
    s->receivers[pixel] = (struct bd_screen_receiver){
        vec4_of(at->position, 1), vec4_of(at->normal, 0), vec4_of(at->normal_geometric, 0)};
    s->sends[pixel] = f3_scale(sends, part_sent(b, at) / F_PI);
    if (s->surfaces)
        s->surfaces[pixel] = (struct bd_screen_surface){
            vec4_of(at->viewer, at->has_lobe ? part_of_grazing(view) : 0),
            vec4_of(at->base_color, at->metallic),
            {at->roughness, at->f0_dielectric, 0, 0}};
    cover(b, at, &s->patches[pixel]);
}

static void take_group(void *user, uint32_t group)
{
    const struct build *b = user;
    for (uint32_t lane = 0; lane < BD_LANES; lane++) {
        struct bd_area_receiver at;
        if (bd_lobe_receiver_at(b->part, group, lane, &at)) take_pixel(b, &at);
    }
}

static enum bd_err take_part(void *user, const struct bd_receiver_part *part)
{
    struct build *b = user;
    b->part = part;
    bd_slicer_work(b->context->slicer, "screen");
    return bd_receivers_each(b->context, part->group_count, UNITS_PER_PART * BD_LANES, take_group,
                             b);
}

// --- what they cover ----------------------------------------------------------------------------

// How far it reaches towards the pixel beside it.
static float reach_towards(const struct bd_screen *s, uint32_t x, uint32_t y, int right, int down,
                           f3 half_side)
{
    const int64_t u = (int64_t)x + right, v = (int64_t)y + down;
    if (s->printed || u < 0 || v < 0 || u >= s->width_px || v >= s->height_px) return 1;
    const size_t here = (size_t)y * s->width_px + x, next = (size_t)v * s->width_px + (size_t)u;
    const struct bd_screen_receiver *own = &s->receivers[here], *other = &s->receivers[next];
    if (other->place_lit.w == 0) return 1;
    return reach_to_next(f3_from(&own->place_lit), f3_from(&own->normal_geometric), half_side,
                         f3_from(&other->place_lit), f3_from(&other->normal_geometric));
}

static void fit_pixel(const struct bd_screen *s, uint32_t x, uint32_t y)
{
    const size_t pixel = (size_t)y * s->width_px + x;
    struct bd_screen_patch *patch = &s->patches[pixel];
    const f3 u = f3_from(&patch->u_part), v = f3_from(&patch->v);
    const float right = reach_towards(s, x, y, 1, 0, u);
    const float left = reach_towards(s, x, y, -1, 0, f3_scale(u, -1));
    const float top = reach_towards(s, x, y, 0, -1, v);
    const float bottom = reach_towards(s, x, y, 0, 1, f3_scale(v, -1));
    const float least = f_min(f_min(right, left), f_min(top, bottom));
    const f3 off = f3_add(f3_scale(u, 0.5f * (right - left)), f3_scale(v, 0.5f * (top - bottom)));
    const f3 across = f3_scale(u, 0.5f * (right + left)),
             along = f3_scale(v, 0.5f * (top + bottom));
    const float covers = 4 * f3_length(f3_cross(across, along)), part = patch->u_part.w;
    struct bd_screen_part *own = &s->parts[pixel];
    own->middle_area = vec4_of(f3_add(f3_from(&s->receivers[pixel].place_lit), off), covers * part);
    own->normal_radius.w = f_max(f3_length(across), f3_length(along));
    patch->u_part = vec4_of(across, part);
    patch->v = vec4_of(along, least < LIFTED ? LIFTED * f_min(f3_length(u), f3_length(v)) : 0);
}

static void fit_row(void *user, uint32_t y)
{
    const struct build *b = user;
    for (uint32_t x = 0; x < b->screen->width_px; x++)
        if (b->screen->receivers[(size_t)y * b->screen->width_px + x].place_lit.w > 0)
            fit_pixel(b->screen, x, y);
}

// --- what hides something -----------------------------------------------------------------------

// Whether the surface goes on from one pixel to the next: their patches reach each other, but for
// what curves.
static bool goes_on(const struct bd_screen *s, size_t here, size_t next, bool along)
{
    const struct bd_screen_patch *own = &s->patches[here], *other = &s->patches[next];
    const f3 way =
        f3_sub(f3_from(&s->receivers[next].place_lit), f3_from(&s->receivers[here].place_lit));
    const f3 half = along ? f3_from(&own->v) : f3_from(&own->u_part);
    const f3 other_half = along ? f3_from(&other->v) : f3_from(&other->u_part);
    const float sign = f3_dot(way, f3_add(half, other_half)) < 0 ? -1 : 1;
    const f3 gap = f3_sub(way, f3_scale(f3_add(half, other_half), sign));
    return s->receivers[next].place_lit.w > 0 &&
           f3_length(gap) <= TORN * (f3_length(half) + f3_length(other_half));
}

static bool is_torn(const struct bd_screen *s, uint32_t x, uint32_t y)
{
    const size_t here = (size_t)y * s->width_px + x;
    if (s->receivers[here].place_lit.w == 0 || s->patches[here].u_part.w < 1) return true;
    return !((x == 0 || goes_on(s, here, here - 1, false)) &&
             (x + 1 == s->width_px || goes_on(s, here, here + 1, false)) &&
             (y == 0 || goes_on(s, here, here - s->width_px, true)) &&
             (y + 1 == s->height_px || goes_on(s, here, here + s->width_px, true)));
}

static bool any_torn(const struct bd_screen *s, uint32_t level, uint32_t x, uint32_t y)
{
    const struct bd_uvec4 *finer = &s->levels[level - 1];
    bool any = false;
    for (uint32_t v = 2 * y; v < 2 * y + 2 && v < finer->y; v++)
        for (uint32_t u = 2 * x; u < 2 * x + 2 && u < finer->x; u++)
            any |= s->torn[finer->z + (size_t)v * finer->x + u];
    return any;
}

// Before pixels are fitted to each other.
static void tear_row(void *user, uint32_t y)
{
    const struct build *b = user;
    const struct bd_screen *s = b->screen;
    const struct bd_uvec4 *l = &s->levels[b->level];
    for (uint32_t x = 0; x < l->x; x++)
        s->torn[l->z + (size_t)y * l->x + x] =
            b->level == 0 ? is_torn(s, x, y) : any_torn(s, b->level, x, y);
}

// --- levels -------------------------------------------------------------------------------------

// The part's children that cover anything.
static uint32_t children_of(const struct bd_screen *s, uint32_t level, uint32_t x, uint32_t y,
                            const struct bd_screen_part *children[4])
{
    const struct bd_uvec4 *finer = &s->levels[level - 1];
    uint32_t count = 0;
    for (uint32_t i = 0; i < 4; i++) {
        const uint32_t u = 2 * x + i % 2, v = 2 * y + i / 2;
        if (u >= finer->x || v >= finer->y) continue;
        const struct bd_screen_part *child = part_at(s, level - 1, u, v);
        if (child->middle_area.w > 0) children[count++] = child;
    }
    return count;
}

// How far places lie off the plane of the middle: what turning normals make of it, or all of it.
static float thickness_of(f3 normal, float radius, float area)
{
    const float turn = f_sqrt(f_max(1 - f3_dot(normal, normal), 0));
    return radius * radius > LONG * area ? radius : radius * f_min(turn, 1);
}

// Of a part's means.
static float share_of(const struct bd_screen *s, const struct bd_screen_part *child, float area,
                      uint32_t count)
{
    return s->printed ? 1 / (float)count : child->middle_area.w / area;
}

static void join(const struct bd_screen *s, uint32_t level, uint32_t x, uint32_t y)
{
    const struct bd_screen_part *children[4];
    const uint32_t count = children_of(s, level, x, y, children);
    struct bd_screen_part *part = part_at(s, level, x, y);
    f3 middle = f3_of(0, 0, 0), normal = middle;
    float area = 0, radius = 0;
    for (uint32_t i = 0; i < count; i++) area += children[i]->middle_area.w;
    for (uint32_t i = 0; i < count; i++) {
        const float share = share_of(s, children[i], area, count);
        middle = f3_add(middle, f3_scale(f3_from(&children[i]->middle_area), share));
        normal = f3_add(normal, f3_scale(f3_from(&children[i]->normal_radius), share));
    }
    for (uint32_t i = 0; i < count; i++) {
        const f3 off = f3_sub(f3_from(&children[i]->middle_area), middle);
        radius = f_max(radius, f3_length(off) + children[i]->normal_radius.w);
    }
    part->middle_area = vec4_of(middle, area);
    part->normal_radius = vec4_of(normal, radius);
    part->radiance_thickness = vec4_of(f3_of(0, 0, 0), thickness_of(normal, radius, area));
}

static void join_row(void *user, uint32_t y)
{
    const struct build *b = user;
    for (uint32_t x = 0; x < b->screen->levels[b->level].x; x++) join(b->screen, b->level, x, y);
}

// By the place that rays start from, too, so that both judge alike.
static bool is_left_to_rays(const struct build *b, const struct bd_vec4 *at)
{
    return b->reach > 0 && !bd_screen_holds_about(b->screen, f3_from(at), b->reach);
}

// Towards the eye, in front of all that is seen: a receiver right at a crease would lie in the
// plane of what is beside it, and get nothing from that.
static void lift(const struct build *b, size_t pixel)
{
    struct bd_vec4 *at = &b->screen->receivers[pixel].place_lit;
    const bd_dvec3 eye = b->screen->eye, axis = b->gather->viewpoint->axis_z;
    const bd_dvec3 to = {eye.x - at->x, eye.y - at->y, eye.z - at->z};
    const bd_dvec3 d = b->gather->viewpoint->orthographic ? axis : to;
    if (b->screen->patches[pixel].v.w == 0) return;
    const f3 way = f3_unit(f3_of((float)d.x, (float)d.y, (float)d.z));
    *at = vec4_of(f3_add(f3_from(at), f3_scale(way, b->screen->patches[pixel].v.w)), at->w);
}

// After pixels are fitted: who asks, and from where.
static void place_row(void *user, uint32_t y)
{
    const struct build *b = user;
    const size_t width = b->screen->width_px;
    for (size_t i = y * width; i < (y + 1) * width; i++) {
        struct bd_vec4 *at = &b->screen->receivers[i].place_lit;
        if (at->w > 0 && is_left_to_rays(b, at)) at->w = 0;
        lift(b, i);
    }
}

static enum bd_err each_row(struct build *b, void (*work)(void *user, uint32_t y))
{
    const struct bd_uvec4 *l = &b->screen->levels[b->level];
    return bd_receivers_each(b->context, l->y, UNITS_PER_PART * l->x, work, b);
}

static enum bd_err join_levels(struct build *b)
{
    enum bd_err err = BD_ERR_OK;
    for (b->level = 0; !err && b->level < b->screen->level_count; b->level++)
        err = each_row(b, tear_row);
    b->level = 0;
    if (!err) err = each_row(b, fit_row);
    if (!err) err = each_row(b, place_row);
    for (b->level = 1; !err && b->level < b->screen->level_count; b->level++)
        err = each_row(b, join_row);
    return err;
}

// --- light --------------------------------------------------------------------------------------

static void shine_pixel(const struct build *b, uint32_t x, uint32_t y)
{
    const size_t at = (size_t)y * b->screen->width_px + x;
    const float *e = b->irradiance + 3 * at;
    struct bd_vec4 *radiance = &part_at(b->screen, 0, x, y)->radiance_thickness;
    *radiance = vec4_of(f3_mul(f3_of(e[0], e[1], e[2]), b->screen->sends[at]), radiance->w);
}

static void shine_part(const struct build *b, uint32_t x, uint32_t y)
{
    const struct bd_screen_part *children[4];
    const uint32_t count = children_of(b->screen, b->level, x, y, children);
    struct bd_screen_part *part = part_at(b->screen, b->level, x, y);
    f3 sum = f3_of(0, 0, 0);
    for (uint32_t i = 0; i < count; i++)
        sum = f3_add(sum, f3_scale(f3_from(&children[i]->radiance_thickness),
                                   share_of(b->screen, children[i], part->middle_area.w, count)));
    part->radiance_thickness = vec4_of(sum, part->radiance_thickness.w);
}

static void shine_row(void *user, uint32_t y)
{
    const struct build *b = user;
    for (uint32_t x = 0; x < b->screen->levels[b->level].x; x++)
        b->level == 0 ? shine_pixel(b, x, y) : shine_part(b, x, y);
}

enum bd_err bd_screen_shine(const struct bd_pass_context *context, struct bd_screen *screen,
                            const float *irradiance)
{
    struct build b = {.context = context, .screen = screen, .irradiance = irradiance};
    enum bd_err err = BD_ERR_OK;
    bd_slicer_work(context->slicer, "screen");
    for (b.level = 0; !err && b.level < screen->level_count; b.level++)
        err = each_row(&b, shine_row);
    return err;
}

// --- all ----------------------------------------------------------------------------------------

static enum bd_err make_room(struct bd_screen *s, uint32_t levels, bool glossy,
                             struct bd_err_detail *detail)
{
    uint32_t width = s->width_px, height = s->height_px;
    const size_t pixels = (size_t)width * height;
    bool is_one = false;
    for (; s->level_count < levels && !is_one; s->level_count++) {
        s->levels[s->level_count] = (struct bd_uvec4){width, height, (uint32_t)s->part_count, 0};
        s->part_count += (size_t)width * height;
        is_one = width == 1 && height == 1;
        width = (width + 1) / 2;
        height = (height + 1) / 2;
    }
    s->parts = calloc(s->part_count, sizeof *s->parts);
    s->patches = calloc(pixels, sizeof *s->patches);
    s->receivers = calloc(pixels, sizeof *s->receivers);
    s->sends = calloc(pixels, sizeof *s->sends);
    s->surfaces = glossy ? calloc(pixels, sizeof *s->surfaces) : NULL;
    s->torn = calloc(s->part_count, sizeof *s->torn);
    if (s->parts && s->patches && s->receivers && s->sends && s->torn && (s->surfaces || !glossy))
        return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_NO_MEMORY, "size", "no memory for what %ux%u pixels send",
                      s->width_px, s->height_px);
}

static void look_from(struct bd_screen *screen, const struct bd_gather_inputs *gather)
{
    const struct bd_viewpoint *viewpoint = gather->viewpoint;
    screen->width_px = viewpoint->width_px;
    screen->height_px = viewpoint->height_px;
    screen->viewpoint = *viewpoint;
    screen->eye = bd_render_from_world(&gather->scene->space, viewpoint->position_m);
    screen->per_m = viewpoint->orthographic ? gather->scene->space.render_per_m : 1;
}

enum bd_err bd_screen_create(const struct bd_pass_context *context,
                             const struct bd_screen_inputs *inputs, struct bd_screen **out,
                             struct bd_err_detail *detail)
{
    const struct bd_processor processor = {inputs->pool, bd_native_loops()};
    struct bd_pass_context own = *context;
    struct bd_screen *screen = *out = calloc(1, sizeof *screen);
    BD_ASSERT(screen && inputs->levels >= 1 && inputs->levels <= BD_SCREEN_LEVELS_MAX);
    own.processor = &processor;
    screen->printed = inputs->printed;
    look_from(screen, inputs->gather);
    struct build b = {.context = &own,
                      .gather = inputs->gather,
                      .screen = screen,
                      .lambert = inputs->lambert,
                      .mirrors = inputs->mirrors,
                      .reach = inputs->reach};
    const struct bd_receivers_inputs receivers = {
        .askers = bd_gather_askers(inputs->gather),
        .glossy = true,
        .starts = true,
        .pass = "residual",
        .light = take_part,
        .user = &b,
    };
    enum bd_err err = make_room(screen, inputs->levels, inputs->glossy, detail);
    if (!err) err = bd_receivers_run(&own, &receivers, detail);
    if (!err) err = join_levels(&b);
    if (err) bd_screen_destroy(out);
    return err;
}

void bd_screen_destroy(struct bd_screen **screen)
{
    if (!*screen) return;
    free((*screen)->parts);
    free((*screen)->patches);
    free((*screen)->receivers);
    free((*screen)->sends);
    free((*screen)->surfaces);
    free((*screen)->torn);
    free(*screen);
    *screen = NULL;
}
