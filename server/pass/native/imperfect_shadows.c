// What a virtual light sees of a set of points, which stand for disks: a lane each; what they cover
// is kept in the map one by one.

#include "pass/native/loops.h"

#include "kernel/imperfect_shadow.h"
#include "pass/native/lanes.h"

struct disks {
    struct bd_lanes3 to, normal; // in the map's axes
    float radius2[BD_LANES];
    float u[BD_LANES], v[BD_LANES], reach[BD_LANES]; // texels; reach < 0: below the horizon
    uint32_t number[BD_LANES];
};

// Keys of a texel each, of one step from the disks' own texels.
struct step {
    float u, v;
    uint32_t key[BD_LANES], texel[BD_LANES];
};

static void load(const struct bd_native_shadow *shadow, uint32_t first,
                 struct disks *restrict disks)
{
    for (uint32_t i = 0; i < BD_LANES; i++) {
        const uint32_t at = first + i < shadow->count ? first + i : first;
        const struct bd_shadow_point *point = &shadow->points[at];
        f3_put_at(&disks->to, i, f3_from(&point->place));
        f3_put_at(&disks->normal, i, f3_from(&point->normal_radius2));
        disks->radius2[i] = first + i < shadow->count ? point->normal_radius2.w : 0;
        disks->number[i] = at;
    }
}

static void place(const struct bd_shadow_centre *restrict centre, float side,
                  struct disks *restrict disks)
{
    const f3 from = f3_from(&centre->place_first), normal = f3_from(&centre->normal_there);
    const f3 across = f3_from(&centre->across), along = f3_cross(normal, across);
    LANES(i)
    {
        const f3 way = f3_sub(f3_at(&disks->to, i), from);
        const f3 to = in_axes(way, across, along, normal);
        const f3 own = in_axes(f3_at(&disks->normal, i), across, along, normal);
        const f3 at = place_of_way(to);
        const float reach = 0.5f * side * reach_of_disk(to, disks->radius2[i], at.z);
        const bool is_up = b_and(to.z > 0.0f, disks->radius2[i] > 0.0f);
        f3_put_at(&disks->to, i, to);
        f3_put_at(&disks->normal, i, own);
        disks->u[i] = texel_of_place(at.x, side);
        disks->v[i] = texel_of_place(at.y, side);
        disks->reach[i] = f_select(is_up, reach, -1.0f);
    }
}

// 2^23: from here on floats are whole numbers, which are their last bits. Conversions would keep the
// loop from being packed.
#define WHOLE 8388608.0f

// Texels, by their first corners.
static void look(const struct disks *restrict disks, float side, float near_most,
                 struct step *restrict step)
{
    const float step_u = step->u, step_v = step->v;
    LANES(i)
    {
        const float u = (disks->u[i] + WHOLE) - WHOLE + step_u;
        const float v = (disks->v[i] + WHOLE) - WHOLE + step_v;
        const f3 way = way_of_place(place_of_texel(u + 0.5f, side), place_of_texel(v + 0.5f, side));
        const bool is_in = b_and(b_and(u >= 0.0f, v >= 0.0f), b_and(u < side, v < side));
        const bool is_near = b_and(disks->reach[i] >= 0.0f, disks->reach[i] <= near_most);
        const float inside = f_select(is_in, 1.0f, 0.0f);
        const float counts = f_select(is_near, inside, 0.0f);
        const float distance = distance_to_disk(f3_at(&disks->to, i), f3_at(&disks->normal, i),
                                                disks->radius2[i], way);
        step->key[i] = key_of_disk(counts * distance, disks->number[i]);
        const uint texel = f_bits(v * side + u + WHOLE) - f_bits(WHOLE);
        step->texel[i] = u_select(is_in, texel, 0);
    }
}

static void keep(const struct step *step, uint32_t *map)
{
    for (uint32_t i = 0; i < BD_LANES; i++)
        if (step->key[i] < map[step->texel[i]]) map[step->texel[i]] = step->key[i];
}

static uint32_t held(float texel, uint32_t side)
{
    return texel <= 0 ? 0 : texel >= (float)side ? side : (uint32_t)texel;
}

// One that covers many texels.
static void keep_large(const struct disks *disks, size_t i, uint32_t side, uint32_t *map)
{
    const f3 to = f3_at(&disks->to, i), normal = f3_at(&disks->normal, i);
    const float reach = disks->reach[i] + 1, edge = (float)side;
    const uint32_t first_u = held(disks->u[i] - reach, side),
                   first_v = held(disks->v[i] - reach, side);
    const uint32_t end_u = held(disks->u[i] + reach + 1, side);
    const uint32_t end_v = held(disks->v[i] + reach + 1, side);
    for (uint32_t v = first_v; v < end_v; v++)
        for (uint32_t u = first_u; u < end_u; u++) {
            const f3 way = way_of_place(place_of_texel((float)u + 0.5f, edge),
                                        place_of_texel((float)v + 0.5f, edge));
            const float distance = distance_to_disk(to, normal, disks->radius2[i], way);
            const uint32_t key = key_of_disk(distance, disks->number[i]);
            if (key < map[v * side + u]) map[v * side + u] = key;
        }
}

// Middles of texels that are so near lie in the square of so many texels about the corner that is
// nearest; beyond the last they are looked for one by one.
#define NEAR_MOST   1
#define MIDDLE_MOST 2

static void draw(const struct disks *disks, float side, int reach, uint32_t *map)
{
    struct step step;
    for (int v = -reach; v < reach; v++)
        for (int u = -reach; u < reach; u++) {
            step.u = (float)u;
            step.v = (float)v;
            look(disks, side, (float)reach, &step);
            keep(&step, map);
        }
}

static int reach_of(const struct disks *disks)
{
    float most = 0;
    for (size_t i = 0; i < BD_LANES; i++)
        if (disks->reach[i] <= MIDDLE_MOST) most = f_max(most, disks->reach[i]);
    return most <= NEAR_MOST ? NEAR_MOST : MIDDLE_MOST;
}

void WIDE(bd_native_shadow)(const struct bd_native_shadow *shadow, uint32_t *map)
{
    const float side = (float)shadow->side_px;
    struct disks disks;
    for (uint32_t first = 0; first < shadow->count; first += BD_LANES) {
        load(shadow, first, &disks);
        place(shadow->centre, side, &disks);
        const int reach = reach_of(&disks);
        draw(&disks, side, reach, map);
        for (size_t i = 0; i < BD_LANES; i++)
            if (disks.reach[i] > (float)reach) keep_large(&disks, i, shadow->side_px, map);
    }
}
