#include "pass/direct_look.h"

#include <stddef.h>

#define MASKED 0x80000000u
// Texels that are looked up: so many on each side of the pixel's own.
#define REACH       3
#define WINDOW      (2 * REACH + 1)
#define INNER_REACH 1 // of those that say whether light may pass

struct looking {
    const struct bd_native_loops *loops;
    const struct bd_native_aim *aim;
    const struct bd_shadow_copy *shadows;
    uint32_t said[BD_LANES];
    uint32_t count; // of pairs
    uint32_t lane[BD_LANES], id[BD_LANES], asked[BD_LANES];
    struct bd_native_pairs pairs;
};

// --- texels -------------------------------------------------------------------------------------

static int clamped(int at, int last)
{
    return at < 0 ? 0 : at > last ? last : at;
}

// Of a coordinate. Outside of a map is outside, as far as it may be; so is what is not a number.
static int texel_at(float at, uint32_t side_px)
{
    const float far = (float)side_px + REACH;
    const float within = at > -1.0f - REACH ? (at < far ? at : far) : -1.0f - REACH;
    const int whole = (int)within;
    return whole - ((float)whole > within);
}

void bd_direct_rows_of(const struct bd_native_aim *aim, uint32_t side_px,
                       struct bd_shadow_rows rows[BD_DIRECT_FACES])
{
    const int last = (int)side_px - 1;
    for (uint32_t f = 0; f < BD_DIRECT_FACES; f++) rows[f] = (struct bd_shadow_rows){side_px, 0};
    for (uint32_t i = 0; i < BD_LANES; i++) {
        struct bd_shadow_rows *of_face = &rows[aim->face[i]];
        if (!aim->is_lit[i]) continue;
        const int y = texel_at(aim->texel.y[i], side_px);
        const uint32_t first = (uint32_t)clamped(y - REACH, last);
        const uint32_t end = (uint32_t)clamped(y + REACH, last) + 1;
        if (first < of_face->first) of_face->first = first;
        if (end > of_face->end) of_face->end = end;
    }
}

// Those around a pixel's own in rows, `*stride` apart; where they leave the face, a copy.
static const uint32_t *texels_around(const struct looking *k, uint32_t lane, uint32_t *copy,
                                     size_t *stride)
{
    const uint32_t *ids = k->shadows->faces[k->aim->face[lane]], side_px = k->shadows->side_px;
    const int side = (int)side_px, last = side - 1;
    const int x = texel_at(k->aim->texel.x[lane], side_px) - REACH;
    const int y = texel_at(k->aim->texel.y[lane], side_px) - REACH;
    *stride = side_px;
    if (x >= 0 && y >= 0 && x + WINDOW <= side && y + WINDOW <= side)
        return ids + (size_t)y * side_px + (size_t)x;
    for (int i = 0; i < WINDOW * WINDOW; i++)
        copy[i] = ids[(size_t)clamped(y + i / WINDOW, last) * side_px +
                      (size_t)clamped(x + i % WINDOW, last)];
    *stride = WINDOW;
    return copy;
}

// Whether they all name one triangle. Rows are looked at in two halves, which overlap.
static bool are_alike(const uint32_t *texels, size_t stride)
{
    const uint32_t one = texels[REACH * stride + REACH];
    uint32_t differ[REACH + 1] = {0};
    for (uint32_t y = 0; y < WINDOW; y++)
        for (uint32_t x = 0; x <= REACH; x++)
            differ[x] |= (texels[y * stride + x] ^ one) | (texels[y * stride + x + REACH] ^ one);
    return !(differ[0] | differ[1] | differ[2] | differ[3]);
}

// --- triangles ----------------------------------------------------------------------------------

static void put(struct bd_lanes3 *lanes, uint32_t i, float x, float y, float z)
{
    lanes->x[i] = x;
    lanes->y[i] = y;
    lanes->z[i] = z;
}

static void put_pair(struct looking *k, uint32_t i, uint32_t lane, const struct bd_vec4 *triangle)
{
    const struct bd_lanes3 *origin = &k->aim->origin, *span = &k->aim->span;
    put(&k->pairs.origin, i, origin->x[lane], origin->y[lane], origin->z[lane]);
    put(&k->pairs.span, i, span->x[lane], span->y[lane], span->z[lane]);
    put(&k->pairs.corner, i, triangle[0].x, triangle[0].y, triangle[0].z);
    put(&k->pairs.edge1, i, triangle[1].x, triangle[1].y, triangle[1].z);
    put(&k->pairs.edge2, i, triangle[2].x, triangle[2].y, triangle[2].z);
    k->pairs.texel_side[i] = k->aim->texel.side[lane];
}

