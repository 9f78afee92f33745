// What specular lobes reflect of lists of VPLs by the processor's loops
// (pass/native/gather_glossy.c): the same bits from every width, what Appendix B of glTF says,
// nothing of what is hidden.

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "kernel/brdf.h"
#include "tests/native/stage.h"
#include "tests/unit/cmocka_all.h"

// Viewers are above their receivers.
static struct bd_glossy_receivers set_surfaces(const struct bd_receivers *r)
{
    struct bd_glossy_receivers g;
    begin_chance(2);
    for (uint32_t i = 0; i < BD_LANES; i++) {
        const struct bd_vec4 v = unit();
        const bool below = v.x * r->normal.x[i] + v.y * r->normal.y[i] + v.z * r->normal.z[i] < 0;
        put(&g.viewer, i, below ? (struct bd_vec4){-v.x, -v.y, -v.z, 0} : v);
        put(&g.base_color, i,
            (struct bd_vec4){fabsf(chance()), fabsf(chance()), fabsf(chance()), 0});
        g.metallic[i] = i % 4 ? fabsf(chance()) : 0;
        g.roughness[i] = i % 6 ? fabsf(chance()) : 0;
        g.f0_dielectric[i] = 0.04f;
        g.has_lobe[i] = i % 7 != 0;
    }
    return g;
}

static struct bd_lanes3 gather_glossy(const struct bd_native_loops *loops, const struct stage *s,
                                      const uint32_t *hidden, bool near_patches)
{
    const struct bd_glossy_receivers surfaces = set_surfaces(&s->receivers);
    const struct bd_native_vpls vpls = {s->vpls, s->quads, 0, VPLS};
    const struct bd_native_hidden some = {hidden, hidden ? WORDS : 0};
    const struct bd_native_wishes wish = {near_patches, false, false};
    struct bd_lanes3 light;
    memset(&light, 0, sizeof light);
    loops->gather_glossy(&s->receivers, &surfaces, &vpls, &some, &wish, &light);
    return light;
}

static void every_width_has_the_same_lobes(void **unused)
{
    (void)unused;
    struct stage *s = set_stage();
    uint32_t *hidden = some_hidden();
    const char *width;
    for (uint32_t w = 1; bd_native_loops_at(w, &width) || width; w++) {
        const struct bd_native_loops *loops = bd_native_loops_at(w, &width);
        for (int k = 0; loops && k < 4; k++) {
            const uint32_t *bits = k & 1 ? hidden : NULL;
            const struct bd_lanes3 a =
                gather_glossy(bd_native_loops_at(0, &width), s, bits, (k & 2) != 0);
            const struct bd_lanes3 b = gather_glossy(loops, s, bits, (k & 2) != 0);
            assert_memory_equal(&a, &b, sizeof a);
        }
    }
    free(hidden);
    free(s);
}

// What is hidden from a lane is as if it was not in the list, near or far.
static void hidden_vpls_have_no_lobes(void **unused)
{
    (void)unused;
    struct stage *s = set_stage(), *other = set_stage();
    uint32_t *hidden = some_hidden();
    for (uint32_t v = 0; v < VPLS; v++)
        if (hidden[WORDS + v / 32] >> v % 32 & 1)
            other->vpls[v * BD_VPL_VEC4S + 2] = (struct bd_vec4){0};
    for (int near = 0; near < 2; near++) {
        const struct bd_lanes3 all = gather_glossy(bd_native_loops(), s, NULL, near);
        const struct bd_lanes3 seen = gather_glossy(bd_native_loops(), s, hidden, near);
        const struct bd_lanes3 without = gather_glossy(bd_native_loops(), other, NULL, near);
        uint32_t differ = 0;
        for (uint32_t i = 0; i < BD_LANES; i++) {
            assert_true(seen.x[i] == (i % 2 ? without.x[i] : all.x[i]));
            assert_true(seen.z[i] == (i % 2 ? without.z[i] : all.z[i]));
            differ += all.x[i] != without.x[i];
        }
        assert_true(differ > BD_LANES / 2);
    }
    free(hidden);
    free(other);
    free(s);
}

