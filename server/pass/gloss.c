#include "pass/gloss.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "kernel/all_channels.h"
#include "kernel/lift.h"
#include "lights/directions.h"
#include "lights/sequence.h"
#include "lights/surface_hits.h"
#include "pass/beside.h"
#include "pass/brushed.h"
#include "pass/gather_native.h"
#include "pass/lobe.h"
#include "pass/native/native.h"
#include "pass/nearest.h"
#include "pass/onward.h"
#include "pass/receivers.h"

#define HALVES 2u
// Kinds of rays that are reflected.
#define KINDS     2u
#define OF_COSINE 0u
#define OF_LOBE   1u

// What is asked for: the kinds from the first on, of which there are `kind_count`, and whether as
// many rays go on into glass that pixels show.
struct asked {
    const char *pass;
    uint32_t first_kind, kind_count;
    bool of_rough; // receivers whose lobe is not worth its price otherwise
    bool looks_in;
};
static const struct asked of_lobes = {"gloss", OF_COSINE, KINDS, false, true};
static const struct asked of_rough = {"rough", OF_LOBE, 1, true, false};
static const struct asked of_glass = {"glass", OF_COSINE, 0, false, true};

// Of rays and what they meet at once.
#define ROOM_BYTES ((size_t)16 << 20)
// A mirror shows edges that no guide of the filter has: they may drown in that part of its noise. A
// lobe blurs them by itself: the wider it is, the larger the part.
#define PART_OF_MIRROR 0.2f
// Of the slicer, one for each evaluation of a VPL: what a ray takes to be aimed, and to be told of.
#define UNITS_PER_RAY 60.0
#define UNITS_PER_HIT 100.0
// Numbers that nobody else of a frame draws by its seed.
#define PURPOSE 0x676c6f73u

// What a pixel reflects for each unit of radiance that its ray brings.
struct share {
    f3 beyond;
    uint32_t pixel;
    uint32_t half;
    uint32_t number; // of the ray, its pixel's side by side
    float spread_sr; // that the ray stands for
    bool looks;      // a mirror or glass
};

struct gloss {
    struct bd_pass_context context;
    struct bd_processor processor;
    const struct bd_far_inputs *inputs;
    struct asked asked;
    struct bd_surface_hits surfaces;
    struct bd_sequence sequence[HALVES * KINDS];
    uint32_t width_px, height_px, stride;
    float view_reach;
    const struct bd_receiver_part *part;
    // Of a part: of each group its rays, then those of all groups side by side.
    uint32_t count;
    struct bd_ray *rays;
    struct share *shares;
    uint32_t *ray_count, *first_ray; // of each group
    struct bd_ray_hit *hits;
    struct bd_way *ways; // in scenes with glass; else NULL, as are the rays' numbers
    uint32_t *numbers;
    struct bd_beside ends;           // cells that stand for those of rays, where there are cells
    struct bd_brushed_way *brushed;  // of each ray, with glass
    f3 *of_brushed;                  // what those bring
    struct bd_surface_point *places; // `triangle` BD_NO_TRIANGLE: nothing that sends light
    f3 *irradiance;                  // there; then what the pixel reflects of it
    float *cosine;                   // under which it comes there
    bool *are_looked_at;             // places: whose lobes are seen
    float *spread_sr;                // by rays that stand for so much
    f3 *seen;                        // what those reflect of first light, instead of its irradiance
    // Of the picture: four floats a pixel.
    float *half[HALVES];
    struct bd_ray_counts traced;
    struct bd_err_detail *detail;
};

// --- room ---------------------------------------------------------------------------------------

// Whether pixels that show glass are looked into.
static bool looks_in(const struct gloss *g)
{
    return g->inputs->glass && g->asked.looks_in;
}

static size_t rays_of_group(const struct gloss *g)
{
    return (size_t)BD_LANES * (g->asked.kind_count + looks_in(g)) * g->inputs->rays;
}

