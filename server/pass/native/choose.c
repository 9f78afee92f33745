// A few of a list's VPLs for each receiver of a group, in proportion to what they would give it if
// nothing stood between them, as shaders/pass/choose does it: systematic sampling over running
// sums.

#include "pass/native/loops.h"

#include <string.h>

#include "kernel/choice.h"
#include "kernel/coat.h"
#include "kernel/light_spread.h"
#include "pass/native/sums.h"

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

// Of a group of VPLs: what it makes as one, and its VPLs one by one, which lanes that are near
// want.
struct group {
    float near[BD_LANES], strength[BD_LANES], spread[BD_LANES];
    float strength_of_vpls[BD_LANES], spread_of_vpls[BD_LANES];
};

static void weigh_as_one(const struct bd_receivers *restrict r, const struct bd_vec4 *as_one,
                         struct group *restrict group)
{
    const f3 middle = f3_from(as_one), normal = f3_from(as_one + 1);
    const float area = as_one->w, normal_spread = as_one[1].w, radius = as_one[2].x,
                near2 = as_one[2].y, flux = as_one[2].z;
    LANES(i)
    {
        const f3 n = f3_at(&r->normal, i), n_geometric = f3_at(&r->normal_geometric, i);
        const f3 to_group = f3_sub(middle, f3_at(&r->position, i));
        const float r2 = f3_dot(to_group, to_group);
        group->near[i] = f_select(r2 < near2, r->lit[i], 0.0f);
        group->strength[i] = flux * strength_of_group(n, n_geometric, to_group, r2, normal,
                                                      normal_spread, radius, area);
        group->spread[i] = spread_of_vpl(r->radius[i], r->off_plane[i], n_geometric, to_group, r2,
                                         normal, area, flux);
    }
}

static bool any_is_near(const struct group *group)
{
    float most = 0;
    LANES(i) most = f_max(most, group->near[i]);
    return most > 0;
}

static void add_group(const struct group *restrict group, float *restrict sum,
                      float *restrict spread)
{
    LANES(i)
    {
        const bool is_near = group->near[i] > 0.0f;
        sum[i] += f_select(is_near, group->strength_of_vpls[i], group->strength[i]);
        spread[i] += f_select(is_near, group->spread_of_vpls[i], group->spread[i]);
    }
}

void WIDE(bd_native_weigh)(const struct bd_receivers *receivers,
                           const struct bd_native_choice *choice,
                           const struct bd_native_wishes *wishes,
                           const struct bd_native_part *groups, float *sums,
                           struct bd_receiver_light *light)
{
    const bool spread = wishes->spread && any_is_a_block(receivers);
    float sum[BD_LANES] = {0};
    if (groups->first > 0) memcpy(sum, &sums[(size_t)(groups->first - 1) * BD_LANES], sizeof sum);
    for (uint32_t at = groups->first; at < groups->end; at++) {
        const uint32_t first = at * choice->group_vpls, left = choice->vpls.end - first;
        const uint32_t count = left < choice->group_vpls ? left : choice->group_vpls;
        struct group group = {0};
        memcpy(group.near, receivers->lit, sizeof group.near);
        if (choice->groups)
            weigh_as_one(receivers, &choice->groups[(size_t)at * BD_VPL_GROUP_VEC4S], &group);
        const bool looks = any_is_near(&group);
        for (uint32_t index = first; looks && index < first + count; index++) {
            const struct bd_vec4 *vpl = &choice->vpls.vpls[(size_t)index * BD_VPL_VEC4S];
            add_strength(receivers, vpl, wishes->near_patches ? vpl[1].w : f_min(vpl[1].w, 0),
                         group.strength_of_vpls);
            if (spread) add_spread(receivers, vpl, group.spread_of_vpls);
        }
        add_group(&group, sum, light->spread);
        memcpy(&sums[(size_t)at * BD_LANES], sum, sizeof sum);
    }
}

// --- which VPL ----------------------------------------------------------------------------------

// What lanes choose by, and a VPL for each.
struct choosing {
    float part[BD_LANES], target[BD_LANES];
    uint32_t group[BD_LANES]; // the first whose running sum is more than the target, or the last
    uint32_t found[BD_LANES];
    float own[BD_LANES]; // of the running sum
    struct bd_lanes3 position, normal, flux, u, v;
    float area[BD_LANES], near2[BD_LANES], inverse_area[BD_LANES];
    float along_u[BD_LANES], along_v[BD_LANES]; // or of a coat (shared/vpl.h)
};

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

static void look_at(const struct bd_native_block *restrict b, f3 position, f3 n, f3 n_geometric,
                    float near_patches, float *restrict strengths)
{
    for (size_t k = 0; k < BD_NATIVE_BLOCK; k++) {
        const f3 to_vpl = f3_sub(f3_of(b->x[k], b->y[k], b->z[k]), position);
        const f3 normal = f3_of(b->normal_x[k], b->normal_y[k], b->normal_z[k]);
        const float near2 = f_select(near_patches > 0.0f, b->near2[k], f_min(b->near2[k], 0.0f));
        strengths[k] =
            b->strength[k] * strength_of_unit(n, n_geometric, to_vpl, f3_dot(to_vpl, to_vpl),
                                              normal, b->area[k], near2);
    }
}

