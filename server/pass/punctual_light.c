#include "pass/punctual_light.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "pass/punctual_lanes.h"
#include "pass/straight.h"

// What sequences are for; others have those below (pass/area_samples.c).
#define OF_PUNCTUALS 64u
// Rays that are asked at once, unless a receiver alone has more.
#define ROOM 1024u

// A ray, and what share of the punctual light's light it brings to each half.
struct pick {
    uint32_t punctual, receiver;
    float share[2];
    f3 passed; // through glass
};

struct block {
    const struct bd_punctual_light *light;
    const struct bd_area_receiver *at; // of the block
    struct bd_area_light_found (*halves)[2];
    struct bd_sequence sequence;
    struct bd_punctual_cut cut;
    struct bd_punctual_lanes lanes;
    float weight[BD_PUNCTUAL_CUT_MAX]; // of punctual lights, for a receiver
    struct bd_punctual_pairs pairs;
    uint32_t room, count; // of rays
    struct bd_segment *segments;
    struct pick *picks;
    uint32_t *occluded;
};

// --- who may light it ---------------------------------------------------------------------------

static void find_punctuals(struct block *b, uint32_t count)
{
    f3 least = b->at[0].position, most = least;
    for (uint32_t i = 1; i < count; i++) {
        const f3 p = b->at[i].position;
        least = f3_of(f_min(least.x, p.x), f_min(least.y, p.y), f_min(least.z, p.z));
        most = f3_of(f_max(most.x, p.x), f_max(most.y, p.y), f_max(most.z, p.z));
    }
    bd_punctual_tree_cut(b->light->punctuals, least, most, &b->cut);
}

static uint32_t punctual_of(const struct block *b, uint32_t i)
{
    return b->light->punctuals->tree.order[b->cut.nodes[i].begin];
}

static const struct bd_light_uniform *punctual_at(const struct block *b, uint32_t i)
{
    return &b->light->punctuals->punctuals[punctual_of(b, i)];
}

static void lay_out(struct block *b)
{
    for (uint32_t i = 0; i < b->cut.punctual_count; i++)
        bd_punctual_lanes_put(&b->lanes, i, punctual_at(b, i));
}

// --- rays ---------------------------------------------------------------------------------------

static struct bd_segment segment_to(const struct bd_area_receiver *at,
                                    const struct bd_light_uniform *punctual)
{
    const f3 ahead = f3_of(punctual->direction.x, punctual->direction.y, punctual->direction.z);
    const bool parallel = punctual->kind == BD_LIGHT_KIND_DIRECTIONAL;
    const f3 to = parallel
                      ? f3_sub(at->position, f3_scale(ahead, punctual->distance))
                      : f3_of(punctual->position.x, punctual->position.y, punctual->position.z);
    return (struct bd_segment){.from = {at->position.x, at->position.y, at->position.z},
                               .from_triangle = at->triangle,
                               .to = {to.x, to.y, to.z},
                               .to_triangle = BD_NO_TRIANGLE};
}

static void add(struct bd_area_light_found *to, const struct bd_punctual_pairs *pairs, uint32_t i,
                f3 share)
{
    const struct bd_lanes3 *irradiance = &pairs->irradiance, *beyond = &pairs->beyond;
    to->irradiance = f3_add(
        to->irradiance, f3_mul(f3_of(irradiance->x[i], irradiance->y[i], irradiance->z[i]), share));
    to->beyond = f3_add(to->beyond, f3_mul(f3_of(beyond->x[i], beyond->y[i], beyond->z[i]), share));
}

// Of picks that nothing hides.
static void light_pairs(struct block *b, const struct pick *const picks[BD_LANES], uint32_t count)
{
    bd_punctual_pairs_light(&b->pairs, b->light->lambert);
    for (uint32_t i = 0; i < count; i++)
        for (int h = 0; h < 2; h++)
            add(&b->halves[picks[i]->receiver][h], &b->pairs, i,
                f3_scale(picks[i]->passed, picks[i]->share[h]));
}