static uint32_t receivers_at_once(const struct gloss *g)
{
    const size_t group =
        rays_of_group(g) * (sizeof *g->rays + sizeof *g->shares + sizeof *g->hits +
                            sizeof *g->places + sizeof *g->irradiance + sizeof *g->cosine +
                            sizeof *g->are_looked_at + sizeof *g->spread_sr + sizeof *g->seen +
                            (g->inputs->glass ? sizeof *g->ways + sizeof *g->numbers +
                                                    sizeof *g->brushed + sizeof *g->of_brushed
                                              : 0));
    return (uint32_t)(ROOM_BYTES > group ? ROOM_BYTES / group : 1) * BD_LANES;
}

static enum bd_err no_memory(const struct gloss *g)
{
    return bd_err_set(g->detail, BD_ERR_NO_MEMORY, "size", "no memory for lobes of %ux%u pixels",
                      g->width_px, g->height_px);
}

static enum bd_err make_room(struct gloss *g, uint32_t group_count)
{
    const size_t rays = group_count * rays_of_group(g);
    if (g->rays) return BD_ERR_OK; // the first part is the largest
    g->rays = malloc(rays * sizeof *g->rays);
    g->shares = malloc(rays * sizeof *g->shares);
    g->hits = malloc(rays * sizeof *g->hits);
    g->places = malloc(rays * sizeof *g->places);
    g->irradiance = malloc(rays * sizeof *g->irradiance);
    g->cosine = malloc(rays * sizeof *g->cosine);
    g->are_looked_at = malloc(rays * sizeof *g->are_looked_at);
    g->spread_sr = malloc(rays * sizeof *g->spread_sr);
    g->seen = malloc(rays * sizeof *g->seen);
    g->ray_count = malloc(group_count * sizeof *g->ray_count);
    g->first_ray = malloc(group_count * sizeof *g->first_ray);
    if (g->inputs->glass) {
        g->ways = malloc(rays * sizeof *g->ways);
        g->numbers = malloc(rays * sizeof *g->numbers);
        g->brushed = malloc(rays * sizeof *g->brushed);
        g->of_brushed = malloc(rays * sizeof *g->of_brushed);
    }
    const bool all = g->rays && g->shares && g->hits && g->places && g->irradiance && g->cosine &&
                     g->are_looked_at && g->spread_sr && g->seen && g->ray_count && g->first_ray &&
                     (!g->inputs->glass || (g->ways && g->numbers && g->brushed && g->of_brushed));
    return all ? BD_ERR_OK : no_memory(g);
}

static enum bd_err make_halves(struct gloss *g)
{
    const size_t pixels = (size_t)g->width_px * g->height_px;
    bool all = true;
    for (uint32_t half = 0; half < HALVES; half++)
        all &= (g->half[half] = calloc(pixels, 4 * sizeof(float))) != NULL;
    return all ? BD_ERR_OK : no_memory(g);
}

static void free_all(struct gloss *g)
{
    void *arrays[] = {g->rays,      g->shares,  g->hits,      g->places,     g->irradiance,
                      g->ways,      g->cosine,  g->ray_count, g->first_ray,  g->half[0],
                      g->half[1],   g->numbers, g->brushed,   g->of_brushed, g->are_looked_at,
                      g->spread_sr, g->seen};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) free(arrays[i]);
}

// --- where they go ------------------------------------------------------------------------------

static f3 direction_of(const struct gloss *g, const struct bd_lobe *lobe, uint32_t half,
                       uint32_t kind, uint32_t number)
{
    const f3 n = lobe->at->normal;
    float numbers[2];
    bd_sequence_pair(&g->sequence[half * KINDS + kind], lobe->at->place * g->stride + number,
                     numbers);
    if (kind == OF_LOBE) return bd_lobe_choose(lobe, numbers);
    const struct bd_basis basis = bd_basis_of(n);
    return bd_from_basis(&basis, n, bd_cosine_direction(numbers));
}

