// What loops that sum light share: blocks of a list's VPLs; those of them that are near enough to
// be integrated as patches, which are few and gathered from lanes into a loop of their own, and the
// end of a sum. Private to pass/native/.

#ifndef BD_PASS_NATIVE_SUMS_H
#define BD_PASS_NATIVE_SUMS_H

#include "kernel/vpl_light.h"
#include "pass/native/lanes.h"
#include "pass/native/native.h"
#include "shared/vpl.h"

// --- blocks of VPLs -----------------------------------------------------------------------------

#define BLOCK_VPLS 32u

// What a block of VPLs is to the lanes: of each lane which it does not see, a bit each; which lanes
// are near which VPL, and to which VPL any is.
struct block {
    uint32_t hidden[BD_LANES];
    uint32_t near[BLOCK_VPLS][BD_LANES];
    uint32_t any[BLOCK_VPLS];
};

// Of a lane that is not lit there may be no word.
static inline void load_hidden(const struct bd_receivers *r, const struct bd_native_hidden *hidden,
                               uint32_t word, struct block *block)
{
    for (uint32_t i = 0; hidden->bits && i < BD_LANES; i++)
        block->hidden[i] = r->lit[i] > 0 ? hidden->bits[(size_t)i * hidden->words + word] : 0;
}

// --- near VPLs ----------------------------------------------------------------------------------

// Pairs of a lane and a VPL, and what is known of them, side by side.
struct pairs {
    uint32_t count;
    uint32_t lane[BD_LANES];
    struct bd_lanes3 to_vpl, normal, normal_geometric, u, v, flux;
    float inverse_area[BD_LANES];
    struct bd_lanes3 irradiance, vector;
};

static inline void light_pairs(struct pairs *restrict p)
{
    LANES(i)
    {
        const f3 n = f3_at(&p->normal, i), to_vpl = f3_at(&p->to_vpl, i);
        const float r2 = f3_dot(to_vpl, to_vpl);
        const float kernel = patch_light(n, f3_at(&p->normal_geometric, i), to_vpl, r2,
                                         f3_at(&p->u, i), f3_at(&p->v, i), p->inverse_area[i]);
        const f3 irradiance = f3_scale(f3_at(&p->flux, i), kernel);
        const f3 vector = f3_scale(direction_of_unit(to_vpl, r2, n), all_channels(irradiance));
        f3_put_at(&p->irradiance, i, irradiance);
        f3_put_at(&p->vector, i, vector);
    }
}

// Adds what the pairs give to their lanes, in order.
static inline void flush_pairs(struct pairs *p, struct bd_receiver_light *light)
{
    if (p->count == 0) return;
    light_pairs(p);
    for (uint32_t k = 0; k < p->count; k++) {
        f3_add_at(&light->irradiance, p->lane[k], f3_at(&p->irradiance, k));
        f3_add_at(&light->vector, p->lane[k], f3_at(&p->vector, k));
    }
    p->count = 0;
}

static inline void add_pair(struct pairs *p, const struct bd_receivers *r, uint32_t lane,
                            const struct bd_native_vpls *vpls, uint32_t index,
                            struct bd_receiver_light *light)
{
    const struct bd_vec4 *vpl = &vpls->vpls[(size_t)index * BD_VPL_VEC4S];
    const struct bd_vec4 *quad = &vpls->quads[(size_t)index * BD_VPL_QUAD_VEC4S];
    if (p->count == BD_LANES) flush_pairs(p, light);
    const uint32_t k = p->count++;
    p->lane[k] = lane;
    f3_put_at(&p->to_vpl, k, f3_sub(f3_from(vpl), f3_at(&r->position, lane)));
    f3_put_at(&p->normal, k, f3_at(&r->normal, lane));
    f3_put_at(&p->normal_geometric, k, f3_at(&r->normal_geometric, lane));
    f3_put_at(&p->flux, k, f3_from(vpl + 2));
    f3_put_at(&p->u, k, f3_from(quad));
    f3_put_at(&p->v, k, f3_from(quad + 1));
    p->inverse_area[k] = quad->w;
}

// --- the end of a sum ---------------------------------------------------------------------------

static inline bool any_is_lit(const struct bd_receivers *r)
{
    bool any = false;
    LANES(i) any |= r->lit[i] > 0;
    return any;
}

// Whether any stands for a block, over which light is interpolated.
static inline bool any_is_a_block(const struct bd_receivers *r)
{
    bool any = false;
    LANES(i) any |= r->radius[i] > 0;
    return any;
}

// Adds sums to a group's light, where there is somebody to light.
static inline void keep_sums(const struct bd_receivers *restrict r,
                             const struct bd_receiver_light *restrict sums,
                             struct bd_receiver_light *restrict light)
{
    const f3 none = f3_of(0.0f, 0.0f, 0.0f);
    LANES(i)
    {
        const bool is_lit = r->lit[i] > 0.0f;
        const f3 irradiance = f3_at(&sums->irradiance, i);
        const f3 vector =
            irradiance_vector(irradiance, f3_at(&sums->vector, i), f3_at(&r->normal, i));
        f3_add_at(&light->irradiance, i, f3_select(is_lit, irradiance, none));
        f3_add_at(&light->vector, i, f3_select(is_lit, vector, none));
        light->spread[i] += f_select(is_lit, sums->spread[i], 0.0f);
    }
}

#endif
