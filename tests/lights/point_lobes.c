// Points that send by lobes (lights/point_lobes.h): what they keep of the ways that light comes, and
// what of it they send, against the BRDF that is rendered.

#include <math.h>

#include "kernel/brdf.h"
#include "lights/point_lobes.h"
#include "tests/reference/stage.h"
#include "tests/unit/cmocka_all.h"

#define WAYS 6u

// Sides 0, 1 and 2: metal's front and back, and a wall's.
struct sides {
    struct stage *stage;
    struct bd_surface_hits hits;
    struct bd_surface_point places[3];
    struct bd_point_lobes lobes;
};

static void set_metal(struct stage *stage, int32_t material, float roughness)
{
    struct bd_material *m = stage_material_at(stage, material);
    m->metallic = 1;
    m->roughness = roughness;
    m->base_color[0] = .9f;
    m->base_color[1] = .6f;
    m->base_color[2] = .3f;
}

static struct bd_surface_point place_on(const struct sides *s, uint32_t triangle, float facing)
{
    struct bd_hit_triangle at;
    assert_true(bd_surface_hit_triangle(&s->hits, triangle, &at));
    const f3 sum = f3_add(f3_add(at.corner[0], at.corner[1]), at.corner[2]);
    return (struct bd_surface_point){
        .position = f3_scale(sum, 1 / 3.0f),
        .normal = f3_scale(at.normal, facing),
        .diffuse = bd_surface_hit_sent(&s->hits, triangle, 1 / 3.0f, 1 / 3.0f, BD_SENDS_ALL,
                                       BD_FROM_EVERYWHERE),
        .triangle = triangle,
    };
}

// A floor of metal, of two sides, and one of plastic.
static void make_beside(struct sides *s, float roughness)
{
    const uint32_t numbers[3] = {0, 1, 2};
    struct bd_err_detail detail;
    s->stage = stage_create();
    const int32_t metal = stage_material(s->stage, 1), wall = stage_material(s->stage, .8f);
    set_metal(s->stage, metal, .4f);
    stage_material_at(s->stage, wall)->roughness = roughness;
    stage_floor(s->stage, metal, 1, 0, 1);
    stage_floor(s->stage, wall, 1, 2, -1);
    stage_finish(s->stage, 1);
    bd_surface_hits_init(&s->hits, s->stage->scene);
    s->places[0] = place_on(s, 0, 1);
    s->places[1] = place_on(s, 0, -1);
    s->places[2] = place_on(s, 2, 1);
    assert_int_equal(
        bd_point_lobes_init(&s->lobes, &s->hits, s->places, numbers, 3, 3, &detail), BD_ERR_OK);
}

static void make(struct sides *s)
{
    make_beside(s, 1);
}

static void finish(struct sides *s)
{
    bd_point_lobes_finish(&s->lobes);
    bd_surface_hits_finish(&s->hits);
    stage_destroy(&s->stage);
}

// Over a floor, the nearer to its normal the more.
static void make_ways(struct bd_first_way ways[WAYS])
{
    for (uint32_t i = 0; i < WAYS; i++) {
        const float lean = .2f + .15f * (float)i, turn = 1.1f * (float)i, strength = 6 - (float)i;
        ways[i] = (struct bd_first_way){
            .irradiance = f3_of(strength, .5f * strength, .25f * strength),
            .way = f3_of(sinf(lean) * cosf(turn), cosf(lean), sinf(lean) * sinf(turn)),
        };
    }
}

static void those_that_shine_have_lobes(void **state)
{
    (void)state;
    struct sides s;
    make(&s);
    assert_int_equal(s.lobes.count, 2);
    assert_int_not_equal(s.lobes.of_side[0], BD_NO_LOBE);
    assert_int_not_equal(s.lobes.of_side[1], BD_NO_LOBE);
    assert_int_equal(s.lobes.of_side[2], BD_NO_LOBE);
    finish(&s);
}

// Under grazing light most of what plastic sends goes on from there.
static void smooth_plastic_has_one_too(void **state)
{
    (void)state;
    struct sides s;
    make_beside(&s, .5f);
    assert_int_equal(s.lobes.count, 3);
    assert_int_not_equal(s.lobes.of_side[2], BD_NO_LOBE);
    finish(&s);
}

// The two weakest, given first, are left to be told evenly.
static void the_strongest_four_are_kept(void **state)
{
    (void)state;
    struct sides s;
    struct bd_first_way ways[WAYS], given[WAYS];
    make(&s);
    make_ways(ways);
    for (uint32_t i = 0; i < WAYS; i++) given[i] = ways[WAYS - 1 - i];
    const f3 left = bd_point_lobes_keep(&s.lobes, &s.hits, &s.places[0], 0, given, WAYS);
    assert_float_equal(left.x, ways[4].irradiance.x + ways[5].irradiance.x, 1e-5);
    const f3 got = bd_point_lobes_get(&s.lobes, 0);
    assert_float_equal(got.y, .5f * (6 + 5 + 4 + 3), 1e-4);
    const f3 of_wall = bd_point_lobes_keep(&s.lobes, &s.hits, &s.places[2], 2, given, WAYS);
    assert_float_equal(of_wall.x, 6 + 5 + 4 + 3 + 2 + 1, 1e-5);
    assert_float_equal(bd_point_lobes_send(&s.lobes, 2, f3_of(0, -1, 0)).x, 0, 0);
    finish(&s);
}

static void they_send_by_the_whole_brdf(void **state)
{
    (void)state;
    struct sides s;
    struct bd_first_way ways[WAYS];
    make(&s);
    make_ways(ways);
    (void)bd_point_lobes_keep(&s.lobes, &s.hits, &s.places[0], 0, ways, WAYS);
    for (int k = 0; k < 8; k++) {
        const float lean = .17f * (float)k, turn = 2 * (float)k;
        const f3 v = f3_of(sinf(lean) * cosf(turn), cosf(lean), sinf(lean) * sinf(turn));
        const f3 sent = bd_point_lobes_send(&s.lobes, 0, v);
        f3 sum = f3_of(0, 0, 0);
        for (int i = 0; i < 4; i++)
            sum = f3_add(sum, f3_mul(ways[i].irradiance,
                                     gltf_brdf(f3_of(.9f, .6f, .3f), 1, .4f, .04f, f3_of(0, 1, 0),
                                               ways[i].way, v)));
        assert_float_equal(sent.x / sum.x, 1, .02); // directions are kept in steps
        assert_float_equal(sent.z / sum.z, 1, .02);
    }
    finish(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(those_that_shine_have_lobes),
        cmocka_unit_test(smooth_plastic_has_one_too),
        cmocka_unit_test(the_strongest_four_are_kept),
        cmocka_unit_test(they_send_by_the_whole_brdf),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