// Of all rays of a half together.
static float density_of(const struct gloss *g, const struct bd_lobe *lobe, f3 d)
{
    const float of_cosine = f_max(f3_dot(lobe->at->normal, d), 0) / F_PI;
    return (float)(g->inputs->rays / HALVES) *
           ((g->asked.of_rough ? 0 : of_cosine) + bd_lobe_pdf(lobe, d));
}

static f3 reflected(const struct gloss *g, const struct bd_lobe *lobe, f3 d)
{
    if (!g->asked.of_rough) return bd_lobe_received(lobe, d).beyond;
    const float specular = bd_lobe_specular(lobe, d);
    return f3_of(specular, specular, specular);
}

// False where nothing would come of it.
static bool aim(const struct gloss *g, const struct bd_lobe *lobe, f3 d, struct bd_ray *ray,
                struct share *share)
{
    const struct bd_area_receiver *at = lobe->at;
    const float density = density_of(g, lobe, d);
    if (!bd_lobe_is_above(lobe, d) || !(density > 0) || !isfinite(density)) return false;
    const float lift = lift_of_segment(g->view_reach, at->position, at->position);
    const f3 from = f3_add(at->position, f3_scale(at->normal_geometric, lift));
    *ray = (struct bd_ray){.origin = {from.x, from.y, from.z},
                           .from_triangle = at->triangle,
                           .direction = {d.x, d.y, d.z},
                           .far = INFINITY};
    share->beyond = f3_scale(reflected(g, lobe, d), 1 / density);
    share->spread_sr = 1 / (HALVES * density);
    return true;
}

static bool is_asked(const struct gloss *g, const struct bd_lobe *lobe)
{
    if (!g->asked.of_rough) return lobe->is_there;
    return !lobe->at->has_lobe && f3_dot(lobe->at->normal, lobe->at->viewer) > 0;
}

static struct share share_of(const struct gloss *g, const struct bd_area_receiver *at, uint32_t i)
{
    return (struct share){.pixel = at->y_px * g->width_px + at->x_px,
                          .half = i % HALVES,
                          .number = at->place * g->stride * HALVES * (KINDS + looks_in(g)) + i};
}

// Rays of a pixel that reflects, from place `next` on; how many.
static size_t aim_lobe(const struct gloss *g, const struct bd_lobe *lobe, size_t next)
{
    const size_t first = next;
    const uint32_t kinds = g->asked.kind_count;
    for (uint32_t i = 0; is_asked(g, lobe) && i < kinds * g->inputs->rays; i++) {
        const uint32_t half = i % HALVES, kind = g->asked.first_kind + i / HALVES % kinds;
        const f3 d = direction_of(g, lobe, half, kind, i / (HALVES * kinds));
        g->shares[next] = share_of(g, lobe->at, i);
        g->shares[next].looks = lobe->at->roughness <= BD_MIRROR_ROUGHNESS;
        if (g->ways) g->ways[next] = bd_way_begins;
        next += aim(g, lobe, d, &g->rays[next], &g->shares[next]);
    }
    return next - first;
}

// Of a pixel that shows glass.
static size_t aim_through(const struct gloss *g, const struct bd_area_receiver *at, size_t next)
{
    const size_t first = next;
    struct bd_interface glass;
    if (!looks_in(g) ||
        !bd_interface_seen_at(&g->surfaces, at->triangle, at->position, at->viewer, &glass))
        return 0;
    const float share = HALVES / (float)g->inputs->rays;
    for (uint32_t i = 0; i < g->inputs->rays; i++) {
        g->shares[next] = share_of(g, at, KINDS * g->inputs->rays + i);
        g->shares[next].beyond = f3_of(share, share, share);
        g->shares[next].looks = true;
        next += bd_onward_enter(&g->surfaces, &glass, at->viewer, g->inputs->seed,
                                g->shares[next].number, &g->rays[next], &g->ways[next]);
    }
    return next - first;
}

// The part of the noise that edges may drown in, into alpha of the second half.
static void tell_part(const struct gloss *g, const struct bd_area_receiver *at)
{
    const float blurred = at->roughness / BD_MIRROR_ROUGHNESS;
    const size_t pixel = (size_t)at->y_px * g->width_px + at->x_px;
    g->half[1][4 * pixel + 3] = f_min(f_max(blurred, PART_OF_MIRROR), 1);
}

