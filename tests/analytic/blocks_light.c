// Light at blocks of pixels: gathered at their centres by either visit, and interpolated to every
// pixel (hazards 30, 31, 33, 57 of algorithms.md).

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "blocks.h"
#include "kernel.h"

#define WIDTH  53 // odd on purpose
#define HEIGHT 37
#define PIXELS (WIDTH * HEIGHT)

static bool everywhere(uint32_t x, uint32_t y)
{
    (void)x, (void)y;
    return true;
}

// A slanted line through the picture.
static bool on_a_line(uint32_t x, uint32_t y)
{
    return (int)x - (int)y / 2 == 20;
}

// Blocks of at most 8 pixels a side end here.
static bool left_half(uint32_t x, uint32_t y)
{
    (void)y;
    return x < 24;
}

static bool but_a_corner(uint32_t x, uint32_t y)
{
    return x > 9 || y > 6;
}

static const struct blocks_scene lined = {
    .width_px = WIDTH,
    .height_px = HEIGHT,
    .coarsest_side = 7,
    .discontinuous = on_a_line,
    .lit = but_a_corner,
    .vpl_count = 1500,
};

// --- gathering ----------------------------------------------------------------------------------

static void pixels_as_fragments_are_the_full_gather(void **state)
{
    struct blocks_scene scene = lined;
    scene.discontinuous = everywhere;
    struct blocks b;
    blocks_create(*state, &scene, &b);
    float *full = blocks_gathered(&b);
    for (int visit = BD_FRAGMENT_VISIT_LIST; visit <= BD_FRAGMENT_VISIT_MASK; visit++) {
        struct bd_multires_light *light = blocks_light(&b, (enum bd_fragment_visit)visit, false);
        float *seen = blocks_upsampled(&b, &light, BD_SURFACE_DETAIL_OFF);
        for (size_t i = 0; i < PIXELS; i++)
            assert_memory_equal(seen + 4 * i, full + 4 * i, 3 * sizeof *full);
        assert_true(seen[4 * (PIXELS - 1)] > 0);
        free(seen);
    }
    free(full);
    blocks_destroy(&b);
}

// Of colours, not of what marks data.
static double difference(const float *a, const float *b, size_t count, double *largest)
{
    double worst = 0;
    for (size_t i = 0; i < count; i++) {
        if (i % 4 == 3) continue;
        worst = fmax(worst, fabs((double)a[i] - b[i]));
        *largest = fmax(*largest, fabs((double)a[i]));
    }
    return worst;
}

static void both_visits_light_the_same_blocks(void **state)
{
    struct blocks b;
    blocks_create(*state, &lined, &b);
    struct bd_multires_light *list = blocks_light(&b, BD_FRAGMENT_VISIT_LIST, true);
    struct bd_multires_light *mask = blocks_light(&b, BD_FRAGMENT_VISIT_MASK, true);
    struct bd_tex *const pairs[][2] = {{list->fine, mask->fine},
                                       {list->coarse, mask->coarse},
                                       {list->fine_vector, mask->fine_vector},
                                       {list->coarse_vector, mask->coarse_vector}};
    for (size_t p = 0; p < 4; p++) {
        float *a = blocks_texels(*state, pairs[p][0]), *c = blocks_texels(*state, pairs[p][1]);
        double largest = 0;
        double worst = difference(a, c, bd_tex_bytes(pairs[p][0]) / sizeof *a, &largest);
        print_message("    texture %zu: %.2g of %.3g\n", p, worst, largest);
        assert_true(largest > 0.1 && worst <= 1e-6 * largest);
        free(a), free(c);
    }
    bd_multires_light_destroy(*state, &list);
    bd_multires_light_destroy(*state, &mask);
    blocks_destroy(&b);
}

static void only_fragments_hold_data(void **state)
{
    struct blocks b;
    blocks_create(*state, &lined, &b);
    struct bd_multires_light *light = blocks_light(&b, BD_FRAGMENT_VISIT_MASK, false);
    float *fine = blocks_texels(*state, light->fine),
          *coarse = blocks_texels(*state, light->coarse);
    double found = 0;
    for (size_t i = 0; i < bd_tex_bytes(light->fine) / 16; i++) found += fine[4 * i + 3];
    for (size_t i = 0; i < bd_tex_bytes(light->coarse) / 16; i++) found += coarse[4 * i + 3];
    for (uint32_t i = 0; i < b.fragments.count; i++) {
        uint32_t level = BD_FRAGMENT_LEVEL(b.list[i]);
        size_t at = blocks_texel(&b, level, BD_FRAGMENT_X(b.list[i]), BD_FRAGMENT_Y(b.list[i]));
        assert_true((level ? coarse : fine)[4 * at + 3] == 1);
    }
    assert_true(found == b.fragments.count);
    free(fine), free(coarse);
    bd_multires_light_destroy(*state, &light);
    blocks_destroy(&b);
}

