// Materials at a hit, by hand: one quad in the x-y plane, front to +z, texture coordinates as a
// picture lies (u with x, v against y).

#include "reference/surface.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "reference/bsdf.h"
#include "tests/tools/bsdf_once.h"

static float position[] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
static float normal[] = {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1};
static float tangent[] = {1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1};
static float uv0[] = {0, 1, 1, 1, 1, 0, 0, 0};
static float uv1[] = {0, 0, 0, 0, 0, 0, 0, 0};
static float color[] = {1, 1, 1, 1, .5f, 1, 1, .5f, .5f, 1, 1, .5f, 1, 1, 1, 1};
static uint32_t indices[] = {0, 1, 2, 0, 2, 3};

// 2 x 1: left and right differ.
static uint8_t base_texels[] = {255, 0, 0, 255, 0, 255, 0, 128};
static uint8_t data_texels[] = {51, 102, 153, 255, 204, 255, 0, 255};
static uint8_t normal_texels[] = {255, 128, 191, 255, 128, 255, 191, 255};
static struct bd_picture base_picture = {1, .width_px = 2, .height_px = 1, .rgba = base_texels};
static struct bd_picture data_picture = {1, .width_px = 2, .height_px = 1, .rgba = data_texels};
static struct bd_picture normal_picture = {1, .width_px = 2, .height_px = 1, .rgba = normal_texels};

static const float identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
static const float to_eye[3] = {0, 0, 1}, from_below[3] = {0, 0, -1};

struct setup {
    struct bd_picture *pictures[3];
    struct bd_texture textures[3];
    struct bd_material material;
    struct bd_primitive primitive;
    struct bd_scene scene;
    struct bd_linear linear;
    struct bd_shading_vertex corners[3];
    struct bd_shading_tangent tangents[3];
    struct bd_hit hit;
};

static const struct bd_texture_ref no_map = {BD_NONE, 0, {1, 0, 0, 0, 1, 0}};

static struct bd_texture_ref map_of(int32_t texture)
{
    return (struct bd_texture_ref){texture, 0, {1, 0, 0, 0, 1, 0}};
}

static void set_linear(struct setup *s, const float world[9], const float inverse_transpose[9])
{
    memcpy(s->linear.world_from_mesh, world, sizeof s->linear.world_from_mesh);
    memcpy(s->linear.normal_from_mesh, inverse_transpose, sizeof s->linear.normal_from_mesh);
}

static void setup(struct setup *s)
{
    *s = (struct setup){.pictures = {&base_picture, &data_picture, &normal_picture}};
    for (int i = 0; i < 3; i++)
        s->textures[i] = (struct bd_texture){i, BD_WRAP_CLAMP, BD_WRAP_CLAMP, .nearest = true};
    s->material = (struct bd_material){
        .base_color = {.5f, .5f, .5f, .5f},
        .metallic = .5f,
        .roughness = .5f,
        .emissive = {2, 2, 2},
        .normal_scale = 1,
        .ior = 1.5f,
        .double_sided = true,
        .base_color_map = no_map,
        .metallic_roughness_map = no_map,
        .normal_map = no_map,
        .emissive_map = no_map,
        .transmission_map = no_map,
    };
    s->primitive = (struct bd_primitive){
        .vertex_count = 4,
        .index_count = 6,
        .position = position,
        .normal = normal,
        .tangent = tangent,
        .uv = {uv0, uv1},
        .index = indices,
    };
    s->scene = (struct bd_scene){.pictures = s->pictures,
                                 .picture_count = 3,
                                 .textures = s->textures,
                                 .texture_count = 3,
                                 .materials = &s->material,
                                 .material_count = 1};
    set_linear(s, identity, identity);
    s->hit = (struct bd_hit){
        .primitive = &s->primitive, .corners = s->corners, .normal_geometric = {0, 0, 1}};
}

