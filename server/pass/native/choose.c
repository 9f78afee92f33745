// A few of a list's VPLs for each receiver of a group, in proportion to what they would give it if
// nothing stood between them, as shaders/pass/choose does it: systematic sampling over running
// sums.

#include "pass/native/loops.h"

#include <string.h>

#include "kernel/choice.h"
#include "kernel/light_spread.h"
#include "pass/native/sums.h"

#define NO_VPL UINT32_MAX

// --- running sums -------------------------------------------------------------------------------

static void add_strength(const struct bd_receivers *restrict r, const struct bd_vec4 *vpl,
                         float near2, float *restrict sum)
{
    const f3 vpl_position = f3_from(vpl), vpl_normal = f3_from(vpl + 1);
    const float strength = all_channels(f3_from(vpl + 2)), area = vpl->w;
    LANES(i)
    {
        const f3 to_vpl = f3_sub(vpl_position, f3_at(&r->position, i));
        sum[i] +=
            strength * strength_of_unit(f3_at(&r->normal, i), f3_at(&r->normal_geometric, i),
                                        to_vpl, f3_dot(to_vpl, to_vpl), vpl_normal, area, near2);
    }
}

static void add_spread(const struct bd_receivers *restrict r, const struct bd_vec4 *vpl,
                       float *restrict spread)
{
    const f3 vpl_position = f3_from(vpl), vpl_normal = f3_from(vpl + 1);
    const float strength = all_channels(f3_from(vpl + 2)), area = vpl->w;
    LANES(i)
    {
        const f3 to_vpl = f3_sub(vpl_position, f3_at(&r->position, i));
        spread[i] += spread_of_vpl(r->radius[i], r->off_plane[i], f3_at(&r->normal_geometric, i),
                                   to_vpl, f3_dot(to_vpl, to_vpl), vpl_normal, area, strength);
    }
}

void WIDE(bd_native_weigh)(const struct bd_receivers *receivers,
                           const struct bd_native_choice *choice,
                           const struct bd_native_wishes *wishes,
                           const struct bd_native_part *groups, float *sums,
                           struct bd_receiver_light *light)
{
    const struct bd_native_vpls *vpls = &choice->vpls;
    const bool spread = wishes->spread && any_is_a_block(receivers);
    float sum[BD_LANES] = {0};
    if (groups->first > 0) memcpy(sum, &sums[(size_t)(groups->first - 1) * BD_LANES], sizeof sum);
    for (uint32_t group = groups->first; group < groups->end; group++) {
        const uint32_t first = group * choice->group_vpls, left = vpls->end - first;
        const uint32_t end = first + (left < choice->group_vpls ? left : choice->group_vpls);
        for (uint32_t index = first; index < end; index++) {
            const struct bd_vec4 *vpl = &vpls->vpls[(size_t)index * BD_VPL_VEC4S];
            add_strength(receivers, vpl, wishes->near_patches ? vpl[1].w : 0, sum);
            if (spread) add_spread(receivers, vpl, light->spread);
        }
        memcpy(&sums[(size_t)group * BD_LANES], sum, sizeof sum);
    }
}

// --- which VPL ----------------------------------------------------------------------------------

// What lanes choose by, and a VPL for each.
struct choosing {
    float part[BD_LANES], target[BD_LANES];
    uint32_t group[BD_LANES]; // the first whose running sum is more than the target, or the last
    float sum[BD_LANES], own[BD_LANES];
    uint32_t found[BD_LANES];
    // Of a VPL of each.
    uint32_t index[BD_LANES];
    struct bd_lanes3 position, normal, flux, u, v;
    float area[BD_LANES], near2[BD_LANES], strength[BD_LANES], inverse_area[BD_LANES];
};

static void load_vpl(struct choosing *c, uint32_t i, const struct bd_native_choice *choice,
                     bool near_patches)
{
    // Behind the list's end there is nothing to be had.
    const bool is_there = c->index[i] < choice->vpls.end;
    const size_t index = is_there ? c->index[i] : 0;
    const struct bd_vec4 *vpl = &choice->vpls.vpls[index * BD_VPL_VEC4S];
    const f3 flux = is_there ? f3_from(vpl + 2) : f3_of(0, 0, 0);
    f3_put_at(&c->position, i, f3_from(vpl));
    f3_put_at(&c->normal, i, f3_from(vpl + 1));
    f3_put_at(&c->flux, i, flux);
    c->area[i] = vpl->w;
    c->near2[i] = near_patches ? vpl[1].w : 0;
    c->strength[i] = all_channels(flux);
}

