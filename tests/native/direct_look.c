// What a shadow map names near a pixel's texel, and what of that hides the pixel
// (pass/direct_look.h).

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "pass/direct_look.h"
#include "tests/native/stage.h"
#include "tests/unit/cmocka_all.h"

#define MAP_TEXELS 16u

#define OWN  1u // the pixel's triangle, in its plane
#define HIT  2u // what the segment meets
#define MISS 3u // what it does not, though the pixel lies behind its plane
#define MASK 0x80000000u

static const struct bd_vec4 around[] = {
    {-1, -1, 0, 0}, {4, 0, 0, 0},   {0, 4, 0, 0}, {-1, -1, .5f, 0}, {4, 0, 0, 0},
    {0, 4, 0, 0},   {5, 5, .5f, 0}, {4, 0, 0, 0}, {0, 4, 0, 0},
};

struct look_up {
    uint32_t ids[MAP_TEXELS * MAP_TEXELS];
    float x, y; // the pixel's texel
};

static bool arrives(const struct look_up *from)
{
    struct bd_native_aim aim = {.is_lit = {1}, .face = {5}, .triangle = {OWN}};
    struct bd_vec4 radiance[BD_LANES] = {{1, 1, 1, 0}};
    const struct bd_shadow_copy shadows = {{[5] = from->ids}, MAP_TEXELS, around};
    struct bd_shadow_rows rows[BD_DIRECT_FACES];
    put(&aim.span, 0, (struct bd_vec4){0, 0, 1, 0});
    put(&aim.radiance, 0, (struct bd_vec4){1, 2, 3, 0});
    aim.texel.x[0] = from->x;
    aim.texel.y[0] = from->y;
    aim.texel.side[0] = .1f;
    bd_direct_look(bd_native_loops(), &aim, &shadows, radiance, NULL);
    bd_direct_rows_of(&aim, MAP_TEXELS, rows);
    assert_true(rows[5].first == (from->y < 3 ? 0 : (uint32_t)from->y - 3));
    assert_true(rows[5].end == (from->y > 12 ? MAP_TEXELS : (uint32_t)from->y + 4));
    assert_true(rows[0].first >= rows[0].end);
    assert_true(radiance[0].z == 1 || radiance[0].z == 4);
    return radiance[0].z == 4;
}

static struct look_up look_up_of(uint32_t id, float x, float y)
{
    struct look_up l = {.x = x, .y = y};
    for (uint32_t i = 0; i < MAP_TEXELS * MAP_TEXELS; i++) l.ids[i] = id;
    return l;
}

static bool arrives_past(uint32_t around_it, int32_t x, int32_t y, uint32_t named)
{
    struct look_up l = look_up_of(around_it, 8.5f, 8.5f);
    l.ids[(8 + y) * (int32_t)MAP_TEXELS + 8 + x] = named;
    return arrives(&l);
}

static void a_texel_near_by_may_name_what_hides(void **unused)
{
    (void)unused;
    for (int32_t y = -4; y <= 4; y++) {
        for (int32_t x = -4; x <= 4; x++) {
            const bool near = abs(x) <= 3 && abs(y) <= 3, at = x == 0 && y == 0;
            assert_true(arrives_past(OWN, x, y, HIT) == !near);
            assert_true(arrives_past(0, x, y, HIT) == !near);
            assert_true(arrives_past(OWN, x, y, MISS));
            assert_true(arrives_past(OWN, x, y, MASK | HIT) == !at); // it has a hole there
            // Where none of the inner nine is open.
            const bool inner = abs(x) <= 1 && abs(y) <= 1;
            assert_true(arrives_past(MISS, x, y, OWN) == inner);
            assert_true(arrives_past(MASK | MISS, x, y, 0) == inner);
        }
    }
}

// Beyond its border a map goes on as it ends.
static void a_map_ends(void **unused)
{
    (void)unused;
    static const float at[] = {-5, -.5f, 0, 2.9f, 3, 12.9f, 13, 15.9f, 16.1f, 40, NAN};
    for (size_t i = 0; i < sizeof at / sizeof *at; i++) {
        for (int turned = 0; turned < 2; turned++) {
            const float x = turned ? 8 : at[i], y = turned && at[i] >= 0 && at[i] < 16 ? at[i] : 8;
            struct look_up open = look_up_of(OWN, x, y), hidden = look_up_of(HIT, x, y);
            assert_true(arrives(&open));
            assert_false(arrives(&hidden));
            const bool sees_corner = x < 4 && y < 4;
            open.ids[0] = HIT;
            assert_true(arrives(&open) == !sees_corner);
        }
    }
    struct look_up corner = look_up_of(OWN, 2.5f, 1.5f);
    corner.ids[0] = HIT;
    assert_false(arrives(&corner));
    struct look_up right = look_up_of(OWN, 14.5f, 8), left = look_up_of(OWN, -.5f, 8);
    for (uint32_t y = 0; y < MAP_TEXELS; y++) {
        right.ids[y * MAP_TEXELS] = HIT; // on the other side
        left.ids[y * MAP_TEXELS + 3] = HIT;
    }
    assert_true(arrives(&right) && arrives(&left));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_texel_near_by_may_name_what_hides),
        cmocka_unit_test(a_map_ends),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