// Where the picture's edge leaves an odd number of pixels the middle one is the centre; else the
// four around it are, to second order.
static void blocks_are_lit_at_their_centres(void **state)
{
    struct blocks_scene scene = lined;
    scene.discontinuous = NULL;
    struct blocks b;
    blocks_create(*state, &scene, &b);
    float *full = blocks_gathered(&b);
    struct bd_multires_light *light = blocks_light(&b, BD_FRAGMENT_VISIT_LIST, false);
    float *coarse = blocks_texels(*state, light->coarse);
    uint32_t checked = 0;
    for (uint32_t i = 0; i < b.fragments.count; i++) {
        uint32_t k = BD_FRAGMENT_LEVEL(b.list[i]), bx = BD_FRAGMENT_X(b.list[i]);
        uint32_t by = BD_FRAGMENT_Y(b.list[i]), x0, x1, y0, y1;
        blocks_pixels(k, bx, WIDTH, &x0, &x1);
        blocks_pixels(k, by, HEIGHT, &y0, &y1);
        if (!but_a_corner(x0, y0)) continue;
        uint32_t xs[2] = {(x0 + x1) / 2, (x0 + x1 + 1) / 2},
                 ys[2] = {(y0 + y1) / 2, (y0 + y1 + 1) / 2};
        double mean = 0;
        for (int c = 0; c < 4; c++) mean += 0.25 * full[4 * (ys[c / 2] * WIDTH + xs[c % 2])];
        double seen = coarse[4 * blocks_texel(&b, k, bx, by)];
        bool single = xs[0] == xs[1] && ys[0] == ys[1];
        // A neighbour of the centre would be off by 2 %.
        assert_true(fabs(seen / mean - 1) < (single ? 1e-6 : 5e-3));
        checked += single ? 1 : 0;
    }
    assert_true(checked > 0);
    free(full), free(coarse);
    bd_multires_light_destroy(*state, &light);
    blocks_destroy(&b);
}

// --- interpolating ------------------------------------------------------------------------------

static void linear_light_stays_linear(void **state)
{
    struct blocks b;
    blocks_create(*state, &lined, &b);
    struct bd_multires_light *light = blocks_linear_light(&b);
    float *seen = blocks_upsampled(&b, &light, BD_SURFACE_DETAIL_OFF);
    double worst = 0, sum = 0;
    uint32_t inner = 0;
    for (uint32_t i = 0; i < PIXELS; i++) {
        uint32_t x = i % WIDTH, y = i / WIDTH;
        if (!but_a_corner(x, y)) {
            assert_true(seen[4 * i] == 0);
            continue;
        }
        assert_true(fabs(seen[4 * i] - 1) < 1e-5); // a hole would be black
        // Past the outermost centres of blocks there is nothing to interpolate with.
        if (x < 4 || y < 4 || x >= WIDTH - 4 || y >= HEIGHT - 4 || !but_a_corner(x - 4, y - 4))
            continue;
        double off = fmax(fabs(seen[4 * i + 1] - x), fabs(seen[4 * i + 2] - y));
        worst = fmax(worst, off);
        sum += off;
        inner++;
    }
    print_message("    off by %.3g px, mean %.3g px\n", worst, sum / inner);
    assert_true(worst < 1 && sum / inner < 0.04);
    free(seen);
    blocks_destroy(&b);
}

static double step(uint32_t x, uint32_t y)
{
    return left_half(x, y) ? 0 : 0.3;
}

// Blocks end where the surface steps, so that no discontinuity is in any of them.
static void light_stays_on_its_surface(void **state)
{
    struct blocks_scene scene = lined;
    scene.discontinuous = NULL;
    scene.height = step;
    struct blocks b;
    blocks_create(*state, &scene, &b);
    struct bd_multires_light *light = blocks_linear_light(&b);
    float *coarse = blocks_texels(*state, light->coarse);
    for (uint32_t i = 0; i < b.fragments.count; i++) {
        uint32_t k = BD_FRAGMENT_LEVEL(b.list[i]), x = BD_FRAGMENT_X(b.list[i]);
        coarse[4 * blocks_texel(&b, k, x, BD_FRAGMENT_Y(b.list[i]))] = left_half(x << k, 0) ? 1 : 0;
    }
    bd_tex_upload(*state, light->coarse, 0, coarse, bd_tex_bytes(light->coarse));
    float *seen = blocks_upsampled(&b, &light, BD_SURFACE_DETAIL_OFF);
    for (uint32_t i = 0; i < PIXELS; i++) {
        uint32_t x = i % WIDTH, y = i / WIDTH;
        double expected = but_a_corner(x, y) && left_half(x, y) ? 1 : 0;
        assert_true(fabs(seen[4 * i] - expected) < 1e-6);
    }
    free(coarse), free(seen);
    blocks_destroy(&b);
}