// Appendix B of glTF 2.0 as it is printed, for red. Both directions are above n.
static double printed_brdf(double base, double metallic, double alpha, const double n[3],
                           const double l[3], const double v[3])
{
    double h[3] = {l[0] + v[0], l[1] + v[1], l[2] + v[2]};
    const double length = sqrt(dot(h, h)), a2 = alpha * alpha;
    for (int c = 0; c < 3; c++) h[c] /= length;
    const double n_h = dot(n, h), n_l = dot(n, l), n_v = dot(n, v), g = pow(1 - dot(v, h), 5);
    const double distribution = a2 / (M_PI * pow(n_h * n_h * (a2 - 1) + 1, 2));
    const double visibility =
        0.5 / (n_l * sqrt(n_v * n_v * (1 - a2) + a2) + n_v * sqrt(n_l * n_l * (1 - a2) + a2));
    const double specular = distribution * visibility, fresnel = 0.04 + 0.96 * g;
    const double dielectric = base / M_PI * (1 - fresnel) + specular * fresnel;
    return dielectric * (1 - metallic) + specular * (base + (1 - base) * g) * metallic;
}

// Without the diffuse lobe's limit, which dark colours do not reach.
static double expected_glossy_red(const struct stage *s, const struct bd_glossy_receivers *g,
                                  uint32_t i)
{
    const struct bd_receivers *r = &s->receivers;
    const double n[3] = {r->normal.x[i], r->normal.y[i], r->normal.z[i]};
    const double v[3] = {g->viewer.x[i], g->viewer.y[i], g->viewer.z[i]};
    const double base = g->base_color.x[i], metallic = g->metallic[i];
    const double roughness = fmax((double)g->roughness[i], 0.25);
    double sum = 0;
    for (uint32_t k = 0; k < VPLS; k++) {
        const struct bd_vec4 *vpl = &s->vpls[k * BD_VPL_VEC4S];
        double to[3] = {(double)vpl->x - r->position.x[i], (double)vpl->y - r->position.y[i],
                        (double)vpl->z - r->position.z[i]};
        const double normal[3] = {-vpl[1].x, -vpl[1].y, -vpl[1].z}, r2 = dot(to, to);
        const double here = dot(n, to), there = dot(normal, to);
        if (!is_above_plane(here, r2) || !is_above_plane(there, r2)) continue;
        const double light = vpl[2].x * here * there / (r2 * (M_PI * r2 + vpl->w));
        for (int c = 0; c < 3; c++) to[c] /= sqrt(r2);
        sum += light * (printed_brdf(base, metallic, roughness * roughness, n, to, v) -
                        base * (1 - metallic) / M_PI);
    }
    return sum;
}

static void lobes_are_what_the_formula_says(void **unused)
{
    (void)unused;
    struct stage *s = set_stage();
    const struct bd_glossy_receivers surfaces = set_surfaces(&s->receivers);
    const struct bd_lanes3 light = gather_glossy(bd_native_loops(), s, NULL, false);
    uint32_t compared = 0;
    for (uint32_t i = 0; i < BD_LANES; i++) {
        if (s->receivers.lit[i] == 0 || surfaces.has_lobe[i] == 0) {
            assert_true(light.x[i] == 0 && light.y[i] == 0 && light.z[i] == 0);
            continue;
        }
        if (surfaces.base_color.x[i] * (1 - surfaces.metallic[i]) > 0.1f) continue; // is limited
        assert_float_equal(light.x[i] / expected_glossy_red(s, &surfaces, i), 1, 1e-4);
        compared++;
    }
    assert_true(compared >= 10);
    free(s);
}

// Hazard 17: from mirrors to what is rougher than any, at the lobe's peak and beside it, as sums of
// doubles have it. Narrower ones than .03 are as wide as that.
static void narrow_lobes_are_finite(void **unused)
{
    (void)unused;
    const double v[3] = {.6, 0, .8}, n[3] = {0, 0, 1};
    for (float roughness = 0; roughness <= 1; roughness += 1 / 64.0f) {
        for (double off = 0; off < .6; off = off * 2 + 1e-5) {
            const double l[3] = {-sin(asin(.6) - off), 0, cos(asin(.6) - off)};
            const f3 got =
                gltf_brdf(f3_of(.5f, .5f, .5f), 1, roughness, .04f, f3_of(0, 0, 1),
                          f3_of((float)l[0], 0, (float)l[2]), f3_of((float)v[0], 0, (float)v[2]));
            const double expected = printed_brdf(.5, 1, (double)(roughness * roughness), n, l, v);
            assert_true(isfinite(got.x) && got.x >= 0);
            if (roughness >= .1f) assert_float_equal(got.x / expected, 1, 2e-2);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_width_has_the_same_lobes),
        cmocka_unit_test(hidden_vpls_have_no_lobes),
        cmocka_unit_test(lobes_are_what_the_formula_says),
        cmocka_unit_test(narrow_lobes_are_finite),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
