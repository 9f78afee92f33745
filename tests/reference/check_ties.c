// Where a frame and the reference see different surfaces: which pixels are looked at, which are
// found, and that a plan traces those.

#include <stdlib.h>

#include "reference/check_plan.h"
#include "reference/check_ties.h"
#include "tests/unit/cmocka_all.h"

#define SIDE 256u
#define EDGE 128u // first column of what is farther away

struct scene {
    struct bd_image *beauty, *normal, *depth, *albedo;
    uint32_t tie;   // pixel at which the other surface is seen
    uint32_t looks; // at pixels
};

static bool is_far(uint32_t x_px)
{
    return x_px >= EDGE;
}

// A bright wall before a dark one.
static struct scene make_scene(void)
{
    struct scene s = {bd_image_create(SIDE, SIDE, 4),
                      bd_image_create(SIDE, SIDE, 3),
                      bd_image_create(SIDE, SIDE, 1),
                      bd_image_create(SIDE, SIDE, 3),
                      40 * SIDE + EDGE,
                      0};
    for (uint32_t y = 0; y < SIDE; y++) {
        for (uint32_t x = 0; x < SIDE; x++) {
            *bd_image_at(s.depth, x, y) = is_far(x) ? 2 : 1;
            bd_image_at(s.normal, x, y)[2] = 1;
            for (int c = 0; c < 3; c++) {
                bd_image_at(s.beauty, x, y)[c] = is_far(x) ? 0.01f : 1;
                bd_image_at(s.albedo, x, y)[c] = 0.5f;
            }
        }
    }
    return s;
}

static void free_scene(struct scene *s)
{
    bd_image_destroy(&s->beauty);
    bd_image_destroy(&s->normal);
    bd_image_destroy(&s->depth);
    bd_image_destroy(&s->albedo);
}

// Two samples, as of the two halves.
static void first_surface(void *user, uint32_t x_px, uint32_t y_px,
                          struct bd_reference_pixel *pixel)
{
    struct scene *s = user;
    bool other = y_px * SIDE + x_px == s->tie;
    s->looks++;
    pixel->coverage += 2;
    pixel->depth_m += 2 * (is_far(x_px) != other ? 2 : 1);
    pixel->normal[2] += 2;
    for (int c = 0; c < 3; c++) pixel->albedo[c] += 2 * 0.5;
}

static enum bd_err loop(void *user, uint32_t count, void (*work)(void *work_user, uint32_t i),
                        void *work_user)
{
    (void)user;
    for (uint32_t i = count; i-- > 0;) work(work_user, i);
    return BD_ERR_OK;
}

static struct bd_check_frame frame_of(const struct scene *s)
{
    return (struct bd_check_frame){
        .beauty = s->beauty, .normal = s->normal, .depth = s->depth, .albedo = s->albedo};
}

static void the_one_that_differs_is_found(void **state)
{
    (void)state;
    struct scene s = make_scene();
    const struct bd_check_frame frame = frame_of(&s);
    const struct bd_check_tracer tracer = {NULL, loop, &s, first_surface};
    struct bd_check_ties ties;
    assert_int_equal(bd_check_find_ties(&frame, &tracer, &ties, NULL), BD_ERR_OK);
    assert_int_equal(s.looks, 2 * SIDE); // a column on each side of the edge
    for (uint32_t i = 0; i < SIDE * SIDE; i++) assert_int_equal(ties.differs[i], i == s.tie);
    free(ties.differs);
    free_scene(&s);
}

static void without_a_look_there_is_nothing(void **state)
{
    (void)state;
    struct scene s = make_scene();
    struct bd_check_frame frame = frame_of(&s);
    struct bd_check_tracer tracer = {NULL, loop, &s, NULL};
    struct bd_check_ties ties;
    assert_int_equal(bd_check_find_ties(&frame, &tracer, &ties, NULL), BD_ERR_OK);
    assert_null(ties.differs);
    tracer.first_surface = first_surface;
    frame.albedo = NULL;
    assert_int_equal(bd_check_find_ties(&frame, &tracer, &ties, NULL), BD_ERR_OK);
    assert_null(ties.differs);
    free_scene(&s);
}

static bool is_planned(const struct bd_check_frame *frame, uint64_t seed, uint32_t pixel)
{
    struct bd_check_plan plan;
    bool found = false;
    assert_int_equal(bd_check_plan_make(frame, 64, seed, &plan, NULL), BD_ERR_OK);
    for (uint32_t i = 0; i < plan.sample_count; i++) found |= plan.samples[i].index == pixel;
    bd_check_plan_finish(&plan);
    return found;
}

// Chance finds it now and then; who looked, always.
static void a_plan_traces_it(void **state)
{
    (void)state;
    struct scene s = make_scene();
    struct bd_check_frame frame = frame_of(&s);
    const struct bd_check_tracer tracer = {NULL, loop, &s, first_surface};
    struct bd_check_ties ties;
    assert_int_equal(bd_check_find_ties(&frame, &tracer, &ties, NULL), BD_ERR_OK);
    uint32_t by_chance = 0;
    for (uint64_t seed = 0; seed < 20; seed++) {
        frame.ties = NULL;
        by_chance += is_planned(&frame, seed, s.tie);
        frame.ties = &ties;
        assert_true(is_planned(&frame, seed, s.tie));
    }
    assert_true(by_chance < 10);
    free(ties.differs);
    free_scene(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_one_that_differs_is_found),
        cmocka_unit_test(without_a_look_there_is_nothing),
        cmocka_unit_test(a_plan_traces_it),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
