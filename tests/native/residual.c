// What a screen's parts give beyond a clamp (pass/native/residual.c): the same bits from every
// width, as printed and as mended, with lobes and without; the sum over all pixels where nothing is
// left to parts; and lobes that reflect no more than comes.

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "tests/native/stage.h"
#include "tests/unit/cmocka_all.h"

#define WIDTH  13u // odd: a part of the next level has fewer children
#define HEIGHT 9u
#define LEVELS 3u
#define PARTS  (13 * 9 + 7 * 5 + 4 * 3)

struct scenery {
    struct bd_screen_part parts[PARTS];
    struct bd_screen_patch patches[WIDTH * HEIGHT];
    struct bd_native_screen screen;
    struct bd_screen_receivers receivers;
};

// Somewhere above the receivers, or beside them; one in eight is empty.
static void set_part(struct bd_screen_part *part, float size)
{
    const struct bd_vec4 n = unit();
    const float area = chance() < -.75f ? 0 : size * size;
    part->middle_area =
        (struct bd_vec4){.4f * chance(), .2f + .2f * chance(), .4f * chance(), area};
    part->normal_radius = (struct bd_vec4){n.x, -fabsf(n.y), n.z, size};
    part->radiance_thickness =
        (struct bd_vec4){fabsf(chance()), fabsf(chance()), fabsf(chance()), size * fabsf(chance())};
}

static void set_receivers(struct bd_screen_receivers *r)
{
    for (uint32_t i = 0; i < BD_SCREEN_LANES; i++) {
        r->x[i] = .1f * chance();
        r->y[i] = .05f * chance();
        r->z[i] = .1f * chance();
        r->normal_y[i] = r->geometric_y[i] = 1;
        r->lit[i] = i % 5 == 4 ? 0 : 1;
    }
    r->bounds = (struct bd_uvec4){0, 0, 4, 3};
}

static struct scenery *set_scenery(void)
{
    const struct bd_uvec4 levels[LEVELS] = {{13, 9, 0, 0}, {7, 5, 117, 0}, {4, 3, 152, 0}};
    struct scenery *s = calloc(1, sizeof *s);
    assert_non_null(s);
    begin_chance(7);
    for (uint32_t l = 0; l < LEVELS; l++)
        for (uint32_t i = 0; i < levels[l].x * levels[l].y; i++)
            set_part(&s->parts[levels[l].z + i], .04f * (float)(1u << l));
    for (uint32_t i = 0; i < WIDTH * HEIGHT; i++)
        s->patches[i] = (struct bd_screen_patch){{.02f, 0, .01f, 1}, {0, .01f, .02f, 0}};
    set_receivers(&s->receivers);
    s->screen = (struct bd_native_screen){.parts = s->parts, .patches = s->patches};
    s->screen.args = (struct bd_screen_args){
        .level_count = LEVELS, .clamp = 6, .smooth_sr = .02f, .edge_sr = .01f};
    memcpy(s->screen.args.levels, levels, sizeof levels);
    return s;
}

// White metals that are seen from above, of all roughnesses.
static struct bd_screen_surfaces set_surfaces(void)
{
    struct bd_screen_surfaces s;
    for (uint32_t i = 0; i < BD_SCREEN_LANES; i++) {
        const struct bd_vec4 v = unit();
        s.viewer_x[i] = v.x;
        s.viewer_y[i] = fabsf(v.y);
        s.viewer_z[i] = v.z;
        s.red[i] = s.green[i] = s.blue[i] = s.metallic[i] = 1;
        s.roughness[i] = (float)i / BD_SCREEN_LANES;
        s.f0_dielectric[i] = .04f;
        s.has_lobe[i] = i % 7 == 6 ? 0 : 1;
    }
    return s;
}

static void widths_give_the_same_bits(void **state)
{
    (void)state;
    struct scenery *s = set_scenery();
    const struct bd_screen_surfaces surfaces = set_surfaces();
    for (int how = 0; how < 4; how++) {
        const struct bd_screen_surfaces *lobes = how & 2 ? &surfaces : NULL;
        const struct bd_native_loops *loops;
        const char *width;
        struct bd_screen_light first = {0};
        s->screen.printed = (how & 1) != 0;
        bd_native_loops_at(0, &width)->residual(&s->screen, &s->receivers, lobes, &first);
        assert_true(first.red[0] > 0 && first.given[0] > 0 && (first.lobe_red[0] > 0) == !!lobes);
        for (uint32_t i = 1; (loops = bd_native_loops_at(i, &width)) != NULL; i++) {
            struct bd_screen_light light = {0};
            loops->residual(&s->screen, &s->receivers, lobes, &light);
            assert_memory_equal(&light, &first, sizeof light);
        }
    }
    free(s);
}

