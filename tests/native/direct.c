// Direct light of punctual lights by the processor's loops (pass/native/direct.c): the same bits
// from every width, what the formula says, and texels where they are seen.

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "tests/native/stage.h"
#include "tests/unit/cmocka_all.h"

#define PIXELS_X   13u // a group is several rows, and ends within one
#define PIXELS     (BD_LANES * 2)
#define MAP_TEXELS 16u

struct scenery {
    float depth[PIXELS], normals[PIXELS * 4];
    uint16_t albedo[PIXELS * 4], material[PIXELS * 4];
    uint32_t triangle[PIXELS];
    struct bd_view view;
    struct bd_light_uniform lights[4]; // a point light, a spot of one face and of six, a sun
};

static uint16_t unorm(void)
{
    return (uint16_t)(65535 * fabsf(chance()));
}

static void set_lights(struct scenery *s)
{
    static const struct {
        uint32_t kind, face_count;
    } kinds[4] = {{BD_LIGHT_KIND_POINT, 6},
                  {BD_LIGHT_KIND_SPOT, 1},
                  {BD_LIGHT_KIND_SPOT, 6},
                  {BD_LIGHT_KIND_DIRECTIONAL, 1}};
    for (int k = 0; k < 4; k++)
        s->lights[k] = (struct bd_light_uniform){
            .position = {.1f, .3f, 1, 0},
            .direction = {0, 0, -1, 0},
            .intensity = {3, 2, 1, 0},
            .axis_x = {1, 0, 0, 0},
            .axis_y = {0, 1, 0, 0},
            .axis_z = {0, 0, 1, 0},
            .inverse_range = .2f,
            .distance = 2,
            .half_width = 1,
            .half_height = 1,
            .cos_outer = kinds[k].kind == BD_LIGHT_KIND_SPOT ? .6f : -3,
            .per_cosine = kinds[k].face_count == 1 ? 5 : 1,
            .kind = kinds[k].kind,
            .face_count = kinds[k].face_count,
            .face_side_px = MAP_TEXELS,
        };
}

// Seen from above, below the lights: surfaces that all look somewhere up.
static struct scenery *set_scenery(void)
{
    struct scenery *s = calloc(1, sizeof *s);
    assert_non_null(s);
    begin_chance(3);
    s->view = (struct bd_view){.position = {0, 0, 3, 0},
                               .axis_x = {1, 0, 0, .4f},
                               .axis_y = {0, 1, 0, .4f},
                               .axis_z = {0, 0, 1, .1f},
                               .sample_px = {.5f, .5f, 0, 0},
                               .size_px = {PIXELS_X, PIXELS / PIXELS_X + 1, 0, 0}};
    for (uint32_t i = 0; i < PIXELS; i++) {
        s->depth[i] = 3 + .5f * chance();
        for (int c = 0; c < 4; c++) s->normals[4 * i + c] = .4f * chance();
        for (int c = 0; c < 4; c++) s->albedo[4 * i + c] = unorm();
        s->material[4 * i] = unorm();
        s->material[4 * i + 1] = 2621;
        s->material[4 * i + 2] = i % 9 == 0 ? 65535 : 0; // it does not ask for light
        s->material[4 * i + 3] = i % 7 == 0 ? 0 : 65535; // nothing is there
        s->triangle[i] = i;
    }
    set_lights(s);
    return s;
}

static struct bd_native_aim aim(const struct bd_native_loops *loops, const struct scenery *s,
                                uint32_t light, bool lambert)
{
    const struct bd_native_pixels pixels = {s->depth,    s->normals, s->albedo, s->material,
                                            s->triangle, &s->view,   0,         PIXELS - 3};
    struct bd_native_aim out;
    memset(&out, 0, sizeof out);
    loops->aim(&pixels, BD_LANES, &s->lights[light], lambert, &out);
    return out;
}

static void every_width_aims_alike(void **unused)
{
    (void)unused;
    struct scenery *s = set_scenery();
    const char *width;
    for (uint32_t w = 1; bd_native_loops_at(w, &width) || width; w++) {
        const struct bd_native_loops *loops = bd_native_loops_at(w, &width);
        for (uint32_t k = 0; loops && k < 8; k++) {
            const struct bd_native_aim a = aim(bd_native_loops_at(0, &width), s, k / 2, k % 2);
            const struct bd_native_aim b = aim(loops, s, k / 2, k % 2);
            assert_memory_equal(&a, &b, sizeof a);
        }
    }
    free(s);
}

