#include "lights/solids.h"

#include <math.h>
#include <string.h>

struct solid {
    uint32_t material;
    double size_m2;
    float ior;
    f3 extinction;
};

static const struct solid air = {.material = UINT32_MAX, .size_m2 = INFINITY, .ior = 1};

static uint32_t material_of(const struct bd_surface_hits *hits, uint32_t triangle)
{
    return (uint32_t)bd_surface_hit_of(hits, triangle).primitive->material;
}

static struct solid solid_of(const struct bd_surface_hits *hits, uint32_t triangle)
{
    const struct bd_surface_hit hit = bd_surface_hit_of(hits, triangle);
    return (struct solid){
        .material = (uint32_t)hit.primitive->material,
        .size_m2 = bd_solid_size_m2(hit.instance, hit.primitive),
        .ior = hits->scene->materials[hit.primitive->material].ior,
        .extinction = bd_interface_extinction(hits, hit.primitive->material),
    };
}

static bool is_within(const struct bd_surface_hits *hits, uint32_t triangle, f3 place)
{
    const struct bd_surface_hit hit = bd_surface_hit_of(hits, triangle);
    const bd_dvec3 at = {place.x, place.y, place.z};
    const bd_dvec3 world =
        bd_dvec3_add(hits->space.origin_m, bd_dvec3_scale(at, 1 / hits->space.render_per_m));
    return bd_solid_box_holds(hits->scene, hit.instance, world);
}

// Which of them is left through that edge: the last of its material; `count` where none is.
static uint32_t left_of(const struct bd_surface_hits *hits, const struct bd_solids *solids,
                        uint32_t material)
{
    for (uint32_t i = solids->count; i-- > 0;)
        if (material_of(hits, solids->triangle[i]) == material) return i;
    return solids->count;
}

static bool is_before(const struct solid *a, const struct solid *b)
{
    return a->size_m2 != b->size_m2 ? a->size_m2 < b->size_m2 : a->material < b->material;
}

// The smallest at a place but for one of them, or air.
static struct solid there_but(const struct bd_surface_hits *hits, const struct bd_solids *solids,
                              uint32_t but, f3 place)
{
    struct solid there = air;
    for (uint32_t i = 0; i < solids->count; i++) {
        if (i == but || !is_within(hits, solids->triangle[i], place)) continue;
        const struct solid solid = solid_of(hits, solids->triangle[i]);
        if (is_before(&solid, &there)) there = solid;
    }
    return there;
}

struct bd_solid_edge bd_solid_edge_at(const struct bd_surface_hits *hits,
                                      const struct bd_solids *solids, const struct bd_interface *at)
{
    struct bd_solid_edge edge = {.ior = at->ior, .inside = at->extinction};
    if (solids->count == 0 || at->thin) return edge;
    const struct solid own = solid_of(hits, at->triangle);
    const uint32_t but = at->entering ? solids->count : left_of(hits, solids, own.material);
    const struct solid beyond = there_but(hits, solids, but, at->position);
    edge.is_none = beyond.material == own.material || is_before(&beyond, &own);
    edge.inside = edge.is_none ? beyond.extinction : own.extinction;
    edge.outside = beyond.extinction;
    edge.ior = beyond.ior > 0 ? own.ior / beyond.ior : own.ior;
    return edge;
}

static void forget(struct bd_solids *solids, uint32_t i)
{
    solids->count--;
    memmove(solids->triangle + i, solids->triangle + i + 1,
            (solids->count - i) * sizeof *solids->triangle);
}

// Where none of the material is there it is the last one that ends: a solid of several materials.
void bd_solids_cross(const struct bd_surface_hits *hits, struct bd_solids *solids,
                     const struct bd_interface *at)
{
    if (!at->entering && solids->count == 0) return;
    if (!at->entering) {
        const uint32_t left = left_of(hits, solids, material_of(hits, at->triangle));
        forget(solids, left < solids->count ? left : solids->count - 1);
        return;
    }
    if (solids->count == BD_SOLIDS_MAX) forget(solids, 0);
    solids->triangle[solids->count++] = at->triangle;
}
