#include "pass/env_choice.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "lights/sequence.h"
#include "pass/receivers.h"

#define SIDE_PX        BD_ENV_CHOICE_SIDE
#define TEXELS         BD_ENV_CHOICE_TEXELS
#define CANDIDATES     40u
#define TRIED_MOST     200u
#define REARS_MOST     0.5f  // of what a candidate sees
#define COSINE_LEAST   0.05f // or one texel outweighs a wall
#define SWAPS_MOST     32u
#define TEXELS_AS_NEAR 1.0f // as wide as that, another triangle's texel sees the same
#define GAIN_LEAST     0.001f // of what is seen already
// Of the slicer, one for each evaluation of a VPL.
#define UNITS_PER_TEXEL 10.0
#define OF_PLACES       0x656e7600u

struct texel {
    f3 position, normal;
    uint32_t triangle;
    float area; // of what it sees; 0: nothing, or a rear
    bool two_sided;
    uint8_t seen_by; // of those chosen
};

struct candidate {
    struct bd_env_map map;
    struct texel *texels;
    bool is_chosen;
};

struct choosing {
    const struct bd_pass_context *context;
    const struct bd_env_maps_inputs *inputs;
    const struct bd_surface_hits *hits;
    struct candidate candidates[CANDIDATES];
    uint32_t count, tried;
    // Who is added or dropped, and by how much it changes how many see a texel.
    const struct candidate *changed;
    int change;
    struct bd_err_detail *detail;
};

// --- candidates ---------------------------------------------------------------------------------

static f3 place_of(const struct choosing *c, uint32_t number)
{
    const struct bd_features *f = &c->inputs->snapshot->features;
    const struct bd_sequence across = bd_sequence_of(c->inputs->seed, OF_PLACES);
    const struct bd_sequence up = bd_sequence_of(c->inputs->seed, OF_PLACES + 1);
    float xz[2], y[2];
    bd_sequence_pair(&across, number, xz);
    bd_sequence_pair(&up, number, y);
    const bd_dvec3 extent = bd_dvec3_sub(f->bounds_max, f->bounds_min);
    const bd_dvec3 at = bd_render_from_world(
        &c->hits->space, (bd_dvec3){f->bounds_min.x + (double)xz[0] * extent.x,
                                    f->bounds_min.y + (double)y[0] * extent.y,
                                    f->bounds_min.z + (double)xz[1] * extent.z});
    return f3_of((float)at.x, (float)at.y, (float)at.z);
}

// Eq. 1, of one face: a texel's square, as far off and as flat as its surface is. Rears take light.
static struct texel texel_of(const struct choosing *c, const struct bd_env_map *map, uint32_t i)
{
    struct bd_hit_triangle triangle;
    struct texel texel = {.triangle = map->triangles[i]};
    const float distance = map->distances[i];
    if (!isfinite(distance) || !bd_surface_hit_triangle(c->hits, texel.triangle, &triangle))
        return texel;
    const f3 d = bd_env_texel_direction(SIDE_PX, i);
    const float length = f3_length(d), depth = distance / length;
    const float cosine = -f3_dot(triangle.normal, d) / length;
    texel.position = f3_add(map->centre, f3_scale(d, depth));
    texel.normal = triangle.normal;
    texel.two_sided = triangle.two_sided;
    if (cosine > 0 || triangle.two_sided)
        texel.area = 4.0f / (SIDE_PX * SIDE_PX) * depth * depth /
                     (length * f_max(f_abs(cosine), COSINE_LEAST));
    return texel;
}

// False: it looks at rears, or at nothing.
static bool take_texels(const struct choosing *c, struct candidate *candidate)
{
    uint32_t fronts = 0, rears = 0;
    for (uint32_t i = 0; i < TEXELS; i++) {
        candidate->texels[i] = texel_of(c, &candidate->map, i);
        const bool is_there = isfinite(candidate->map.distances[i]);
        fronts += is_there && candidate->texels[i].area > 0;
        rears += is_there && !(candidate->texels[i].area > 0);
    }
    return fronts > 0 && (float)rears <= REARS_MOST * (float)(fronts + rears);
}

static void free_candidate(struct candidate *candidate)
{
    bd_env_map_free(&candidate->map);
    free(candidate->texels);
    *candidate = (struct candidate){0};
}

// Of places, one after the other, until enough do. Where none does, the first is better than none.
static enum bd_err find_candidates(struct choosing *c)
{
    enum bd_err err = BD_ERR_OK;
    for (; !err && c->count < CANDIDATES && c->tried < TRIED_MOST; c->tried++) {
        struct candidate *candidate = &c->candidates[c->count];
        candidate->texels = malloc(TEXELS * sizeof *candidate->texels);
        if (!candidate->texels)
            return bd_err_set(c->detail, BD_ERR_NO_MEMORY, "env_maps", "no memory for candidates");
        err = bd_env_map_look(c->context, c->inputs->scene, c->hits, c->inputs->choice_tracer,
                              place_of(c, c->tried), SIDE_PX, &candidate->map, c->detail);
        const bool is_last_chance = c->count == 0 && c->tried + 1 == TRIED_MOST;
        if (!err && (take_texels(c, candidate) || is_last_chance))
            c->count++;
        else
            free_candidate(candidate);
    }
    return err;
}

