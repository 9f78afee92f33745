// What specular lobes of a group of receivers make of VPLs beyond their diffuse lobe, as
// shaders/common/vpl_gather.glsl sums it: in the order of the list, of every 32 those last that are
// near enough to be integrated as patches.

#include "pass/native/loops.h"

#include <string.h>

#include "kernel/brdf.h"
#include "pass/native/sums.h"

// What is known where a loop is expanded.
struct kind {
    bool hidden, near_patches;
};

// What is the same for all VPLs at a lane (kernel/brdf.h).
struct view {
    float roughness[BD_LANES], cosine[BD_LANES], root[BD_LANES];
};

// Pairs of near VPLs with the surfaces of their lanes.
struct glossy_pairs {
    struct pairs pairs;
    struct bd_glossy_receivers surfaces;
    struct view view;
    struct bd_lanes3 light;
};

struct gathering {
    const struct bd_receivers *receivers;
    const struct bd_glossy_receivers *surfaces;
    const struct bd_native_vpls *vpls;
    struct view view;
    struct block block;
    struct glossy_pairs near;
    struct bd_lanes3 sum;
};

// --- lobes --------------------------------------------------------------------------------------

static void see_from(const struct bd_lanes3 *restrict normal,
                     const struct bd_glossy_receivers *restrict g, struct view *restrict view)
{
    LANES(i)
    {
        const float roughness = patch_roughness(g->roughness[i]);
        const float cosine = view_cosine(f3_at(normal, i), f3_at(&g->viewer, i));
        view->roughness[i] = roughness;
        view->cosine[i] = cosine;
        view->root[i] = smith_root(cosine, ggx_alpha(roughness));
    }
}

KERNEL f3 beyond_diffuse_at(const struct bd_glossy_receivers *g, const struct view *view, size_t i,
                            f3 n, f3 to_vpl)
{
    const f3 l = f3_scale(to_vpl, 1.0f / f_sqrt(f3_dot(to_vpl, to_vpl)));
    return beyond_diffuse_of_view(f3_at(&g->base_color, i), g->metallic[i], view->roughness[i],
                                  g->f0_dielectric[i], n, l, f3_at(&g->viewer, i), view->cosine[i],
                                  view->root[i]);
}

// `kernels`: irradiance of a unit of the VPL's flux.
static void add_lobes(const struct bd_receivers *restrict r,
                      const struct bd_glossy_receivers *restrict g,
                      const struct view *restrict view, const struct bd_vec4 *vpl,
                      const float *restrict kernels, struct bd_lanes3 *restrict sum)
{
    const f3 position = f3_from(vpl), flux = f3_from(vpl + 2), none = f3_of(0.0f, 0.0f, 0.0f);
    LANES(i)
    {
        const f3 to_vpl = f3_sub(position, f3_at(&r->position, i));
        const f3 beyond = beyond_diffuse_at(g, view, i, f3_at(&r->normal, i), to_vpl);
        const f3 light = f3_mul(f3_scale(flux, kernels[i]), beyond);
        f3_add_at(sum, i, f3_select(kernels[i] > 0.0f, light, none));
    }
}

// --- far ones -----------------------------------------------------------------------------------

// Of a block's VPL; 0 for near lanes, which are told. Whether any is near.
static inline __attribute__((always_inline)) uint32_t
find_kernels(const struct bd_receivers *restrict r, const struct bd_vec4 *vpl, struct kind kind,
             const uint32_t *restrict hidden, uint32_t at, uint32_t *restrict near,
             float *restrict kernels)
{
    const f3 position = f3_from(vpl), normal = f3_from(vpl + 1);
    const float area = vpl->w, near2 = vpl[1].w, bound = bound_of_near(near2);
    uint32_t any = 0;
    LANES(i)
    {
        const f3 to_vpl = f3_sub(position, f3_at(&r->position, i));
        const float r2 = f3_dot(to_vpl, to_vpl);
        float kernel = disk_light(f3_at(&r->normal, i), f3_at(&r->normal_geometric, i), to_vpl, r2,
                                  normal, area, bound);
        const uint32_t is_hidden = kind.hidden ? hidden[i] >> at & 1u : 0u;
        if (kind.hidden) kernel = f_select(is_hidden != 0u, 0.0f, kernel);
        if (kind.near_patches) {
            const bool is_near = b_and(r2 < near2, faces(normal, to_vpl, r2));
            kernel = f_select(is_near, 0.0f, kernel);
            near[i] = is_near & ~is_hidden;
            any |= near[i];
        }
        kernels[i] = kernel;
    }
    return any;
}

static uint32_t lit_count(const float *kernels)
{
    uint32_t count = 0;
    LANES(i) count += kernels[i] > 0.0f;
    return count;
}

// --- near ones ----------------------------------------------------------------------------------

static void light_near(struct glossy_pairs *restrict near)
{
    LANES(i)
    {
        const f3 to_vpl = f3_at(&near->pairs.to_vpl, i), none = f3_of(0.0f, 0.0f, 0.0f);
        const f3 irradiance = f3_at(&near->pairs.irradiance, i);
        const f3 beyond = beyond_diffuse_at(&near->surfaces, &near->view, i,
                                            f3_at(&near->pairs.normal, i), to_vpl);
        const bool is_lit = all_channels(irradiance) > 0.0f;
        f3_put_at(&near->light, i, f3_select(is_lit, f3_mul(irradiance, beyond), none));
    }
}