static void aim_group(void *user, uint32_t group)
{
    const struct gloss *g = user;
    const size_t first = group * rays_of_group(g);
    size_t next = first;
    for (uint32_t lane = 0; lane < BD_LANES; lane++) {
        struct bd_area_receiver at;
        if (!bd_lobe_receiver_at(g->part, group, lane, &at)) continue;
        const struct bd_lobe lobe = bd_lobe_of(&at, false);
        next += aim_lobe(g, &lobe, next);
        next += aim_through(g, &at, next);
        tell_part(g, &at);
    }
    g->ray_count[group] = (uint32_t)(next - first);
}

static void close_ranks(struct gloss *g)
{
    g->count = 0;
    for (uint32_t i = 0; i < g->part->group_count; i++) {
        const size_t from = i * rays_of_group(g);
        memmove(g->rays + g->count, g->rays + from, g->ray_count[i] * sizeof *g->rays);
        memmove(g->shares + g->count, g->shares + from, g->ray_count[i] * sizeof *g->shares);
        if (g->ways) memmove(g->ways + g->count, g->ways + from, g->ray_count[i] * sizeof *g->ways);
        g->first_ray[i] = g->count;
        g->count += g->ray_count[i];
    }
}

// --- what they bring ----------------------------------------------------------------------------

static void place_ray(const struct gloss *g, uint32_t i)
{
    const struct bd_ray_hit *hit = &g->hits[i];
    const float *d = g->rays[i].direction;
    g->places[i] = (struct bd_surface_point){.normal = {0, 0, 1}, .triangle = BD_NO_TRIANGLE};
    if (hit->triangle == BD_NO_TRIANGLE) return;
    const struct bd_surface_point nothing = g->places[i];
    if (!bd_surface_hit_at(&g->surfaces, hit->triangle, hit->u, hit->v, f3_of(d[0], d[1], d[2]),
                           &g->places[i]))
        g->places[i] = nothing;
    g->places[i].number = g->shares[i].number;
}

// What is a mirror or glass in part sends on by the rest of it, as if nobody looked.
static bool is_looked_at(const struct gloss *g, uint32_t i)
{
    return g->inputs->sends != BD_SENDS_LAMBERT && !(g->ways && g->ways[i].rest < 1);
}

static void place_group(void *user, uint32_t group)
{
    const struct gloss *g = user;
    const uint32_t first = g->first_ray[group];
    for (uint32_t i = first; i < first + g->ray_count[group]; i++) {
        place_ray(g, i);
        g->are_looked_at[i] = is_looked_at(g, i);
        g->spread_sr[i] = g->shares[i].spread_sr;
        g->seen[i] = f3_of(0, 0, 0);
    }
}

// What a place sends of a unit of irradiance, in the mean over the directions that it sends to.
static f3 sent(const struct gloss *g, uint32_t i, float cosine)
{
    const struct bd_ray_hit *hit = &g->hits[i];
    const f3 diffuse = bd_surface_hit_diffuse(&g->surfaces, hit->triangle, hit->u, hit->v,
                                              g->inputs->sends, cosine);
    return f3_scale(diffuse, 1 / F_PI);
}

static bool is_of(const struct gloss *g, uint32_t ray, uint32_t pixel)
{
    return g->shares[ray].pixel == pixel;
}

// Rays from `first` on are of a pixel. Those whose cells are all hidden count as the others do.
// Beyond diffuse light there may be less than nothing.
static float more_of_known(const struct gloss *g, uint32_t first, uint32_t end)
{
    float all = 0, known = 0;
    if (!g->inputs->cells) return 0;
    for (uint32_t i = first; i < end && is_of(g, i, g->shares[first].pixel); i++) {
        const float size = all_channels(f3_abs(g->shares[i].beyond));
        all += size;
        if (g->ends.near[i] != BD_BESIDE_HIDDEN) known += size;
    }
    return known > 0 ? all / known : 0;
}