// Of a radiance of 1 from a square above them, .2 wide and .2 away, in which they mirror their
// viewers, off its middle: no more than comes, and of a narrow lobe about half of the square that
// is one part to it.
static void lobes_reflect_no_more_than_comes(void **state)
{
    (void)state;
    struct scenery *s = set_scenery();
    struct bd_screen_surfaces surfaces = set_surfaces();
    memset(s->parts, 0, sizeof s->parts);
    s->parts[0] = (struct bd_screen_part){{0, .2f, 0, .04f}, {0, -1, 0, .15f}, {1, 1, 1, 0}};
    s->patches[0] = (struct bd_screen_patch){{.1f, 0, 0, 1}, {0, 0, .1f, 0}};
    s->screen.args.level_count = 1;
    s->receivers.bounds = (struct bd_uvec4){0, 0, WIDTH, HEIGHT};
    for (uint32_t i = 0; i < BD_SCREEN_LANES; i++) {
        s->receivers.x[i] = s->receivers.y[i] = s->receivers.z[i] = 0;
        surfaces.viewer_x[i] = sinf(.3f);
        surfaces.viewer_y[i] = cosf(.3f);
        surfaces.viewer_z[i] = 0;
    }
    for (s->screen.args.clamp = 1e-3f; s->screen.args.clamp < 20; s->screen.args.clamp *= 1.2f) {
        struct bd_screen_light light = {0};
        bd_native_loops()->residual(&s->screen, &s->receivers, &surfaces, &light);
        for (uint32_t i = 0; i < BD_SCREEN_LANES; i++) {
            const bool asks = s->receivers.lit[i] > 0 && surfaces.has_lobe[i] > 0;
            assert_true(asks ? light.lobe_red[i] > 0 : light.lobe_red[i] == 0);
            assert_true(light.lobe_red[i] <= 1);
        }
        if (s->screen.args.clamp < .2f) assert_true(light.lobe_red[0] > .45f);
    }
    free(s);
}

// Whoever is not lit gets nothing, and looks at nothing.
static void who_asks_nothing_gets_nothing(void **state)
{
    (void)state;
    struct scenery *s = set_scenery();
    struct bd_screen_light light = {0};
    bd_native_loops()->residual(&s->screen, &s->receivers, NULL, &light);
    for (uint32_t i = 0; i < BD_SCREEN_LANES; i++) {
        const bool asks = s->receivers.lit[i] > 0;
        assert_true(asks == (light.looked[i] > 0));
        if (!asks) assert_true(light.red[i] == 0 && light.green[i] == 0 && light.blue[i] == 0);
    }
    free(s);
}

// With thresholds of 0 every part that can give anything is looked at down to its pixels: parts of
// more levels give what pixels of one do.
static void without_thresholds_parts_do_not_show(void **state)
{
    (void)state;
    struct scenery *s = set_scenery();
    struct bd_screen_light all = {0}, flat = {0};
    // Parts above pixels that may hold anything.
    for (uint32_t i = 117; i < PARTS; i++) {
        s->parts[i].middle_area = (struct bd_vec4){0, .2f, 0, 1};
        s->parts[i].normal_radius.w = s->parts[i].radiance_thickness.w = 2;
    }
    s->screen.args.smooth_sr = s->screen.args.edge_sr = 0;
    bd_native_loops()->residual(&s->screen, &s->receivers, NULL, &all);
    s->screen.args.level_count = 1;
    s->receivers.bounds = (struct bd_uvec4){0, 0, WIDTH, HEIGHT};
    bd_native_loops()->residual(&s->screen, &s->receivers, NULL, &flat);
    for (uint32_t i = 0; i < BD_SCREEN_LANES; i++)
        assert_true(fabsf(all.red[i] - flat.red[i]) <= 1e-5f * flat.red[i]);
    free(s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(widths_give_the_same_bits),
        cmocka_unit_test(lobes_reflect_no_more_than_comes),
        cmocka_unit_test(who_asks_nothing_gets_nothing),
        cmocka_unit_test(without_thresholds_parts_do_not_show),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