// --- who sees what ------------------------------------------------------------------------------

static bool sees(const struct candidate *candidate, const struct texel *texel)
{
    const struct bd_env_map *map = &candidate->map;
    const f3 way = f3_sub(texel->position, map->centre);
    const float distance2 = f3_dot(way, way);
    if (!texel->two_sided && f3_dot(texel->normal, way) >= 0) return false;
    if (!(distance2 > 0)) return true;
    const uint32_t i = bd_env_texel_towards(SIDE_PX, way);
    const float near = 1 - TEXELS_AS_NEAR * 2 / SIDE_PX;
    return map->triangles[i] == texel->triangle || near * f_sqrt(distance2) <= map->distances[i];
}

static void change_of(void *user, uint32_t i)
{
    const struct choosing *c = user;
    const struct candidate *candidate = &c->candidates[i];
    for (uint32_t t = 0; t < TEXELS; t++) {
        struct texel *texel = &candidate->texels[t];
        if (texel->area > 0 && (candidate == c->changed || sees(c->changed, texel)))
            texel->seen_by = (uint8_t)(texel->seen_by + c->change);
    }
}

static enum bd_err change(struct choosing *c, struct candidate *whom, int by)
{
    c->changed = whom;
    c->change = by;
    whom->is_chosen = by > 0;
    bd_slicer_work(c->context->slicer, "environment choice");
    return bd_receivers_each(c->context, c->count, UNITS_PER_TEXEL * TEXELS, change_of, c);
}

// A(v | C), or of one that is chosen A(v | C \ {v}).
static double seen_alone(const struct candidate *candidate)
{
    double area = 0;
    for (uint32_t i = 0; i < TEXELS; i++)
        if (candidate->texels[i].seen_by == candidate->is_chosen) area += candidate->texels[i].area;
    return area;
}

// --- the choice ---------------------------------------------------------------------------------

// Who sees the most that nobody else does, of those that are not chosen; or the least, of those
// that are. The first of several alike; NULL where there is none.
static struct candidate *best(struct choosing *c, bool of_chosen, double *area)
{
    struct candidate *found = NULL;
    for (uint32_t i = 0; i < c->count; i++) {
        struct candidate *candidate = &c->candidates[i];
        if (candidate->is_chosen != of_chosen) continue;
        const double own = seen_alone(candidate);
        if (found && (of_chosen ? own >= *area : own <= *area)) continue;
        found = candidate;
        *area = own;
    }
    return found;
}

static enum bd_err choose_by_gain(struct choosing *c, double *covered)
{
    enum bd_err err = BD_ERR_OK;
    for (uint32_t k = 0; !err && k < c->inputs->count; k++) {
        double gain;
        struct candidate *next = best(c, false, &gain);
        if (!next || (k > 0 && !(gain > GAIN_LEAST * *covered))) break;
        *covered += gain;
        err = change(c, next, 1);
    }
    return err;
}

// One comes and one goes, while more is seen for it.
static enum bd_err swap_while_better(struct choosing *c, double *covered)
{
    enum bd_err err = BD_ERR_OK;
    for (uint32_t k = 0; !err && k < SWAPS_MOST; k++) {
        double gain, loss = 0;
        struct candidate *next = best(c, false, &gain);
        if (!next || !(gain > 0)) return BD_ERR_OK;
        err = change(c, next, 1);
        struct candidate *last = best(c, true, &loss);
        const bool is_better = last != next && gain > (1 + (double)GAIN_LEAST) * loss;
        if (!err) err = change(c, is_better ? last : next, -1);
        if (!is_better) return err;
        *covered += gain - loss;
    }
    return err;
}

enum bd_err bd_env_choose(const struct bd_pass_context *context,
                          const struct bd_env_maps_inputs *inputs,
                          const struct bd_surface_hits *hits, struct bd_env_choice *out,
                          struct bd_err_detail *detail)
{
    struct choosing c = {.context = context, .inputs = inputs, .hits = hits, .detail = detail};
    double covered = 0;
    *out = (struct bd_env_choice){0};
    enum bd_err err = find_candidates(&c);
    if (!err) err = choose_by_gain(&c, &covered);
    if (!err) err = swap_while_better(&c, &covered);
    for (uint32_t i = 0; i < c.count; i++)
        if (c.candidates[i].is_chosen) out->centres[out->count++] = c.candidates[i].map.centre;
    out->covered = (float)covered;
    out->tried = c.tried;
    out->refused = c.tried - c.count;
    for (uint32_t i = 0; i < CANDIDATES; i++) free_candidate(&c.candidates[i]);
    return err;
}