// Photons that came by glass tell what wide lobes reflect of them, too: few rays would find it.
static bool is_told_by_photons(const struct gloss *g, uint32_t i)
{
    return g->ways && !g->ways[i].straight && !g->shares[i].looks;
}

static f3 light_of_cell(const struct gloss *g, uint32_t i)
{
    const struct bd_irradiance_cells *cells = g->inputs->cells;
    const uint32_t cell = g->ends.near[i];
    if (!g->shares[i].looks || !cells->beside) return cells->irradiance[cell];
    return bd_irradiance_cells_between(cells, cell, g->places[i].position, g->places[i].normal);
}

// What is sent to the ray from where it ends.
static f3 light_of_place(const struct gloss *g, uint32_t i, float more_of_cells)
{
    const struct bd_surface_point *at = &g->places[i];
    if (at->triangle == BD_NO_TRIANGLE) return f3_of(0, 0, 0);
    const struct bd_far_inputs *in = g->inputs;
    const float cosine = g->are_looked_at[i] ? BD_FROM_EVERYWHERE : g->cosine[i];
    f3 light = f3_add(g->seen[i], f3_mul(g->irradiance[i], sent(g, i, cosine)));
    if (g->ways && bd_brushed_ends(&g->brushed[i], &g->ways[i])) light = f3_of(0, 0, 0);
    f3 more = f3_of(0, 0, 0);
    if (in->cells && g->ends.near[i] < BD_BESIDE_HIDDEN)
        more = f3_scale(light_of_cell(g, i), more_of_cells);
    if (in->caustics && !(in->caustics_again && is_told_by_photons(g, i)))
        more = f3_add(more, bd_photon_map_look(in->caustics, at->position, at->normal, 0));
    if (in->cells || in->caustics)
        light = f3_add(light, f3_mul(more, sent(g, i, BD_FROM_EVERYWHERE)));
    return light;
}

// Of lamps that it met behind glass or in mirrors.
static f3 emission_of(const struct gloss *g, uint32_t i)
{
    const struct bd_far_inputs *in = g->inputs;
    const bool is_lamp = g->hits[i].triangle != BD_NO_TRIANGLE;
    if (!g->ways || g->ways[i].straight) return f3_of(0, 0, 0);
    if (is_lamp && in->caustics && is_told_by_photons(g, i)) return f3_of(0, 0, 0);
    return bd_onward_emission(in->first, &g->rays[i], &g->hits[i], &g->ways[i]);
}

// Irradiance where rays end becomes light that their pixels reflect.
static void reflect_group(void *user, uint32_t group)
{
    const struct gloss *g = user;
    const uint32_t first = g->first_ray[group], end = first + g->ray_count[group];
    float more = 0;
    for (uint32_t i = first; i < end; i++) {
        const struct bd_way *way = g->ways ? &g->ways[i] : &bd_way_begins;
        if (i == first || !is_of(g, i, g->shares[i - 1].pixel)) more = more_of_known(g, i, end);
        f3 light = f3_add(f3_mul(way->weight, light_of_place(g, i, more)), emission_of(g, i));
        if (g->ways) light = f3_add(light, g->of_brushed[i]);
        g->irradiance[i] = f3_mul(light, g->shares[i].beyond);
    }
}

// In the order of the rays.
static void sum(const struct gloss *g)
{
    for (uint32_t i = 0; i < g->count; i++) {
        float *pixel = g->half[g->shares[i].half] + 4 * (size_t)g->shares[i].pixel;
        pixel[0] += g->irradiance[i].x;
        pixel[1] += g->irradiance[i].y;
        pixel[2] += g->irradiance[i].z;
    }
}