static struct bd_surface seen(struct setup *s, const float wo[3], bool lambert, bool transmission)
{
    struct bd_surface out;
    for (int c = 0; c < 3; c++) {
        uint32_t vertex = s->primitive.index[3 * s->hit.triangle + (uint32_t)c];
        s->corners[c] = bd_shading_vertex_of(&s->primitive, vertex, &s->linear);
        if (s->primitive.tangent)
            s->tangents[c] = bd_shading_tangent_of(&s->primitive, vertex, &s->linear);
    }
    s->hit.tangents = s->primitive.tangent ? s->tangents : NULL;
    bd_surface_at(&s->scene, &s->hit, wo, lambert, transmission, &out);
    return out;
}

// The surface at (x, y) of the quad's lower right half, y <= x.
static struct bd_surface at(struct setup *s, float x, float y, const float wo[3])
{
    s->hit.triangle = 0, s->hit.u = x - y, s->hit.v = y;
    return seen(s, wo, false, true);
}

static void assert_near(const float *v, double x, double y, double z)
{
    assert_true(fabs(v[0] - x) < 2e-6 && fabs(v[1] - y) < 2e-6 && fabs(v[2] - z) < 2e-6);
}

static void color_is_factor_map_vertex(void **state)
{
    (void)state;
    struct setup s;
    setup(&s);
    struct bd_surface left = at(&s, .4f, .2f, to_eye);
    assert_near(left.base_color, .5, .5, .5);
    assert_near(left.emission, 2, 2, 2);
    s.material.base_color_map = map_of(0), s.material.emissive_map = map_of(1);
    s.primitive.color = color;
    left = at(&s, .4f, .2f, to_eye);
    assert_near(left.base_color, .5 * .8, 0, 0); // red is 1 at x = 0 and .5 at x = 1
    assert_near(left.emission, 2 * bd_srgb_to_linear(51), 2 * bd_srgb_to_linear(102),
                2 * bd_srgb_to_linear(153));
    assert_true(fabsf(bd_surface_alpha(&s.scene, &s.hit) - .5f * .8f) < 1e-6f);
    struct bd_surface right = at(&s, .6f, .2f, to_eye);
    assert_near(right.base_color, 0, .5, 0);
    assert_true(fabsf(bd_surface_alpha(&s.scene, &s.hit) - .5f * .7f * 128 / 255) < 1e-6f);
    // Without its texture coordinates a map counts as absent.
    s.primitive.uv[0] = NULL;
    assert_near(at(&s, .6f, .2f, to_eye).base_color, .35, .5, .5);
}

static void second_triangle(void **state)
{
    (void)state;
    struct setup s;
    setup(&s);
    s.material.base_color_map = map_of(0);
    s.hit.triangle = 1, s.hit.u = .1f, s.hit.v = .8f; // x = .1, y = .9
    assert_near(seen(&s, to_eye, false, true).base_color, .5, 0, 0);
    s.hit.u = .8f, s.hit.v = .1f; // x = .8
    assert_near(seen(&s, to_eye, false, true).base_color, 0, .5, 0);
}

static void data_maps_are_linear(void **state)
{
    (void)state;
    struct setup s;
    setup(&s);
    s.material.metallic_roughness_map = map_of(1);
    s.material.transmission = .5f, s.material.transmission_map = map_of(1);
    struct bd_surface left = at(&s, .4f, .2f, to_eye);
    assert_true(fabsf(left.metallic - .5f * .6f) < 1e-6f);
    assert_true(fabsf(left.roughness - .5f * .4f) < 1e-6f);
    assert_true(fabsf(left.transmission - .5f * .2f) < 1e-6f);
    assert_true(left.thin && left.ior == 1.5f);
    s.material.thickness_m = .1f;
    struct bd_surface out = seen(&s, to_eye, false, false);
    assert_true(out.transmission == 0 && !out.thin && !out.lambert);
    out = seen(&s, to_eye, true, true);
    assert_true(out.lambert && out.transmission == 0);
    assert_near(out.base_color, .5, .5, .5);
}

