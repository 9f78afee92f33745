// Light of VPLs at a group of receivers, as shaders/common/vpl_gather.glsl sums it: in the order of
// the list, of every 32 those last that are near enough to be integrated as patches.

#include "pass/native/loops.h"

#include <string.h>

#include "kernel/light_spread.h"
#include "pass/native/sums.h"

struct vpl {
    f3 position, normal, flux;
    float area, near2, bound, strength;
};

static inline struct vpl vpl_at(const struct bd_native_vpls *vpls, uint32_t index)
{
    const struct bd_vec4 *v = &vpls->vpls[(size_t)index * BD_VPL_VEC4S];
    const f3 flux = f3_from(v + 2);
    return (struct vpl){
        f3_from(v), f3_from(v + 1), flux, v->w, v[1].w, bound_of_near(v[1].w), all_channels(flux)};
}

// What is known where a loop is expanded.
struct kind {
    bool hidden, near_patches, vector, spread;
};

// --- far ones -----------------------------------------------------------------------------------

// Adds the light of a block's VPL; near lanes get none of it, but are told. Whether any is near.
static inline __attribute__((always_inline)) uint32_t
add_far(const struct bd_receivers *restrict r, struct vpl vpl, struct kind kind,
        const uint32_t *restrict hidden, uint32_t at, uint32_t *restrict near,
        struct bd_receiver_light *restrict light)
{
    uint32_t any = 0;
    LANES(i)
    {
        const f3 n = f3_at(&r->normal, i), n_geometric = f3_at(&r->normal_geometric, i);
        const f3 to_vpl = f3_sub(vpl.position, f3_at(&r->position, i));
        const float r2 = f3_dot(to_vpl, to_vpl);
        float kernel = disk_light(n, n_geometric, to_vpl, r2, vpl.normal, vpl.area, vpl.bound);
        const uint32_t is_hidden = kind.hidden ? hidden[i] >> at & 1u : 0u;
        if (kind.hidden) kernel = f_select(is_hidden != 0u, 0.0f, kernel);
        if (kind.near_patches) {
            const bool is_near = b_and(r2 < vpl.near2, faces(vpl.normal, to_vpl, r2));
            kernel = f_select(is_near, 0.0f, kernel);
            near[i] = is_near & ~is_hidden;
            any |= near[i];
        }
        const f3 irradiance = f3_scale(vpl.flux, kernel);
        f3_add_at(&light->irradiance, i, irradiance);
        if (kind.vector)
            f3_add_at(&light->vector, i,
                      f3_scale(direction_of_unit(to_vpl, r2, n), vpl.strength * kernel));
        if (kind.spread) {
            const float part = spread_of_vpl(r->radius[i], r->off_plane[i], n_geometric, to_vpl, r2,
                                             vpl.normal, vpl.area, vpl.strength);
            light->spread[i] += kind.hidden ? f_select(is_hidden != 0u, 0.0f, part) : part;
        }
    }
    return any;
}

// --- near ones ----------------------------------------------------------------------------------

static void add_near(const struct bd_receivers *r, const struct bd_native_vpls *vpls,
                     const struct block *block, uint32_t first, uint32_t end, struct pairs *pairs,
                     struct bd_receiver_light *light)
{
    for (uint32_t index = first; index < end; index++) {
        for (uint32_t i = 0; block->any[index - first] && i < BD_LANES; i++) {
            if (!block->near[index - first][i] || r->lit[i] == 0) continue;
            add_pair(pairs, r, i, vpls, index, light);
        }
    }
    flush_pairs(pairs, light);
}

// --- all ----------------------------------------------------------------------------------------

static inline __attribute__((always_inline)) void
gather_block(const struct bd_receivers *r, const struct bd_native_vpls *vpls, uint32_t first,
             uint32_t end, struct kind kind, struct block *block, struct pairs *pairs,
             struct bd_receiver_light *light)
{
    uint32_t any = 0;
    for (uint32_t index = first; index < end; index++) {
        const uint32_t at = index - first;
        block->any[at] =
            add_far(r, vpl_at(vpls, index), kind, block->hidden, at, block->near[at], light);
        any |= block->any[at];
    }
    if (any) add_near(r, vpls, block, first, end, pairs, light);
}

// A copy of the loop for each kind.
static void gather_any_block(const struct bd_receivers *r, const struct bd_native_vpls *vpls,
                             uint32_t first, uint32_t end, bool is_hidden,
                             const struct bd_native_wishes *wishes, struct block *block,
                             struct pairs *pairs, struct bd_receiver_light *light)
{
#define GATHER(hidden, near, vector, spread)                                                       \
    gather_block(r, vpls, first, end, (struct kind){hidden, near, vector, spread}, block, pairs,   \
                 light)
#define GATHER_NEAR(hidden, vector, spread)                                                        \
    wishes->near_patches ? GATHER(hidden, true, vector, spread)                                    \
                         : GATHER(hidden, false, vector, spread)
#define GATHER_HIDDEN(vector, spread)                                                              \
    is_hidden ? (GATHER_NEAR(true, vector, spread)) : (GATHER_NEAR(false, vector, spread))
    if (wishes->spread)
        GATHER_HIDDEN(true, true);
    else if (wishes->vector)
        GATHER_HIDDEN(true, false);
    else
        GATHER_HIDDEN(false, false);
}

void WIDE(bd_native_gather)(const struct bd_receivers *receivers, const struct bd_native_vpls *vpls,
                            const struct bd_native_hidden *hidden,
                            const struct bd_native_wishes *wishes, struct bd_receiver_light *light)
{
    if (!any_is_lit(receivers)) return;
    struct bd_native_wishes own = *wishes;
    own.spread &= any_is_a_block(receivers);
    struct pairs pairs;
    struct block block;
    memset(&pairs, 0, sizeof pairs);
    for (uint32_t first = vpls->first; first < vpls->end; first += BD_VPLS_PER_SUM) {
        const uint32_t end =
            vpls->end - first < BD_VPLS_PER_SUM ? vpls->end : first + BD_VPLS_PER_SUM;
        struct bd_receiver_light sums;
        memset(&sums, 0, sizeof sums);
        for (uint32_t at = first; at < end; at += BLOCK_VPLS) {
            load_hidden(receivers, hidden, (at - vpls->first) / BLOCK_VPLS, &block);
            gather_any_block(receivers, vpls, at, end - at < BLOCK_VPLS ? end : at + BLOCK_VPLS,
                             hidden->bits != NULL, &own, &block, &pairs, &sums);
        }
        keep_sums(receivers, &sums, light);
    }
}