static void flush_near(struct gathering *g)
{
    struct glossy_pairs *near = &g->near;
    if (near->pairs.count == 0) return;
    light_pairs(&near->pairs);
    see_from(&near->pairs.normal, &near->surfaces, &near->view);
    light_near(near);
    for (uint32_t k = 0; k < near->pairs.count; k++)
        f3_add_at(&g->sum, near->pairs.lane[k], f3_at(&near->light, k));
    near->pairs.count = 0;
}

static void add_glossy_pair(struct gathering *g, uint32_t lane, uint32_t index)
{
    struct bd_glossy_receivers *to = &g->near.surfaces;
    const struct bd_glossy_receivers *from = g->surfaces;
    if (g->near.pairs.count == BD_LANES) flush_near(g);
    const uint32_t k = g->near.pairs.count;
    add_pair(&g->near.pairs, g->receivers, lane, g->vpls, index, NULL); // who flushes no others
    f3_put_at(&to->viewer, k, f3_at(&from->viewer, lane));
    f3_put_at(&to->base_color, k, f3_at(&from->base_color, lane));
    to->metallic[k] = from->metallic[lane];
    to->roughness[k] = from->roughness[lane];
    to->f0_dielectric[k] = from->f0_dielectric[lane];
}

static void add_near(struct gathering *g, uint32_t first, uint32_t end)
{
    const struct block *block = &g->block;
    for (uint32_t index = first; index < end; index++) {
        for (uint32_t i = 0; block->any[index - first] && i < BD_LANES; i++)
            if (block->near[index - first][i] && g->receivers->lit[i] > 0)
                add_glossy_pair(g, i, index);
    }
    flush_near(g);
}

// --- all ----------------------------------------------------------------------------------------

static inline __attribute__((always_inline)) void gather_block(struct gathering *g, uint32_t first,
                                                               uint32_t end, struct kind kind)
{
    struct block *block = &g->block;
    uint32_t any = 0;
    for (uint32_t index = first; index < end; index++) {
        const struct bd_vec4 *vpl = &g->vpls->vpls[(size_t)index * BD_VPL_VEC4S];
        const uint32_t at = index - first;
        float kernels[BD_LANES];
        block->any[at] =
            find_kernels(g->receivers, vpl, kind, block->hidden, at, block->near[at], kernels);
        any |= block->any[at];
        if (lit_count(kernels) > 0)
            add_lobes(g->receivers, g->surfaces, &g->view, vpl, kernels, &g->sum);
    }
    if (any) add_near(g, first, end);
}

// A copy of the loop for each kind.
static void gather_any_block(struct gathering *g, uint32_t first, uint32_t end, bool is_hidden,
                             bool near_patches)
{
    if (is_hidden && near_patches)
        gather_block(g, first, end, (struct kind){true, true});
    else if (is_hidden)
        gather_block(g, first, end, (struct kind){true, false});
    else if (near_patches)
        gather_block(g, first, end, (struct kind){false, true});
    else
        gather_block(g, first, end, (struct kind){false, false});
}

static void keep_lobes(const struct bd_receivers *restrict r,
                       const struct bd_glossy_receivers *restrict g,
                       const struct bd_lanes3 *restrict sum, struct bd_lanes3 *restrict light)
{
    const f3 none = f3_of(0.0f, 0.0f, 0.0f);
    LANES(i)
    {
        const bool is_glossy = b_and(r->lit[i] > 0.0f, g->has_lobe[i] > 0.0f);
        f3_add_at(light, i, f3_select(is_glossy, f3_at(sum, i), none));
    }
}

void WIDE(bd_native_gather_glossy)(const struct bd_receivers *receivers,
                                   const struct bd_glossy_receivers *surfaces,
                                   const struct bd_native_vpls *vpls,
                                   const struct bd_native_hidden *hidden,
                                   const struct bd_native_wishes *wishes, struct bd_lanes3 *light)
{
    if (!any_is_lit(receivers)) return;
    struct gathering g = {.receivers = receivers, .surfaces = surfaces, .vpls = vpls};
    see_from(&receivers->normal, surfaces, &g.view);
    for (uint32_t first = vpls->first; first < vpls->end; first += BD_VPLS_PER_SUM) {
        const uint32_t end =
            vpls->end - first < BD_VPLS_PER_SUM ? vpls->end : first + BD_VPLS_PER_SUM;
        memset(&g.sum, 0, sizeof g.sum);
        for (uint32_t at = first; at < end; at += BLOCK_VPLS) {
            load_hidden(receivers, hidden, (at - vpls->first) / BLOCK_VPLS, &g.block);
            gather_any_block(&g, at, end - at < BLOCK_VPLS ? end : at + BLOCK_VPLS,
                             hidden->bits != NULL, wishes->near_patches);
        }
        keep_lobes(receivers, surfaces, &g.sum, light);
    }
}