// u' = 1 - u by a transform; the second set of coordinates by its number.
static void transform_and_second_set(void **state)
{
    (void)state;
    struct setup s;
    setup(&s);
    s.material.base_color_map = (struct bd_texture_ref){0, 0, {-1, 0, 1, 0, 1, 0}};
    assert_near(at(&s, .4f, .2f, to_eye).base_color, 0, .5, 0);
    // By v: up the quad is left in the picture (v = 1 - y, u' = v).
    s.material.base_color_map = (struct bd_texture_ref){0, 0, {0, 1, 0, 1, 0, 0}};
    assert_near(at(&s, .9f, .8f, to_eye).base_color, .5, 0, 0);
    assert_near(at(&s, .9f, .2f, to_eye).base_color, 0, .5, 0);
    // The second row of the matrix: v' = u + v / 10 in a picture of two rows.
    struct bd_picture rows = {1, .width_px = 1, .height_px = 2, .rgba = base_texels};
    s.pictures[0] = &rows;
    s.material.base_color_map = (struct bd_texture_ref){0, 0, {1, 0, 0, 1, .1f, 0}};
    assert_near(at(&s, .3f, .25f, to_eye).base_color, .5, 0, 0);
    assert_near(at(&s, .8f, .2f, to_eye).base_color, 0, .5, 0);
    s.pictures[0] = &base_picture;
    s.material.base_color_map = (struct bd_texture_ref){0, 1, {1, 0, .75f, 0, 1, 0}};
    assert_near(at(&s, .1f, .05f, to_eye).base_color, 0, .5, 0);
}

// The map's left texel leans along u, the right one along -v of the picture, which is +y here:
// glTF's green points up.
static void normal_map(void **state)
{
    (void)state;
    struct setup s;
    setup(&s);
    s.material.normal_map = map_of(2);
    double x = 1, y = 2 * 128 / 255.0 - 1, z = 2 * 191 / 255.0 - 1, l = sqrt(x * x + y * y + z * z);
    assert_near(at(&s, .4f, .2f, to_eye).normal, x / l, y / l, z / l);
    assert_near(at(&s, .6f, .2f, to_eye).normal, y / l, x / l, z / l);
    s.material.normal_scale = .5f;
    double half = sqrt((x * x + y * y) / 4 + z * z);
    assert_near(at(&s, .4f, .2f, to_eye).normal, x / 2 / half, y / 2 / half, z / half);
    // From behind the whole vector turns round.
    s.material.normal_scale = 1;
    struct bd_surface behind = at(&s, .4f, .2f, from_below);
    assert_near(behind.normal_geometric, 0, 0, -1);
    assert_near(behind.normal, -x / l, -y / l, -z / l);
    // A frame that interpolation shortened is used as it is: tangents of half the length bend half.
    float shorter[16];
    memcpy(shorter, tangent, sizeof shorter);
    for (int v = 0; v < 4; v++) shorter[4 * v + 1] = v < 2 ? 1.7320508f : -1.7320508f;
    s.primitive.tangent = shorter; // (1, +-sqrt 3) / 2: at half height their mean is (.5, 0)
    l = sqrt(x * x / 4 + y * y / 4 + z * z);
    assert_near(at(&s, .5f, .5f, to_eye).normal, y / 2 / l, x / 2 / l, z / l);
}