static void begin(const struct bd_receivers *restrict r,
                  const struct bd_ray_starts *restrict starts, float rays,
                  const float *restrict total, struct choosing *restrict c)
{
    LANES(i)
    {
        c->part[i] = f_select(r->lit[i] > 0.0f, total[i], 0.0f) / rays;
        c->target[i] = starts->place[i] * f_select(r->lit[i] > 0.0f, total[i], 0.0f) / rays;
        c->group[i] = 0;
    }
}

// Targets grow from ray to ray.
static void find_groups(struct choosing *c, uint32_t ray, const struct bd_native_choice *choice,
                        const float *sums)
{
    for (uint32_t i = 0; i < BD_LANES; i++) {
        const float target = c->target[i] + (float)ray * c->part[i];
        uint32_t group = c->group[i];
        while (group + 1 < choice->group_count && !(sums[(size_t)group * BD_LANES + i] > target))
            group++;
        c->group[i] = group;
        c->sum[i] = group > 0 ? sums[(size_t)(group - 1) * BD_LANES + i] : 0;
        c->found[i] = NO_VPL;
        c->own[i] = 0;
    }
}

// By rounding there may be none at the target, and then it is the group's last that gives anything.
static void look_at(const struct bd_receivers *restrict r, float ray, struct choosing *restrict c)
{
    LANES(i)
    {
        const f3 to_vpl = f3_sub(f3_at(&c->position, i), f3_at(&r->position, i));
        const float target = c->target[i] + ray * c->part[i];
        const float own =
            c->strength[i] * strength_of_unit(f3_at(&r->normal, i), f3_at(&r->normal_geometric, i),
                                              to_vpl, f3_dot(to_vpl, to_vpl), f3_at(&c->normal, i),
                                              c->area[i], c->near2[i]);
        const bool takes = b_and(own > 0.0f, !(c->sum[i] > target));
        c->found[i] = u_select(takes, c->index[i], c->found[i]);
        c->own[i] = f_select(takes, own, c->own[i]);
        c->sum[i] += own;
    }
}

static void find_vpls(const struct bd_receivers *r, uint32_t ray,
                      const struct bd_native_choice *choice, bool near_patches, struct choosing *c)
{
    for (uint32_t k = 0; k < choice->group_vpls; k++) {
        for (uint32_t i = 0; i < BD_LANES; i++) {
            c->index[i] = c->group[i] * choice->group_vpls + k;
            load_vpl(c, i, choice, near_patches);
        }
        look_at(r, (float)ray, c);
    }
}

// --- what it gives ------------------------------------------------------------------------------

static void load_found(struct choosing *c, const struct bd_receivers *r,
                       const struct bd_native_choice *choice, bool near_patches)
{
    for (uint32_t i = 0; i < BD_LANES; i++) {
        if (r->lit[i] == 0) c->found[i] = NO_VPL;
        c->index[i] = c->found[i];
        load_vpl(c, i, choice, near_patches);
        const size_t index = c->found[i] == NO_VPL ? 0 : c->found[i];
        const struct bd_vec4 *quad = &choice->vpls.quads[index * BD_VPL_QUAD_VEC4S];
        f3_put_at(&c->u, i, f3_from(quad));
        f3_put_at(&c->v, i, f3_from(quad + 1));
        c->inverse_area[i] = quad->w;
    }
}

static void light_found(const struct bd_receivers *restrict r, const struct choosing *restrict c,
                        struct bd_native_pick *restrict pick)
{
    LANES(i)
    {
        const f3 n = f3_at(&r->normal, i), n_geometric = f3_at(&r->normal_geometric, i);
        const f3 to_vpl = f3_sub(f3_at(&c->position, i), f3_at(&r->position, i));
        const f3 normal = f3_at(&c->normal, i);
        const float r2 = f3_dot(to_vpl, to_vpl);
        const bool is_near = b_and(r2 < c->near2[i], faces(normal, to_vpl, r2));
        const float disk = disk_light(n, n_geometric, to_vpl, r2, normal, c->area[i]);
        const float patch = patch_light(n, n_geometric, to_vpl, r2, f3_at(&c->u, i),
                                        f3_at(&c->v, i), c->inverse_area[i]);
        const f3 one = f3_scale(f3_at(&c->flux, i), f_select(is_near, patch, disk));
        const f3 directions = f3_scale(direction_of_unit(to_vpl, r2, n), all_channels(one));
        const float own = c->own[i], share = c->part[i] / f_max(own, 1e-37f);
        const float stands_for = f_select(own > 0.0f, share, 0.0f);
        f3_put_at(&pick->irradiance, i, f3_scale(one, stands_for));
        f3_put_at(&pick->vector, i, f3_scale(irradiance_vector(one, directions, n), stands_for));
    }
}

