// Fragments of a picture that VPLs are splatted to hold what they would gather.

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

#include "blocks.h"
#include "kernel.h"
#include "pass/splat_fragments.h"

static bool everywhere(uint32_t x, uint32_t y)
{
    (void)x, (void)y;
    return true;
}

static bool on_a_line(uint32_t x, uint32_t y)
{
    return (int)x - (int)y / 2 == 20;
}

static bool but_a_corner(uint32_t x, uint32_t y)
{
    return x > 9 || y > 6;
}

static void waves(uint32_t x, uint32_t y, double n[3])
{
    n[0] = 0.3 * sin(0.4 * x), n[1] = 0.2 * sin(0.3 * y);
    n[2] = sqrt(1 - n[0] * n[0] - n[1] * n[1]);
}

static const struct blocks_scene lined = {
    .width_px = 53, // odd on purpose
    .height_px = 37,
    .coarsest_side = 7,
    .discontinuous = on_a_line,
    .lit = but_a_corner,
    .normal = waves,
    .vpl_count = 300,
};

// Of two lists of VPLs, the second of which is the first once more.
static struct bd_multires_light *light_of(struct blocks *b, bool splat, bool vector)
{
    const struct bd_vpl_list *const twice[] = {&b->vpls, &b->vpls};
    const struct bd_gather_fragments_inputs inputs = {
        .scene = &b->scene,
        .viewpoint = &b->viewpoint,
        .gbuffer = &b->gbuffer,
        .discontinuity = &b->discontinuity,
        .fragments = &b->fragments,
        .lists = twice,
        .list_count = 2,
        .vector = vector,
    };
    struct bd_multires_light *light;
    struct bd_err_detail detail = {0};
    enum bd_err err = splat ? bd_splat_fragments_run(&b->context, &inputs, &light, &detail)
                            : bd_gather_fragments_run(&b->context, &inputs, &light, &detail);
    if (err) fail_msg("%s", detail.message);
    return light;
}

// Largest value; fails where the two differ by more than rounding, or in where there is data.
static double expect_same(struct bd_gpu *gpu, const struct bd_tex *a, const struct bd_tex *b)
{
    float *one = blocks_texels(gpu, a), *other = blocks_texels(gpu, b);
    double largest = 0;
    size_t count = bd_tex_bytes(a) / sizeof *one;
    for (size_t i = 0; i < count; i++) largest = fmax(largest, fabs((double)one[i]));
    for (size_t i = 0; i < count; i++) {
        double off = fabs((double)one[i] - other[i]);
        assert_true(i % 4 == 3 ? off == 0 : off <= 1e-5 * largest);
    }
    free(one), free(other);
    return largest;
}

static void compare(struct bd_gpu *gpu, const struct blocks_scene *scene, bool has_coarse)
{
    struct blocks b;
    blocks_create(gpu, scene, &b);
    struct bd_multires_light *gathered = light_of(&b, false, true);
    struct bd_multires_light *splatted = light_of(&b, true, true);
    assert_true(expect_same(gpu, gathered->fine, splatted->fine) > 0);
    assert_true(expect_same(gpu, gathered->fine_vector, splatted->fine_vector) > 0);
    assert_true(has_coarse == (expect_same(gpu, gathered->coarse, splatted->coarse) > 0));
    assert_true(has_coarse ==
                (expect_same(gpu, gathered->coarse_vector, splatted->coarse_vector) > 0));
    bd_multires_light_destroy(gpu, &gathered);
    bd_multires_light_destroy(gpu, &splatted);
    blocks_destroy(&b);
}

static void splats_add_up_to_what_is_gathered(void **state)
{
    compare(*state, &lined, true);
}

static void pixels_alone_are_fragments_too(void **state)
{
    struct blocks_scene scene = lined;
    scene.discontinuous = everywhere;
    compare(*state, &scene, false);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(splats_add_up_to_what_is_gathered),
        cmocka_unit_test(pixels_alone_are_fragments_too),
    };
    return cmocka_run_group_tests(tests, kernel_open_device, kernel_close_device);
}