// Whether glass, or what blends, is all that hides a ray's light.
static bool passes(struct block *b, uint32_t i)
{
    f3 *passed = &b->picks[i].passed;
    if (!bd_visibility_looks_through(b->light->visibility)) return false;
    *passed = bd_straight_along(b->light->visibility, &b->segments[i]);
    return passed->x > 0 || passed->y > 0 || passed->z > 0;
}

static void follow(struct block *b)
{
    const struct bd_punctual_light *light = b->light;
    const struct bd_light_uniform *punctuals = light->punctuals->punctuals;
    const struct pick *seen[BD_LANES];
    uint32_t count = 0;
    for (uint32_t i = 0; i < b->count; i++)
        b->segments[i] = segment_to(&b->at[b->picks[i].receiver], &punctuals[b->picks[i].punctual]);
    (void)bd_rays_occluded(light->visibility->occluders->rays, NULL,
                           bd_visibility_alpha_of_lights(light->visibility), b->segments, b->count,
                           b->occluded);
    for (uint32_t i = 0; i < b->count; i++) {
        struct pick *pick = &b->picks[i];
        if (b->occluded[i / 32] >> i % 32 & 1 && !passes(b, i)) continue;
        bd_punctual_pairs_put(&b->pairs, count, &b->at[pick->receiver], &punctuals[pick->punctual]);
        seen[count++] = pick;
        if (count == BD_LANES) {
            light_pairs(b, seen, count);
            count = 0;
        }
    }
    if (count > 0) light_pairs(b, seen, count);
    b->count = 0;
}

static void ask(struct block *b, uint32_t receiver, uint32_t punctual, float first, float second)
{
    BD_ASSERT(b->count < b->room);
    b->picks[b->count++] = (struct pick){punctual, receiver, {first, second}, {1, 1, 1}};
}

// --- choosing -----------------------------------------------------------------------------------

// Of the cut what gives the receiver anything.
struct choice {
    uint32_t count, punctual_count;      // punctual lights come first
    uint32_t place[BD_PUNCTUAL_CUT_MAX]; // in the cut
    float weight[BD_PUNCTUAL_CUT_MAX];   // 0 of what is asked for sure
    uint32_t rays;                       // that are left for others
    float left;                          // weight of those
};

static float sum_of(const struct choice *c)
{
    float sum = 0;
    for (uint32_t i = 0; i < c->count; i++) sum += c->weight[i];
    return sum;
}

// Punctual lights that even steps through all of the weight would meet each time.
static void ask_for_sure(struct block *b, uint32_t receiver, struct choice *c)
{
    bool goes_on = true;
    while (goes_on && c->rays > 0) {
        const float step = sum_of(c) / (float)c->rays;
        goes_on = false;
        for (uint32_t i = 0; i < c->punctual_count && c->rays > 0; i++) {
            if (!(c->weight[i] > 0) || c->weight[i] < step) continue;
            ask(b, receiver, punctual_of(b, c->place[i]), 1, 1);
            c->weight[i] = 0;
            c->rays--;
            goes_on = true;
        }
    }
    c->left = sum_of(c);
}

static void draw(struct block *b, uint32_t receiver, const struct choice *c, uint32_t i,
                 float number, uint32_t half, float step)
{
    const struct bd_area_receiver *at = &b->at[receiver];
    uint32_t punctual;
    float pdf = 1;
    if (i < c->punctual_count)
        punctual = punctual_of(b, c->place[i]);
    else if (!bd_punctual_tree_draw(b->light->punctuals, &b->cut.nodes[c->place[i]], at->position,
                                    at->normal, number, &punctual, &pdf))
        return;
    const float share = step / (c->weight[i] * pdf);
    if (isfinite(share)) ask(b, receiver, punctual, half ? 0 : share, half ? share : 0);
}

static void draw_half(struct block *b, uint32_t receiver, const struct choice *c, uint32_t half,
                      float start)
{
    const uint32_t count = c->rays > 1 ? c->rays / 2 : 1;
    const float step = c->left / (float)count;
    float before = 0;
    uint32_t next = 0;
    for (uint32_t i = 0; i < c->count; i++) {
        const float weight = c->weight[i];
        while (weight > 0 && next < count && ((float)next + start) * step < before + weight) {
            const float number = (((float)next + start) * step - before) / weight;
            draw(b, receiver, c, i, number, half, step);
            next++;
        }
        before += weight;
    }
}