// One of a group, with the running sum before it and what it counts as. What that is stands for
// what its VPLs give: the target among these is as far. By rounding there may be none at it, and
// then it is the last that gives anything.
static void find_vpl(const struct bd_receivers *r, size_t i, float near_patches,
                     const struct bd_native_choice *choice, float target, float sum, float counted,
                     struct choosing *c)
{
    const uint32_t count = choice->group_vpls, first = c->group[i] * count;
    float strengths[BD_NATIVE_GROUP_MAX], given = 0, of_given = 1;
    for (uint32_t k = 0; k < count; k += BD_NATIVE_BLOCK)
        look_at(&choice->blocks[(first + k) / BD_NATIVE_BLOCK], f3_at(&r->position, i),
                f3_at(&r->normal, i), f3_at(&r->normal_geometric, i), near_patches, strengths + k);
    if (choice->groups) {
        for (uint32_t k = 0; k < count; k++) given += strengths[k];
        of_given = counted > 0 ? given / counted : 0;
        target = (target - sum) * of_given;
        sum = 0;
    }
    for (uint32_t k = 0; k < count && !(sum > target); k++) {
        if (strengths[k] > 0) c->found[i] = first + k;
        if (strengths[k] > 0) c->own[i] = strengths[k] / of_given;
        sum += strengths[k];
    }
}

// Targets grow from ray to ray.
#define STRIDE 16u
static void find_vpls(const struct bd_receivers *r, uint32_t ray, float near_patches,
                      const struct bd_native_choice *choice, const float *sums, struct choosing *c)
{
    for (uint32_t i = 0; i < BD_LANES; i++) {
        const float target = c->target[i] + (float)ray * c->part[i];
        uint32_t group = c->group[i];
        c->found[i] = BD_NATIVE_NO_VPL;
        c->own[i] = 0;
        if (r->lit[i] == 0) continue;
        while (group + STRIDE < choice->group_count &&
               !(sums[(size_t)(group + STRIDE - 1) * BD_LANES + i] > target))
            group += STRIDE;
        while (group + 1 < choice->group_count && !(sums[(size_t)group * BD_LANES + i] > target))
            group++;
        const float before = group > 0 ? sums[(size_t)(group - 1) * BD_LANES + i] : 0;
        c->group[i] = group;
        find_vpl(r, i, near_patches, choice, target, before,
                 sums[(size_t)group * BD_LANES + i] - before, c);
    }
}

// --- what it gives ------------------------------------------------------------------------------

static void load_found(struct choosing *c, const struct bd_native_choice *choice, bool near_patches)
{
    for (uint32_t i = 0; i < BD_LANES; i++) {
        const bool is_there = c->found[i] != BD_NATIVE_NO_VPL;
        const size_t index = is_there ? c->found[i] : 0;
        const struct bd_vec4 *vpl = &choice->vpls.vpls[index * BD_VPL_VEC4S];
        const struct bd_vec4 *quad = &choice->vpls.quads[index * BD_VPL_QUAD_VEC4S];
        f3_put_at(&c->position, i, f3_from(vpl));
        f3_put_at(&c->normal, i, f3_from(vpl + 1));
        f3_put_at(&c->flux, i, is_there ? f3_from(vpl + 2) : f3_of(0, 0, 0));
        c->area[i] = vpl->w;
        c->near2[i] = near_patches ? vpl[1].w : f_min(vpl[1].w, 0);
        f3_put_at(&c->u, i, f3_from(quad));
        f3_put_at(&c->v, i, f3_from(quad + 1));
        c->inverse_area[i] = quad->w;
        c->along_u[i] = vpl[2].w;
        c->along_v[i] = quad[1].w;
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
        const float disk =
            disk_light(n, n_geometric, to_vpl, r2, normal, c->area[i], bound_of_near(c->near2[i]));
        const float patch = patch_light(n, n_geometric, to_vpl, r2, f3_at(&c->u, i),
                                        f3_at(&c->v, i), c->inverse_area[i]);
        const f3 flux =
            flux_with_coat(f3_at(&c->flux, i), f3_at(&c->v, i), c->along_u[i], c->inverse_area[i],
                           c->along_v[i], normal, f3_at(&c->u, i), to_vpl, r2);
        const f3 one = f3_scale(flux, f_select(is_near, patch, disk));
        const f3 directions = f3_scale(direction_of_unit(to_vpl, r2, n), all_channels(one));
        const float own = c->own[i], share = c->part[i] / f_max(own, 1e-37f);
        const float stands_for = f_select(own > 0.0f, share, 0.0f);
        f3_put_at(&pick->irradiance, i, f3_scale(one, stands_for));
        f3_put_at(&pick->vector, i, f3_scale(irradiance_vector(one, directions, n), stands_for));
    }
}

void WIDE(bd_native_choose)(const struct bd_receivers *receivers,
                            const struct bd_ray_starts *starts,
                            const struct bd_native_choice *choice,
                            const struct bd_native_wishes *wishes,
                            const struct bd_native_part *rays, const float *sums,
                            struct bd_native_pick *picks)
{
    struct choosing c;
    memset(&c, 0, sizeof c);
    begin(receivers, starts, (float)choice->rays,
          &sums[(size_t)(choice->group_count - 1) * BD_LANES], &c);
    for (uint32_t ray = rays->first; ray < rays->end; ray++) {
        find_vpls(receivers, ray, wishes->near_patches ? 1 : 0, choice, sums, &c);
        load_found(&c, choice, wishes->near_patches);
        light_found(receivers, &c, &picks[ray]);
        memcpy(picks[ray].vpl, c.found, sizeof c.found);
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