static enum bd_err go_on(struct gloss *g)
{
    const struct bd_far_inputs *in = g->inputs;
    const struct bd_onward_look look = {bd_brushed_look, g->brushed};
    for (uint32_t i = 0; i < g->count; i++) {
        g->numbers[i] = g->shares[i].number;
        g->brushed[i] = bd_brushed_begins(g->shares[i].number, g->shares[i].spread_sr);
    }
    return bd_onward_run(&g->context, &g->surfaces, in->visibility, BD_CARRIES_RADIANCE, in->seed,
                         g->numbers, g->rays, g->hits, g->ways, g->count,
                         in->sends == BD_SENDS_LAMBERT ? NULL : &look, &g->traced, g->detail);
}

// All that places are lit by straight away, and by virtual lights.
static enum bd_err light_places(struct gloss *g)
{
    const struct bd_far_inputs *in = g->inputs;
    const struct bd_gather_chosen_native_inputs gather = {
        .receivers = {.points = g->places, .point_count = g->count, .seed = in->seed},
        .list = in->seen.list,
        .rays = in->seen.rays,
        .visibility = in->seen.visibility,
        .of_points = g->irradiance,
    };
    const struct bd_first_looks looks = {&g->surfaces,     g->rays,      g->hits,
                                         g->are_looked_at, g->spread_sr, g->seen};
    enum bd_err err =
        bd_first_light_run(&g->context, in->first, in->visibility, in->seed + PURPOSE, g->places,
                           g->count, &looks, g->irradiance, g->cosine, &g->traced, g->detail);
    if (!err && g->ways)
        err = bd_brushed_light(&g->context, &g->surfaces, in->first, in->visibility, in->seed,
                               g->brushed, g->count, g->of_brushed, &g->traced, g->detail);
    if (err || !in->seen.list || g->count == 0) return err;
    return bd_gather_chosen_native_run(&g->context, &gather, &g->traced, g->detail);
}

static enum bd_err light_part(void *user, const struct bd_receiver_part *part)
{
    struct gloss *g = user;
    const struct bd_far_inputs *in = g->inputs;
    const double rays = (double)rays_of_group(g);
    g->part = part;
    enum bd_err err = make_room(g, part->group_count);
    bd_slicer_work(g->context.slicer, "gloss");
    if (!err)
        err = bd_receivers_each(&g->context, part->group_count, UNITS_PER_RAY * rays, aim_group, g);
    if (err) return err;
    close_ranks(g);
    err = bd_nearest_ask(&g->context, in->visibility, g->rays, g->count, g->hits, &g->traced,
                         g->detail);
    if (!err && g->ways) err = go_on(g);
    if (!err)
        err =
            bd_receivers_each(&g->context, part->group_count, UNITS_PER_HIT * rays, place_group, g);
    if (!err) err = light_places(g);
    if (!err && in->cells)
        err = bd_beside_find(&g->context, &g->ends, g->rays, g->hits, g->count, &g->traced,
                             g->detail);
    bd_slicer_work(g->context.slicer, "gloss");
    if (!err)
        err = bd_receivers_each(&g->context, part->group_count, UNITS_PER_HIT * rays, reflect_group,
                                g);
    if (!err) sum(g);
    return err;
}

// --- the pass -----------------------------------------------------------------------------------

// The mean of the halves, and half their difference.
static void combine(struct gloss *g)
{
    const size_t floats = 4 * (size_t)g->width_px * g->height_px;
    for (size_t i = 0; i < floats; i++) {
        const float a = g->half[0][i], b = g->half[1][i];
        const bool is_light = i % 4 < 3;
        g->half[0][i] = is_light ? 0.5f * (a + b) : 1;
        if (is_light) g->half[1][i] = 0.5f * (a - b);
    }
}

static enum bd_err write_half(const struct gloss *g, uint32_t half, const char *name,
                              struct bd_tex **out)
{
    const struct bd_tex_desc desc = {.name = name,
                                     .format = BD_FORMAT_RGBA32F,
                                     .width_px = g->width_px,
                                     .height_px = g->height_px};
    const size_t row_floats = 4 * (size_t)g->width_px;
    enum bd_err err = bd_tex_create(g->context.gpu, &desc, out, g->detail);
    bd_slicer_work(g->context.slicer, "gloss write");
    for (uint32_t row = 0, rows; !err && row < g->height_px; row += rows) {
        rows = bd_slicer_rows(g->context.slicer, g->width_px, g->height_px - row);
        bd_tex_upload_rows(g->context.gpu, *out, 0, row, rows, g->half[half] + row * row_floats,
                           rows * row_floats * sizeof(float));
        err = bd_slicer_checkpoint(g->context.slicer, (double)g->width_px * rows);
    }
    return err;
}