// Of a matt pixel: intensity over the distance's square, times base colour / pi.
static void light_is_what_the_formula_says(void **unused)
{
    (void)unused;
    struct scenery *s = set_scenery();
    const struct bd_native_aim a = aim(bd_native_loops(), s, 0, true);
    uint32_t lit = 0;
    for (uint32_t i = 0; i < BD_LANES; i++) {
        const uint32_t pixel = BD_LANES + i, x = pixel % PIXELS_X, y = pixel / PIXELS_X;
        const double depth = s->depth[pixel], height = (double)s->view.size_px.y;
        const double px = (2 * (x + .5) / PIXELS_X - 1) * .4f * depth - .1f;
        const double py = (1 - 2 * (y + .5) / height) * .4f * depth - .3f, pz = 3 - depth - 1;
        const double ex = s->normals[4 * pixel], ey = s->normals[4 * pixel + 1];
        const double ez = 1 - fabs(ex) - fabs(ey), r2 = px * px + py * py + pz * pz;
        const double cosine =
            -(ex * px + ey * py + ez * pz) / sqrt(r2 * (ex * ex + ey * ey + ez * ez));
        const double window = 1 - r2 * r2 * pow(.2f, 4);
        const double expected = 3 * cosine * window / r2 * s->albedo[4 * pixel] / 65535 / M_PI;
        if (pixel >= PIXELS - 3 || pixel % 9 == 0 || pixel % 7 == 0) assert_false(a.is_lit[i]);
        if (!a.is_lit[i]) continue;
        assert_true(fabs(a.radiance.x[i] - expected) <= 1e-5 * expected);
        lit++;
    }
    assert_true(lit > BD_LANES / 2);
    free(s);
}

// A light is above all pixels: the middle of the face that looks down is below it, and y goes down.
static void texels_are_where_they_are_seen(void **unused)
{
    (void)unused;
    struct scenery *s = set_scenery();
    const struct bd_native_aim a = aim(bd_native_loops(), s, 0, true);
    uint32_t below = 0;
    for (uint32_t i = 0; i < BD_LANES; i++) {
        const double side = MAP_TEXELS, down = -(a.origin.z[i] - 1.0);
        const double aside = fmax(fabs(a.origin.x[i] - .1), fabs(a.origin.y[i] - .3));
        if (!a.is_lit[i]) continue;
        assert_true((a.face[i] == 5) == (aside < down));
        if (a.face[i] != 5) continue;
        assert_true(fabs(a.texel.x[i] - side / 2 * (1 + (a.origin.x[i] - .1) / down)) < 1e-4);
        assert_true(fabs(a.texel.y[i] - side / 2 * (1 - (a.origin.y[i] - .3) / down)) < 1e-4);
        below++;
    }
    assert_true(below > BD_LANES / 4);
    free(s);
}

static void set_pairs(struct bd_native_pairs *p)
{
    begin_chance(4);
    for (uint32_t i = 0; i < BD_LANES; i++) {
        const struct bd_vec4 from = {chance(), chance(), -1, 0}, to = {chance(), chance(), 2, 0};
        put(&p->origin, i, from);
        put(&p->span, i, to);
        put(&p->corner, i, (struct bd_vec4){-1, -1, i % 4 ? .1f * chance() : 0, 0});
        const float size = i % 8 == 7 ? .01f : 2; // of a texel, or less
        put(&p->edge1, i, i % 5 ? (struct bd_vec4){size, 0, 0, 0} : (struct bd_vec4){0});
        put(&p->edge2, i, (struct bd_vec4){0, size, size * .05f * chance(), 0});
        p->texel_side[i] = i % 2 ? .01f : .5f;
    }
}

static void every_width_asks_alike(void **unused)
{
    (void)unused;
    struct bd_native_pairs pairs;
    const char *width;
    uint32_t a[BD_LANES], b[BD_LANES], counts[3] = {0};
    set_pairs(&pairs);
    bd_native_loops_at(0, &width)->ask(&pairs, a);
    for (uint32_t w = 1; bd_native_loops_at(w, &width) || width; w++) {
        if (!bd_native_loops_at(w, &width)) continue;
        bd_native_loops_at(w, &width)->ask(&pairs, b);
        assert_memory_equal(a, b, sizeof a);
    }
    for (uint32_t i = 0; i < BD_LANES; i++) {
        // In the triangle's plane, near z = 0, all that have an area: x + y below the diagonal.
        const float x = pairs.origin.x[i] + pairs.span.x[i] / 2;
        const float y = pairs.origin.y[i] + pairs.span.y[i] / 2;
        const bool inside = x > -1 && y > -1 && x + y < 0 && i % 5 && i % 8 != 7;
        const float margin = fminf(fabsf(x + y), fminf(fabsf(x + 1), fabsf(y + 1)));
        if (margin > .2f) assert_int_equal((a[i] & BD_PAIR_HIDES) != 0, inside);
        for (int c = 0; c < 3; c++) counts[c] += a[i] >> c & 1;
    }
    for (int c = 0; c < 3; c++) assert_in_range(counts[c], 1, BD_LANES - 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_width_aims_alike),
        cmocka_unit_test(light_is_what_the_formula_says),
        cmocka_unit_test(texels_are_where_they_are_seen),
        cmocka_unit_test(every_width_asks_alike),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