static void keep(struct choice *c, uint32_t place, float weight)
{
    if (!(weight > 0)) return;
    c->place[c->count] = place;
    c->weight[c->count++] = weight;
}

static void weigh(struct block *b, const struct bd_area_receiver *at, struct choice *c)
{
    const struct bd_punctual_tree *punctuals = b->light->punctuals;
    bd_punctual_lanes_weigh(&b->lanes, b->cut.punctual_count, at, b->weight);
    for (uint32_t i = 0; i < b->cut.punctual_count; i++) keep(c, i, b->weight[i]);
    c->punctual_count = c->count;
    for (uint32_t i = b->cut.punctual_count; i < b->cut.count; i++)
        keep(c, i,
             bd_punctual_tree_weight(punctuals, b->cut.nodes[i].node, at->position, at->normal));
}

// What a lobe makes of it is its weight, too, or rays would go where a mirror sends none. Rough
// surfaces have one that tells at grazing angles.
static void weigh_lobes(struct block *b, const struct bd_area_receiver *at, struct choice *c)
{
    const struct bd_lanes3 *beyond = &b->pairs.beyond;
    if (b->light->lambert) return;
    for (uint32_t first = 0; first < c->punctual_count; first += BD_LANES) {
        const uint32_t left = c->punctual_count - first, count = left < BD_LANES ? left : BD_LANES;
        for (uint32_t i = 0; i < count; i++)
            bd_punctual_pairs_put(&b->pairs, i, at, punctual_at(b, c->place[first + i]));
        bd_punctual_pairs_light(&b->pairs, false);
        for (uint32_t i = 0; i < count; i++)
            c->weight[first + i] +=
                F_PI * f_max(f_abs(beyond->x[i]), f_max(f_abs(beyond->y[i]), f_abs(beyond->z[i])));
    }
}

static void choose(struct block *b, uint32_t receiver)
{
    const struct bd_area_receiver *at = &b->at[receiver];
    struct choice c;
    float number[2];
    c.rays = b->light->rays;
    c.count = 0;
    weigh(b, at, &c);
    if (c.count == c.punctual_count && c.count <= c.rays) {
        for (uint32_t i = 0; i < c.count; i++) ask(b, receiver, punctual_of(b, c.place[i]), 1, 1);
        return;
    }
    weigh_lobes(b, at, &c);
    ask_for_sure(b, receiver, &c);
    if (!(c.left > 0)) return;
    bd_sequence_pair(&b->sequence, at->place, number);
    for (uint32_t half = 0; half < 2; half++) draw_half(b, receiver, &c, half, number[half]);
}

// --- a block ------------------------------------------------------------------------------------

static void light_all(struct block *b, uint32_t count)
{
    find_punctuals(b, count);
    lay_out(b);
    for (uint32_t i = 0; i < count; i++) {
        if (b->count + b->light->rays + 2 > b->room) follow(b);
        choose(b, i);
    }
    follow(b);
}

void bd_punctual_light_block(const struct bd_punctual_light *light,
                             const struct bd_area_receiver *at, uint32_t count,
                             struct bd_area_light_found (*halves)[2])
{
    const uint32_t room = light->rays + 2 > ROOM ? light->rays + 2 : ROOM;
    if (count == 0) return;
    struct block *b = calloc(1, sizeof *b);
    BD_ASSERT(b);
    b->light = light;
    b->at = at;
    b->halves = halves;
    b->sequence = bd_sequence_of(light->seed, OF_PUNCTUALS);
    b->room = room;
    b->segments = malloc(room * sizeof *b->segments);
    b->picks = malloc(room * sizeof *b->picks);
    b->occluded = malloc((room / 32 + 1) * sizeof *b->occluded);
    BD_ASSERT(b->segments && b->picks && b->occluded);
    light_all(b, count);
    free(b->segments);
    free(b->picks);
    free(b->occluded);
    free(b);
}
