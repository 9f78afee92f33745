#include "pass/brushed.h"

#include <stdlib.h>
#include <string.h>

#include "lights/sequence.h"

// Numbers that nobody else of a frame draws by its seed.
#define PURPOSE 0x62727573u

struct bd_brushed_way bd_brushed_begins(uint32_t number, float spread_sr)
{
    return (struct bd_brushed_way){
        .number = number, .told_at = BD_NOT_TOLD, .spread_sr = spread_sr};
}

// A lobe spreads what comes by a lobe as roughness_over has it (kernel/brdf.h).
void bd_brushed_look(void *ways, uint32_t i, const struct bd_interface *at,
                     const struct bd_ray *ray, const struct bd_ray_hit *hit,
                     const struct bd_way *way)
{
    struct bd_brushed_way *brushed = (struct bd_brushed_way *)ways + i;
    const float spread_sr = brushed->spread_sr;
    brushed->told_at = way->events;
    brushed->spread_sr += 4 * F_PI * at->alpha * at->alpha;
    if (brushed->count == BD_BRUSHED_WALLS) return;
    const struct bd_surface_point place = {
        .position = at->position,
        .normal = at->normal_geometric,
        .triangle = at->triangle,
        .number = bd_stirred(brushed->number + brushed->count),
    };
    brushed->walls[brushed->count++] =
        (struct bd_brushed_wall){place, *ray, *hit, way->weight, spread_sr};
}

// Walls of all rays side by side.
struct walls {
    uint32_t count;
    uint32_t *of_ray;
    struct bd_surface_point *places;
    struct bd_ray *rays;
    struct bd_ray_hit *hits;
    float *spread_sr;
    bool *are;
    f3 *weight, *seen, *irradiance;
};

static bool make_room(struct walls *w, const struct bd_brushed_way *ways, uint32_t ray_count)
{
    size_t count = 1;
    for (uint32_t i = 0; i < ray_count; i++) count += ways[i].count;
    *w = (struct walls){
        .of_ray = malloc(count * sizeof *w->of_ray),
        .places = malloc(count * sizeof *w->places),
        .rays = malloc(count * sizeof *w->rays),
        .hits = malloc(count * sizeof *w->hits),
        .spread_sr = malloc(count * sizeof *w->spread_sr),
        .are = malloc(count * sizeof *w->are),
        .weight = malloc(count * sizeof *w->weight),
        .seen = malloc(count * sizeof *w->seen),
        .irradiance = malloc(count * sizeof *w->irradiance),
    };
    return w->of_ray && w->places && w->rays && w->hits && w->spread_sr && w->are && w->weight &&
           w->seen && w->irradiance;
}

static void finish(struct walls *w)
{
    void *arrays[] = {w->of_ray, w->places, w->rays, w->hits,      w->spread_sr,
                      w->are,    w->weight, w->seen, w->irradiance};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) free(arrays[i]);
}

static void list(struct walls *w, const struct bd_brushed_way *ways, uint32_t ray_count)
{
    for (uint32_t i = 0; i < ray_count; i++)
        for (uint32_t k = 0; k < ways[i].count; k++) {
            const struct bd_brushed_wall *wall = &ways[i].walls[k];
            const uint32_t next = w->count++;
            w->of_ray[next] = i;
            w->places[next] = wall->place;
            w->rays[next] = wall->ray;
            w->hits[next] = wall->hit;
            w->weight[next] = wall->weight;
            w->spread_sr[next] = wall->spread_sr;
            w->are[next] = true;
            w->seen[next] = f3_of(0, 0, 0);
        }
}

enum bd_err bd_brushed_light(const struct bd_pass_context *context,
                             const struct bd_surface_hits *surfaces,
                             const struct bd_first_light *first,
                             const struct bd_visibility_inputs *visibility, uint64_t seed,
                             const struct bd_brushed_way *ways, uint32_t ray_count, f3 *light,
                             struct bd_ray_counts *traced, struct bd_err_detail *detail)
{
    struct walls w;
    enum bd_err err = BD_ERR_OK;
    memset(light, 0, ray_count * sizeof *light);
    if (make_room(&w, ways, ray_count))
        list(&w, ways, ray_count);
    else
        err = bd_err_set(detail, BD_ERR_NO_MEMORY, "size", "no memory for what %u rays met",
                         ray_count);
    const struct bd_first_looks looks = {surfaces, w.rays, w.hits, w.are, w.spread_sr, w.seen};
    if (w.count > 0)
        err = bd_first_light_run(context, first, visibility, seed + PURPOSE, w.places, w.count,
                                 &looks, w.irradiance, NULL, traced, detail);
    for (uint32_t k = 0; !err && k < w.count; k++)
        light[w.of_ray[k]] = f3_add(light[w.of_ray[k]], f3_mul(w.weight[k], w.seen[k]));
    finish(&w);
    return err;
}