static void black_is_data(void **state)
{
    struct blocks b;
    blocks_create(*state, &lined, &b);
    struct bd_multires_light *light;
    struct bd_err_detail detail;
    assert_int_equal(bd_multires_light_create(*state, &b.fragments.layout, BD_LIGHT_VECTORS_NONE,
                                              &light, &detail),
                     0);
    float *coarse = calloc(1, bd_tex_bytes(light->coarse)),
          *fine = calloc(1, bd_tex_bytes(light->fine));
    for (uint32_t i = 0; i < b.fragments.count; i++) {
        uint32_t k = BD_FRAGMENT_LEVEL(b.list[i]), x = BD_FRAGMENT_X(b.list[i]);
        float *texel = (k ? coarse : fine) + 4 * blocks_texel(&b, k, x, BD_FRAGMENT_Y(b.list[i]));
        texel[0] = k == 3 && x == 5 ? 1.0f : 0.0f; // pixels 40 to 47 in white, all else black
        texel[3] = 1;
    }
    bd_tex_upload(*state, light->coarse, 0, coarse, bd_tex_bytes(light->coarse));
    bd_tex_upload(*state, light->fine, 0, fine, bd_tex_bytes(light->fine));
    float *seen = blocks_upsampled(&b, &light, BD_SURFACE_DETAIL_OFF);
    double white = 0;
    for (uint32_t i = 0; i < 8 * WIDTH; i++) {
        if (i % WIDTH < 24) assert_true(seen[4 * i] == 0); // the next block but one, and its halo
        white = fmax(white, seen[4 * i]);
    }
    assert_true(white > 0.7);
    free(coarse), free(fine), free(seen);
    blocks_destroy(&b);
}

// --- surface detail -----------------------------------------------------------------------------

static void ripple(uint32_t x, uint32_t y, double n[3])
{
    double angle = 0.25 * sin(1.3 * x + 0.7 * y);
    n[0] = sin(angle);
    n[1] = 0;
    n[2] = cos(angle);
}

static double error_of(const float *seen, const float *full)
{
    double squares = 0, mean = 0;
    for (uint32_t i = 0; i < PIXELS; i++) {
        squares += pow(seen[4 * i] - full[4 * i], 2);
        mean += full[4 * i];
    }
    return sqrt(squares * PIXELS) / mean;
}

static double error_with_detail(struct bd_gpu *gpu, const struct blocks_scene *scene,
                                enum bd_surface_detail detail)
{
    struct blocks b;
    blocks_create(gpu, scene, &b);
    float *full = blocks_gathered(&b);
    struct bd_multires_light *light =
        blocks_light(&b, BD_FRAGMENT_VISIT_LIST, detail == BD_SURFACE_DETAIL_DIRECTION);
    float *seen = blocks_upsampled(&b, &light, detail);
    double error = error_of(seen, full);
    free(seen), free(full);
    blocks_destroy(&b);
    return error;
}

// Normals that ripple within blocks: with the irradiance vector hardly more is lost than where they
// do not.
static void detail_follows_the_pixels_normal(void **state)
{
    struct blocks_scene scene = lined;
    scene.discontinuous = NULL;
    scene.lit = NULL;
    double flat = error_with_detail(*state, &scene, BD_SURFACE_DETAIL_OFF);
    scene.normal = ripple;
    double off = error_with_detail(*state, &scene, BD_SURFACE_DETAIL_OFF);
    double direction = error_with_detail(*state, &scene, BD_SURFACE_DETAIL_DIRECTION);
    print_message("    flat %.3g, rippled %.3g, with detail %.3g\n", flat, off, direction);
    assert_true(flat < 0.06); // bilinear interpolation alone: .09
    assert_true(off > 2 * flat && direction < 1.1 * flat);
}

static void the_papers_detail_darkens(void **state)
{
    struct blocks_scene scene = lined;
    scene.normal = ripple;
    struct blocks b;
    blocks_create(*state, &scene, &b);
    struct bd_multires_light *light = blocks_light(&b, BD_FRAGMENT_VISIT_LIST, false);
    float *plain = blocks_upsampled(&b, &light, BD_SURFACE_DETAIL_OFF);
    light = blocks_light(&b, BD_FRAGMENT_VISIT_LIST, false);
    float *darker = blocks_upsampled(&b, &light, BD_SURFACE_DETAIL_PAPER);
    for (uint32_t i = 0; i < PIXELS; i++) {
        double n[3];
        ripple(i % WIDTH, i / WIDTH, n);
        if (plain[4 * i] > 0)
            assert_true(fabs(darker[4 * i] / plain[4 * i] - 0.5 * (1 + n[2])) < 1e-5);
    }
    free(plain), free(darker);
    blocks_destroy(&b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pixels_as_fragments_are_the_full_gather),
        cmocka_unit_test(both_visits_light_the_same_blocks),
        cmocka_unit_test(only_fragments_hold_data),
        cmocka_unit_test(blocks_are_lit_at_their_centres),
        cmocka_unit_test(linear_light_stays_linear),
        cmocka_unit_test(light_stays_on_its_surface),
        cmocka_unit_test(black_is_data),
        cmocka_unit_test(detail_follows_the_pixels_normal),
        cmocka_unit_test(the_papers_detail_darkens),
    };
    return cmocka_run_group_tests(tests, kernel_open_device, kernel_close_device);
}
