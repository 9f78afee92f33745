#include "tests/native/stage.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "tests/unit/cmocka_all.h"

static uint64_t state;

void begin_chance(uint64_t seed)
{
    state = seed;
}

float chance(void)
{
    state = state * UINT64_C(6364136223846793005) + 1442695040888963407u;
    return (float)((double)(state >> 40) / (1 << 23) - 1);
}

struct bd_vec4 unit(void)
{
    struct bd_vec4 v = {chance(), chance(), chance(), 0};
    const float length = sqrtf(v.x * v.x + v.y * v.y + v.z * v.z);
    return (struct bd_vec4){v.x / length, v.y / length, v.z / length, 0};
}

void put(struct bd_lanes3 *lanes, uint32_t i, struct bd_vec4 v)
{
    lanes->x[i] = v.x;
    lanes->y[i] = v.y;
    lanes->z[i] = v.z;
}

static void set_receivers(struct bd_receivers *r)
{
    for (uint32_t i = 0; i < BD_LANES; i++) {
        const struct bd_vec4 up = {0, 0, 1, 0}, n = i % 3 ? unit() : up;
        put(&r->position, i, (struct bd_vec4){chance(), chance(), i % 3 ? chance() : 0, 0});
        put(&r->normal, i, n);
        put(&r->normal_geometric, i, n);
        r->lit[i] = i % 5 != 0;
        r->radius[i] = 0.01f * (float)(i % 4);
        r->off_plane[i] = (float)(i % 2);
    }
    r->position.x[0] = NAN; // of nothing that was seen
}

void set_vpl(struct stage *s, uint32_t v, struct bd_vec4 at, struct bd_vec4 n)
{
    struct bd_vec4 *vpl = &s->vpls[v * BD_VPL_VEC4S], *quad = &s->quads[v * BD_VPL_QUAD_VEC4S];
    const struct bd_vec4 side =
        fabsf(n.x) < 0.5f ? (struct bd_vec4){0, n.z, -n.y, 0} : (struct bd_vec4){-n.z, 0, n.x, 0};
    const float scale = 0.05f / sqrtf(side.x * side.x + side.y * side.y + side.z * side.z);
    const struct bd_vec4 u = {side.x * scale, side.y * scale, side.z * scale, 100};
    vpl[0] = (struct bd_vec4){at.x, at.y, at.z, 0.01f};
    vpl[1] = (struct bd_vec4){n.x, n.y, n.z, 0.02f};
    vpl[2] = (struct bd_vec4){0.5f + fabsf(chance()), fabsf(chance()), 0.1f, 0};
    quad[0] = u;
    quad[1] =
        (struct bd_vec4){n.y * u.z - n.z * u.y, n.z * u.x - n.x * u.z, n.x * u.y - n.y * u.x, 0};
}

static void set_vpls(struct stage *s)
{
    for (uint32_t v = 0; v < VPLS; v++) {
        const struct bd_vec4 up = {0, 0, 1, 0}, n = v % IN_PLANE ? unit() : up;
        const struct bd_vec4 at = {chance(), chance(), v % IN_PLANE ? chance() : 0, 0};
        set_vpl(s, v, at, n);
    }
}

struct stage *set_stage(void)
{
    struct stage *s = calloc(1, sizeof *s);
    assert_non_null(s);
    begin_chance(1);
    set_receivers(&s->receivers);
    set_vpls(s);
    return s;
}

struct bd_receiver_light gather(const struct bd_native_loops *loops, const struct stage *s,
                                struct bd_native_wishes wish)
{
    const struct bd_native_vpls vpls = {s->vpls, s->quads, 0, VPLS};
    const struct bd_native_hidden none = {0};
    struct bd_receiver_light light;
    memset(&light, 0, sizeof light);
    loops->gather(&s->receivers, &vpls, &none, &wish, &light);
    return light;
}

const struct bd_native_wishes wishes[6] = {
    {false, false, false}, {true, false, false}, {false, true, false},
    {true, true, false},   {false, true, true},  {true, true, true},
};

uint32_t *some_hidden(void)
{
    uint32_t *bits = calloc((size_t)WORDS * BD_LANES, sizeof *bits);
    assert_non_null(bits);
    for (uint32_t lane = 1; lane < BD_LANES; lane += 2)
        for (uint32_t w = 0; w < WORDS; w++) bits[lane * WORDS + w] = 0x9249u << w % 16;
    return bits;
}

double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

bool is_above_plane(double height, double r2)
{
    return height > 1e-5 && height * height > 4e-8 * r2;
}