static void put_point(float to[3], f3 from)
{
    to[0] = from.x;
    to[1] = from.y;
    to[2] = from.z;
}

// One that asks nothing where nothing was found.
static void put_segments(const struct bd_ray_starts *starts, const struct bd_native_choice *choice,
                         const struct choosing *c, uint32_t ray, struct bd_segment *segments)
{
    for (uint32_t i = 0; i < BD_LANES; i++) {
        struct bd_segment *segment = &segments[(size_t)i * choice->rays + ray];
        *segment =
            (struct bd_segment){.from_triangle = BD_NO_TRIANGLE, .to_triangle = BD_NO_TRIANGLE};
        if (c->found[i] == NO_VPL) continue;
        const struct bd_vec4 *vpl = &choice->vpls.vpls[(size_t)c->found[i] * BD_VPL_VEC4S];
        const struct bd_vec4 *quad = &choice->vpls.quads[(size_t)c->found[i] * BD_VPL_QUAD_VEC4S];
        const f3 from = f3_at(&starts->position, i);
        const f3 to =
            end_of_segment(f3_from(vpl), f3_from(quad), f3_from(quad + 1), vpl[2].w, quad[1].w);
        const float lift = lift_of_segment(choice->view_reach, from, to);
        const f3 up = f3_scale(f3_at(&starts->normal_geometric, i), lift);
        put_point(segment->from, f3_add(from, up));
        put_point(segment->to, f3_add(to, f3_scale(f3_from(vpl + 1), lift)));
        segment->from_triangle = starts->triangle[i];
    }
}

void WIDE(bd_native_choose)(const struct bd_receivers *receivers,
                            const struct bd_ray_starts *starts,
                            const struct bd_native_choice *choice,
                            const struct bd_native_wishes *wishes,
                            const struct bd_native_part *rays, const float *sums,
                            struct bd_native_pick *picks, struct bd_segment *segments)
{
    struct choosing c;
    memset(&c, 0, sizeof c);
    begin(receivers, starts, (float)choice->rays,
          &sums[(size_t)(choice->group_count - 1) * BD_LANES], &c);
    for (uint32_t ray = rays->first; ray < rays->end; ray++) {
        find_groups(&c, ray, choice, sums);
        find_vpls(receivers, ray, choice, wishes->near_patches, &c);
        load_found(&c, receivers, choice, wishes->near_patches);
        light_found(receivers, &c, &picks[ray]);
        put_segments(starts, choice, &c, ray, segments);
    }
}

// --- what is seen of it -------------------------------------------------------------------------

static void add_pick(const struct bd_native_pick *restrict pick, const float *restrict seen,
                     struct bd_lanes3 *restrict half, struct bd_lanes3 *restrict vector)
{
    LANES(i)
    {
        f3_add_at(half, i, f3_scale(f3_at(&pick->irradiance, i), seen[i]));
        f3_add_at(vector, i, f3_scale(f3_at(&pick->vector, i), seen[i]));
    }
}

static void keep_halves(const struct bd_receivers *restrict r,
                        const struct bd_lanes3 *restrict even, const struct bd_lanes3 *restrict odd,
                        const struct bd_lanes3 *restrict vector,
                        struct bd_receiver_light *restrict light)
{
    const f3 none = f3_of(0.0f, 0.0f, 0.0f);
    LANES(i)
    {
        const bool is_lit = r->lit[i] > 0.0f;
        const f3 a = f3_at(even, i), b = f3_at(odd, i);
        f3_put_at(&light->irradiance, i, f3_select(is_lit, f3_add(a, b), none));
        f3_put_at(&light->noise, i, f3_select(is_lit, f3_sub(a, b), none));
        f3_put_at(&light->vector, i, f3_select(is_lit, f3_at(vector, i), none));
        light->spread[i] = f_select(is_lit, light->spread[i], 0.0f);
    }
}

void WIDE(bd_native_sum_picks)(const struct bd_receivers *receivers,
                               const struct bd_native_pick *picks, uint32_t rays,
                               const uint32_t *occluded, struct bd_receiver_light *light)
{
    struct bd_lanes3 halves[2], vector;
    float seen[BD_LANES];
    memset(halves, 0, sizeof halves);
    memset(&vector, 0, sizeof vector);
    for (uint32_t ray = 0; ray < rays; ray++) {
        for (size_t i = 0; i < BD_LANES; i++) {
            const size_t index = i * rays + ray;
            seen[i] = occluded[index / 32] >> index % 32 & 1 ? 0 : 1;
        }
        add_pick(&picks[ray], seen, &halves[ray % 2], &vector);
    }
    keep_halves(receivers, &halves[0], &halves[1], &vector, light);
}