static enum bd_err run(struct gloss *g, const struct bd_gather_inputs *gather,
                       struct bd_indirect *indirect)
{
    const struct bd_receivers_inputs receivers = {
        .askers = bd_gather_askers(gather),
        .pass = g->asked.pass,
        .glossy = true,
        .starts = true,
        .seed = g->inputs->seed,
        .receivers_max = receivers_at_once(g),
        .light = light_part,
        .user = g,
    };
    enum bd_err err = make_halves(g);
    g->view_reach = bd_askers_reach(&receivers.askers);
    if (!err) err = bd_receivers_run(&g->context, &receivers, g->detail);
    if (err) return err;
    combine(g);
    const bool rough = g->asked.of_rough;
    struct bd_tex **light = rough ? &indirect->rough : &indirect->glossy;
    struct bd_tex **noise = rough ? &indirect->noise_rough : &indirect->noise_glossy;
    err = write_half(g, 0, "indirect light of lobes", light);
    return err ? err : write_half(g, 1, "noise of lobes", noise);
}

static enum bd_err run_of(struct asked asked, const struct bd_pass_context *context,
                          const struct bd_far_inputs *inputs, const struct bd_gather_inputs *gather,
                          struct bd_indirect *indirect, struct bd_err_detail *detail)
{
    struct gloss g = {
        .context = *context,
        .processor = {inputs->visibility->pool, bd_native_loops()},
        .inputs = inputs,
        .asked = asked,
        .width_px = gather->viewpoint->width_px,
        .height_px = gather->viewpoint->height_px,
        .stride = bd_sequence_stride(inputs->rays / HALVES),
        .ends = {.cells = inputs->cells, .visibility = inputs->visibility, .surfaces = &g.surfaces},
        .detail = detail,
    };
    g.context.processor = &g.processor;
    for (uint32_t i = 0; i < HALVES * KINDS; i++)
        g.sequence[i] = bd_sequence_of(bd_askers_seed(inputs->seed), PURPOSE + i);
    bd_surface_hits_init(&g.surfaces, inputs->snapshot);
    const enum bd_err err = run(&g, gather, indirect);
    bd_ray_counts_add(&indirect->rays, g.traced);
    bd_surface_hits_finish(&g.surfaces);
    bd_beside_finish(&g.ends);
    free_all(&g);
    return err;
}

enum bd_err bd_gloss_run(const struct bd_pass_context *context, const struct bd_far_inputs *inputs,
                         const struct bd_gather_inputs *gather, struct bd_indirect *indirect,
                         struct bd_err_detail *detail)
{
    return run_of(of_lobes, context, inputs, gather, indirect, detail);
}

enum bd_err bd_gloss_of_rough_run(const struct bd_pass_context *context,
                                  const struct bd_far_inputs *inputs,
                                  const struct bd_gather_inputs *gather,
                                  struct bd_indirect *indirect, struct bd_err_detail *detail)
{
    return run_of(of_rough, context, inputs, gather, indirect, detail);
}

enum bd_err bd_gloss_of_glass_run(const struct bd_pass_context *context,
                                  const struct bd_far_inputs *inputs,
                                  const struct bd_gather_inputs *gather, struct bd_indirect **out,
                                  struct bd_err_detail *detail)
{
    struct bd_indirect *indirect = *out = calloc(1, sizeof *indirect);
    BD_ASSERT(indirect);
    const enum bd_err err = run_of(of_glass, context, inputs, gather, indirect, detail);
    if (err) bd_indirect_destroy(context->gpu, out);
    return err;
}