static const struct bd_vec4 *triangle_of(const struct looking *k, uint32_t id)
{
    return &k->shadows->triangles[(size_t)3 * (id - 1)];
}

static void flush(struct looking *k)
{
    uint32_t said[BD_LANES];
    for (uint32_t i = 0; i < k->count; i++) put_pair(k, i, k->lane[i], triangle_of(k, k->id[i]));
    if (k->count > 0) k->loops->ask(&k->pairs, said);
    for (uint32_t i = 0; i < k->count; i++) k->said[k->lane[i]] |= said[i] & k->asked[i];
    k->count = 0;
}

// A triangle is asked once for a pixel, whatever many texels name it. Of millions each comes from
// memory: all of them are on their way before the first is looked at.
static void add_pair(struct looking *k, uint32_t lane, uint32_t id, uint32_t asked)
{
    for (uint32_t i = k->count; i > 0 && k->lane[i - 1] == lane; i--) {
        if (k->id[i - 1] != id) continue;
        k->asked[i - 1] |= asked;
        return;
    }
    if (k->count == BD_LANES) flush(k);
    const uint32_t i = k->count++;
    k->lane[i] = lane;
    k->id[i] = id;
    k->asked[i] = asked;
    __builtin_prefetch(triangle_of(k, id));
    __builtin_prefetch(triangle_of(k, id) + 2);
}

// A masked triangle has holes that only its own texel knows of.
static void add_named(struct looking *k, uint32_t lane, uint32_t named, uint32_t asked)
{
    const uint32_t id = named & ~MASKED;
    const bool is_hole = named & MASKED && !(asked & BD_PAIR_STANDS);
    if (id == 0 || id == k->aim->triangle[lane]) {
        k->said[lane] |= asked & BD_PAIR_OPENS;
        return;
    }
    if (is_hole) asked &= ~BD_PAIR_HIDES;
    if (asked) add_pair(k, lane, id, asked);
}

// What texels name that lie `from` to before `end` in both directions, unless the one before did,
// or the pixel's own.
static inline void look_at(struct looking *k, uint32_t lane, const uint32_t *texels, size_t stride,
                           uint32_t from, uint32_t end, uint32_t asked)
{
    uint32_t before = texels[REACH * stride + REACH];
    for (uint32_t y = from; y < end; y++) {
        for (uint32_t x = from; x < end; x++) {
            const uint32_t named = texels[y * stride + x];
            if (named != before) add_named(k, lane, named, asked);
            before = named;
        }
    }
}

static void look(struct looking *k, uint32_t lane)
{
    uint32_t copy[WINDOW * WINDOW];
    size_t stride;
    const uint32_t *texels = texels_around(k, lane, copy, &stride);
    add_named(k, lane, texels[REACH * stride + REACH],
              BD_PAIR_OPENS | BD_PAIR_HIDES | BD_PAIR_STANDS);
    if (are_alike(texels, stride)) return;
    look_at(k, lane, texels, stride, REACH - INNER_REACH, REACH + INNER_REACH + 1,
            BD_PAIR_OPENS | BD_PAIR_HIDES);
    look_at(k, lane, texels, stride, 0, WINDOW, BD_PAIR_HIDES);
}

// To the sums of lanes that nothing hides.
static void add_opened(const struct looking *k, const struct bd_lanes3 *light, struct bd_vec4 *sums)
{
    for (uint32_t i = 0; i < BD_LANES; i++) {
        sums[i].w = 1;
        if (k->said[i] != BD_PAIR_OPENS) continue;
        sums[i].x += light->x[i];
        sums[i].y += light->y[i];
        sums[i].z += light->z[i];
    }
}

void bd_direct_look(const struct bd_native_loops *loops, const struct bd_native_aim *aim,
                    const struct bd_shadow_copy *shadows, struct bd_vec4 *radiance,
                    struct bd_vec4 *irradiance)
{
    struct looking k = {.loops = loops, .aim = aim, .shadows = shadows};
    for (uint32_t i = 0; i < BD_LANES; i++)
        if (aim->is_lit[i]) look(&k, i);
    flush(&k);
    add_opened(&k, &aim->radiance, radiance);
    if (irradiance) add_opened(&k, &aim->irradiance, irradiance);
}