// Mirrored in x: tangents turn with the surface, green still points up.
static void mirrored_normal_map(void **state)
{
    (void)state;
    static const float mirror[9] = {-1, 0, 0, 0, 1, 0, 0, 0, 1};
    struct setup s;
    setup(&s);
    s.material.normal_map = map_of(2);
    set_linear(&s, mirror, mirror);
    s.linear.mirrored = true;
    double x = 1, y = 2 * 128 / 255.0 - 1, z = 2 * 191 / 255.0 - 1, l = sqrt(x * x + y * y + z * z);
    assert_near(at(&s, .4f, .2f, to_eye).normal, -x / l, y / l, z / l);
    assert_near(at(&s, .6f, .2f, to_eye).normal, -y / l, x / l, z / l);
    // A mirrored picture (handedness -1): green points down the quad.
    float left_handed[16];
    memcpy(left_handed, tangent, sizeof left_handed);
    for (int v = 0; v < 4; v++) left_handed[4 * v + 3] = -1;
    s.primitive.tangent = left_handed;
    assert_near(at(&s, .6f, .2f, to_eye).normal, -y / l, -x / l, z / l);
}

// Uneven scale: each vertex's vector is made unit before they are mixed.
static void uneven_scale(void **state)
{
    (void)state;
    static const float wide[9] = {2, 0, 0, 0, 1, 0, 0, 0, 1},
                       inverse[9] = {.5f, 0, 0, 0, 1, 0, 0, 0, 1};
    float tilted[] = {.8f, 0, .6f, 0, 0, 1, 0, 0, 1, .8f, 0, .6f};
    struct setup s;
    setup(&s);
    s.primitive.normal = tilted;
    set_linear(&s, wide, inverse);
    double l = sqrt(.4 * .4 + .6 * .6), x = .5 * .4 / l, z = .5 * (.6 / l + 1),
           n = sqrt(x * x + z * z);
    assert_near(at(&s, .5f, .25f, to_eye).normal, x / n, 0, z / n);
    // No normal at all: the triangle's own.
    memset(tilted, 0, sizeof tilted);
    assert_near(at(&s, .5f, .25f, to_eye).normal, 0, 0, 1);
}

static void sides(void **state)
{
    (void)state;
    struct setup s;
    setup(&s);
    struct bd_surface behind = at(&s, .4f, .2f, from_below);
    assert_false(behind.entering);
    assert_near(behind.base_color, .5, .5, .5);
    assert_near(behind.emission, 2, 2, 2);
    s.material.double_sided = false;
    assert_near(at(&s, .4f, .2f, to_eye).emission, 2, 2, 2);
    behind = at(&s, .4f, .2f, from_below);
    assert_near(behind.emission, 0, 0, 0);
    struct bd_bsdf_sample sample;
    float f[3], pdf;
    eval_once(&behind, from_below, from_below, f, &pdf);
    assert_near(f, 0, 0, 0);
    if (sample_once(&behind, from_below, (float[3]){.1f, .2f, .3f}, &sample))
        assert_near(sample.weight, 0, 0, 0);
    // Light leaves glass through the rear of its surface.
    s.material.transmission = 1, s.material.metallic = 0, s.material.thickness_m = 1;
    behind = at(&s, .4f, .2f, from_below);
    assert_true(behind.transmission == 1 && !behind.entering && !behind.lambert);
    assert_near(behind.emission, 0, 0, 0);
}

static void unlit_shows_its_color_and_reflects_nothing(void **state)
{
    (void)state;
    struct setup s;
    setup(&s);
    s.material.unlit = true, s.material.base_color_map = map_of(0);
    struct bd_surface out = at(&s, .4f, .2f, to_eye);
    assert_true(out.unlit);
    assert_near(out.emission, .5, 0, 0);
    float f[3], pdf;
    eval_once(&out, to_eye, to_eye, f, &pdf);
    assert_near(f, 0, 0, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(color_is_factor_map_vertex),
        cmocka_unit_test(second_triangle),
        cmocka_unit_test(data_maps_are_linear),
        cmocka_unit_test(transform_and_second_set),
        cmocka_unit_test(normal_map),
        cmocka_unit_test(mirrored_normal_map),
        cmocka_unit_test(uneven_scale),
        cmocka_unit_test(sides),
        cmocka_unit_test(unlit_shows_its_color_and_reflects_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
