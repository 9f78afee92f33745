// What rays answer, against every triangle asked one by one in double precision: placed and kept
// instances, at sizes and places of the world far apart.

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "rays/rays.h"
#include "scene/model/render_space.h"
#include "scene/model/triangle_order.h"
#include "tests/reference/stage.h"
#include "tests/unit/cmocka_all.h"

#define RAYS 8000

static uint64_t state = 1;

static double chance(void)
{
    state ^= state << 13, state ^= state >> 7, state ^= state << 17;
    return (double)(state >> 11) * 0x1p-53;
}

// --- the scene --------------------------------------------------------------------------------

static int32_t add_soup(struct stage *stage, int32_t material, uint32_t triangles)
{
    float *positions = calloc(9 * (size_t)triangles, sizeof *positions);
    uint32_t *indices = calloc(3 * (size_t)triangles, sizeof *indices);
    for (uint32_t t = 0; t < triangles; t++) {
        const double centre[3] = {2 * chance() - 1, 2 * chance() - 1, 2 * chance() - 1};
        for (uint32_t i = 0; i < 9; i++)
            positions[9 * t + i] = (float)(centre[i % 3] + 1.2 * (chance() - 0.5));
        for (uint32_t i = 0; i < 3; i++) indices[3 * t + i] = 3 * t + i;
    }
    const int32_t node = stage_triangles(stage, material, positions, NULL, indices, 3 * triangles);
    free(positions);
    free(indices);
    return node;
}

static struct bd_node *add_instance(struct stage *stage, int32_t mesh)
{
    struct bd_scene *s = stage->scene;
    s->nodes = realloc(s->nodes, (s->node_count + 1) * sizeof *s->nodes);
    struct bd_node *node = &s->nodes[s->node_count++];
    *node = s->nodes[0];
    node->mesh = mesh;
    return node;
}

// Turned, scaled by `scale` (a mirror where it is negative), unevenly by `uneven`.
static bd_dmat4 somewhere(double scale, double uneven)
{
    const double s[3] = {scale, fabs(scale) * uneven, fabs(scale)};
    const double at[3] = {chance() - 0.5, chance() - 0.5, chance() - 0.5};
    const double turn[4] = {chance() - 0.5, chance() - 0.5, chance() - 0.5, chance()};
    return bd_dmat4_from_trs(at, turn, s);
}

// Two meshes: one that is kept for its many instances, of which one is too uneven, and one that is
// placed. All of it times `size`, moved by `offset`.
static struct stage *create_soup(double size, double offset)
{
    struct stage *stage = stage_create();
    const int32_t material = stage_material(stage, 0.5f);
    const int32_t single_sided = stage_material(stage, 0.5f);
    stage_material_at(stage, single_sided)->double_sided = false;
    add_soup(stage, single_sided, 200);
    add_soup(stage, material, 150);
    stage->scene->nodes[0].parent_from_node = somewhere(1, 1);
    stage->scene->nodes[1].parent_from_node = somewhere(0.5, 1);
    for (int i = 0; i < 5; i++) add_instance(stage, 0)->parent_from_node = somewhere(0.7, 1);
    add_instance(stage, 0)->parent_from_node = somewhere(-0.6, 1);
    add_instance(stage, 0)->parent_from_node = somewhere(-0.8, 1);
    add_instance(stage, 0)->parent_from_node = somewhere(0.3, 12);
    for (uint32_t n = 0; n < stage->scene->node_count; n++) {
        double *m = stage->scene->nodes[n].parent_from_node.m;
        for (int i = 0; i < 15; i++) m[i] *= i % 4 == 3 ? 1 : size;
        m[12] += offset, m[13] -= offset, m[14] += 0.5 * offset;
    }
    struct bd_err_detail detail = {0};
    if (bd_scene_finish(stage->scene, &detail)) fail_msg("%s", detail.message);
    return stage;
}

// Everything placed, or what is repeated kept.
static struct bd_rays *create_rays(struct bd_scene *scene, uint64_t repeated_max)
{
    const struct bd_rays_build build = {.thread_count = 2, .repeated_max = repeated_max};
    struct bd_rays *rays = NULL;
    struct bd_err_detail detail = {0};
    if (bd_rays_create(scene, &build, &rays, &detail)) fail_msg("%s", detail.message);
    return rays;
}

// --- one by one -------------------------------------------------------------------------------

// All triangles in render space, by number, counter-clockwise as who faces them sees them.
// `has_back` (or NULL): which of them only that side is seen of.
static bd_dvec3 *list_triangles(const struct bd_scene *scene, uint64_t *count, bool **has_back)
{
    struct bd_triangle_order order;
    const struct bd_render_space space = bd_render_space_of(scene);
    bd_triangle_order_init(&order, scene);
    bd_dvec3 *corners = calloc(3 * order.triangle_count, sizeof *corners), *to = corners;
    if (has_back) *has_back = calloc(order.triangle_count, sizeof **has_back);
    for (uint32_t r = 0; r < order.run_count; r++) {
        const struct bd_triangle_run *run = &order.runs[r];
        const struct bd_primitive *p = &scene->meshes[run->mesh]->primitives[run->primitive];
        assert_int_equal(to - corners, 3 * run->first_triangle);
        for (uint32_t i = 0; i < run->instance_count; i++) {
            const uint32_t instance = order.instances[run->first_instance + i];
            for (uint32_t t = 0; has_back && t < p->index_count / 3; t++)
                (*has_back)[(to - corners) / 3 + t] = !scene->materials[p->material].double_sided;
            for (uint32_t c = 0; c < p->index_count; c++) {
                const uint32_t turned = run->mirrored ? c - c % 3 + (3 - c % 3) % 3 : c;
                const float *at = p->position + 3 * (size_t)p->index[turned];
                *to++ = bd_render_from_world(
                    &space, bd_dmat4_point(&scene->instances[instance].world_from_mesh,
                                           (bd_dvec3){at[0], at[1], at[2]}));
            }
        }
    }
    *count = order.triangle_count;
    bd_triangle_order_finish(&order);
    return corners;
}

// Moeller and Trumbore. `margin`: how far within the triangle, the least of its barycentrics.
static bool meets(const bd_dvec3 corner[3], bd_dvec3 origin, bd_dvec3 direction, double *distance,
                  double *margin)
{
    const bd_dvec3 e1 = bd_dvec3_sub(corner[1], corner[0]), e2 = bd_dvec3_sub(corner[2], corner[0]);
    const bd_dvec3 p = bd_dvec3_cross(direction, e2), s = bd_dvec3_sub(origin, corner[0]);
    const double determinant = bd_dvec3_dot(e1, p);
    if (determinant == 0) return false;
    const bd_dvec3 q = bd_dvec3_cross(s, e1);
    const double u = bd_dvec3_dot(s, p) / determinant;
    const double v = bd_dvec3_dot(direction, q) / determinant;
    *distance = bd_dvec3_dot(e2, q) / determinant;
    *margin = fmin(fmin(u, v), 1 - u - v);
    return *margin > -1e-3;
}

static bd_dvec3 wide(const float v[3])
{
    return (bd_dvec3){v[0], v[1], v[2]};
}

struct judged {
    uint32_t number;
    double distance;
    bool is_close; // to an edge or an end, or two triangles are as near
};

static bool is_back(const bd_dvec3 corner[3], const float direction[3])
{
    const bd_dvec3 normal =
        bd_dvec3_cross(bd_dvec3_sub(corner[1], corner[0]), bd_dvec3_sub(corner[2], corner[0]));
    return bd_dvec3_dot(normal, wide(direction)) > 0;
}

static struct judged judge_ray(const bd_dvec3 *corners, const bool *has_back, uint64_t count,
                               const struct bd_ray *ray)
{
    const float *origin = ray->origin, *direction = ray->direction;
    const double near = ray->near, far = ray->far;
    struct judged found = {BD_NO_TRIANGLE, far, false};
    double second = INFINITY;
    for (uint32_t t = 0; t < count; t++) {
        double distance, margin;
        if (!meets(corners + 3 * (size_t)t, wide(origin), wide(direction), &distance, &margin))
            continue;
        const bool is_passed = ray->passes_backs && has_back && has_back[t];
        if (is_passed && is_back(corners + 3 * (size_t)t, direction)) continue;
        if (fabs(distance - near) < 1e-4 || fabs(distance - far) < 1e-4) found.is_close = true;
        if (distance <= near || distance >= far) continue;
        if (margin < 1e-3) found.is_close = true;
        if (margin < 0) continue;
        second = fmin(second, fmax(distance, found.distance));
        if (distance >= found.distance) continue;
        found.distance = distance;
        found.number = t;
    }
    if (second - found.distance < 1e-4) found.is_close = true;
    return found;
}

static struct judged judge(const bd_dvec3 *corners, uint64_t count, const float origin[3],
                           const float direction[3], double far)
{
    struct bd_ray ray = {.far = (float)far};
    memcpy(ray.origin, origin, sizeof ray.origin);
    memcpy(ray.direction, direction, sizeof ray.direction);
    return judge_ray(corners, NULL, count, &ray);
}

// --- tests ------------------------------------------------------------------------------------

struct world {
    double size, offset;
};
static const struct world worlds[] = {{1, 0}, {1e-4, 0}, {1e6, 0}, {1, 1e6}, {1e3, -1e9}};

static void random_point(float at[3])
{
    for (int c = 0; c < 3; c++) at[c] = (float)(0.7 * chance() - 0.35);
}

// A soup in one of the worlds, and its triangles one by one.
struct soup {
    struct stage *stage;
    struct bd_rays *rays;
    uint64_t count;
    bd_dvec3 *corners;
    bool *has_back;
};

static struct soup begin_soup(size_t w)
{
    struct soup soup = {.stage = create_soup(worlds[w].size, worlds[w].offset)};
    soup.rays = create_rays(soup.stage->scene, w % 2 ? BD_RAYS_REPEATED_MAX : 0);
    soup.corners = list_triangles(soup.stage->scene, &soup.count, &soup.has_back);
    return soup;
}

static void end_soup(struct soup *soup)
{
    free(soup->corners);
    free(soup->has_back);
    bd_rays_destroy(&soup->rays);
    stage_destroy(&soup->stage);
}

static void first_triangles_are_those_of_all_asked_one_by_one(void **unused)
{
    (void)unused;
    struct bd_pool *pool = bd_pool_create(2);
    struct bd_ray *queries = calloc(RAYS, sizeof *queries);
    struct bd_ray_hit *hits = calloc(RAYS, sizeof *hits);
    for (size_t w = 0; w < sizeof worlds / sizeof *worlds; w++) {
        struct soup soup = begin_soup(w);
        for (int i = 0; i < RAYS; i++) {
            float to[3];
            random_point(queries[i].origin);
            random_point(to);
            for (int c = 0; c < 3; c++) queries[i].direction[c] = to[c] - queries[i].origin[c];
            queries[i].from_triangle = BD_NO_TRIANGLE;
            queries[i].far = i % 2 ? INFINITY : 1;
            queries[i].near = i % 3 ? 0 : 0.1f;
            queries[i].passes_backs = i % 5 < 2;
        }
        bd_rays_nearest(soup.rays, pool, BD_RAYS_ALPHA_MASK, queries, RAYS, hits);
        int sure = 0, met = 0;
        for (int i = 0; i < RAYS; i++) {
            const struct judged j = judge_ray(soup.corners, soup.has_back, soup.count, &queries[i]);
            if (j.is_close) continue;
            sure++, met += j.number != BD_NO_TRIANGLE;
            if (hits[i].triangle != j.number)
                fail_msg("world %zu, ray %d: %u, not %u at %g", w, i, hits[i].triangle, j.number,
                         j.distance);
            if (j.number == BD_NO_TRIANGLE) continue;
            assert_float_equal(hits[i].distance, j.distance, 2e-5 * (1 + j.distance));
        }
        if (sure < RAYS * 8 / 10 || met < RAYS / 5 || met == sure)
            fail_msg("world %zu: %d sure, %d of them met", w, sure, met);
        end_soup(&soup);
    }
    free(queries);
    free(hits);
    bd_pool_destroy(&pool);
}

static void segments_are_blocked_by_what_lies_between_their_ends(void **unused)
{
    (void)unused;
    struct bd_pool *pool = bd_pool_create(2);
    struct bd_segment *segments = calloc(RAYS + 7, sizeof *segments);
    uint32_t *bits = calloc(RAYS / 32 + 1, sizeof *bits);
    for (size_t w = 0; w < sizeof worlds / sizeof *worlds; w++) {
        struct soup soup = begin_soup(w);
        for (int i = 0; i < RAYS + 7; i++) {
            random_point(segments[i].from);
            random_point(segments[i].to);
            segments[i].from_triangle = segments[i].to_triangle = BD_NO_TRIANGLE;
        }
        bd_rays_occluded(soup.rays, pool, BD_RAYS_ALPHA_MASK, segments, RAYS + 7, bits);
        int sure = 0, blocked = 0;
        for (int i = 0; i < RAYS + 7; i++) {
            float direction[3];
            for (int c = 0; c < 3; c++) direction[c] = segments[i].to[c] - segments[i].from[c];
            const struct judged j = judge(soup.corners, soup.count, segments[i].from, direction, 1);
            if (j.is_close) continue;
            sure++, blocked += j.number != BD_NO_TRIANGLE;
            assert_int_equal(bits[i / 32] >> i % 32 & 1, j.number != BD_NO_TRIANGLE);
        }
        assert_int_equal(bits[(RAYS + 7) / 32] >> (RAYS + 7) % 32, 0);
        if (sure < RAYS * 8 / 10 || blocked < RAYS / 5 || blocked == sure)
            fail_msg("world %zu: %d sure, %d of them blocked", w, sure, blocked);
        end_soup(&soup);
    }
    free(segments);
    free(bits);
    bd_pool_destroy(&pool);
}

// A point of a triangle as a shader has it: in 32 bits, off its plane by rounding.
static void point_of(const bd_dvec3 corner[3], float at[3])
{
    double u = chance(), v = chance();
    if (u + v > 1) u = 1 - u, v = 1 - v;
    const bd_dvec3 p =
        bd_dvec3_add(bd_dvec3_scale(corner[0], 1 - u - v),
                     bd_dvec3_add(bd_dvec3_scale(corner[1], u), bd_dvec3_scale(corner[2], v)));
    at[0] = (float)p.x, at[1] = (float)p.y, at[2] = (float)p.z;
}

// Inside a ball all points see each other: what blocks there is an end's own surface.
static void no_surface_blocks_what_starts_or_ends_on_it(void **unused)
{
    (void)unused;
    struct bd_pool *pool = bd_pool_create(2);
    struct bd_segment *segments = calloc(RAYS, sizeof *segments);
    uint32_t *bits = calloc(RAYS / 32 + 1, sizeof *bits);
    for (size_t w = 0; w < sizeof worlds / sizeof *worlds; w++) {
        struct stage *stage = stage_create();
        static const double centre[3] = {0};
        stage_sphere(stage, stage_material(stage, 0.5f), centre, worlds[w].size, 4, true);
        double *m = stage->scene->nodes[0].parent_from_node.m;
        m[12] = worlds[w].offset, m[14] = -worlds[w].offset;
        struct bd_err_detail detail = {0};
        assert_int_equal(bd_scene_finish(stage->scene, &detail), 0);
        struct bd_rays *rays = create_rays(stage->scene, w % 2 ? BD_RAYS_REPEATED_MAX : 0);
        uint64_t count;
        bd_dvec3 *corners = list_triangles(stage->scene, &count, NULL);
        for (int i = 0; i < RAYS; i++) {
            segments[i].from_triangle = (uint32_t)(chance() * (double)count);
            segments[i].to_triangle = (uint32_t)(chance() * (double)count);
            point_of(corners + 3 * (size_t)segments[i].from_triangle, segments[i].from);
            point_of(corners + 3 * (size_t)segments[i].to_triangle, segments[i].to);
        }
        bd_rays_occluded(rays, pool, BD_RAYS_ALPHA_MASK, segments, RAYS, bits);
        int blocked = 0;
        for (int i = 0; i < RAYS / 32; i++) blocked += __builtin_popcount(bits[i]);
        if (blocked) fail_msg("world %zu: %d of %d", w, blocked, RAYS);
        free(corners);
        bd_rays_destroy(&rays);
        stage_destroy(&stage);
    }
    free(segments);
    free(bits);
    bd_pool_destroy(&pool);
}

static void answers_do_not_depend_on_threads_or_on_the_batch(void **unused)
{
    (void)unused;
    struct stage *stage = create_soup(1, 0);
    struct bd_rays *rays = create_rays(stage->scene, 0);
    struct bd_pool *one = bd_pool_create(1), *many = bd_pool_create(4);
    struct bd_segment *segments = calloc(RAYS, sizeof *segments);
    uint32_t a[RAYS / 32], b[RAYS / 32], alone;
    for (int i = 0; i < RAYS; i++) {
        random_point(segments[i].from);
        random_point(segments[i].to);
        segments[i].from_triangle = segments[i].to_triangle = BD_NO_TRIANGLE;
    }
    bd_rays_occluded(rays, one, BD_RAYS_ALPHA_MASK, segments, RAYS, a);
    bd_rays_occluded(rays, many, BD_RAYS_ALPHA_MASK, segments, RAYS, b);
    assert_memory_equal(a, b, sizeof a);
    for (int i = 0; i < RAYS; i += 97) {
        bd_rays_occluded(rays, one, BD_RAYS_ALPHA_MASK, segments + i, 1, &alone);
        assert_int_equal(alone, a[i / 32] >> i % 32 & 1);
    }
    free(segments);
    bd_pool_destroy(&one);
    bd_pool_destroy(&many);
    bd_rays_destroy(&rays);
    stage_destroy(&stage);
}

static void rays_that_cannot_be_traced_meet_nothing(void **unused)
{
    (void)unused;
    static const float odd[] = {NAN, INFINITY, -INFINITY, 1e30f, -FLT_MAX, 1.9e18f, 0};
    struct stage *stage = create_soup(1, 0);
    struct bd_rays *rays = create_rays(stage->scene, 0);
    struct bd_pool *pool = bd_pool_create(1);
    for (size_t o = 0; o < sizeof odd / sizeof *odd; o++) {
        for (int field = 0; field < 6; field++) {
            struct bd_segment s = {{0}, BD_NO_TRIANGLE, {0}, BD_NO_TRIANGLE};
            struct bd_ray q = {.from_triangle = BD_NO_TRIANGLE, .far = odd[o]};
            (field < 3 ? s.from : s.to)[field % 3] = odd[o];
            (field < 3 ? q.origin : q.direction)[field % 3] = odd[o];
            uint32_t bit = 7;
            struct bd_ray_hit hit = {0};
            bd_rays_occluded(rays, pool, BD_RAYS_ALPHA_COVERAGE, &s, 1, &bit);
            bd_rays_nearest(rays, pool, BD_RAYS_ALPHA_COVERAGE, &q, 1, &hit);
            assert_int_equal(bit, 0);
            assert_int_equal(hit.triangle, BD_NO_TRIANGLE);
        }
    }
    bd_pool_destroy(&pool);
    bd_rays_destroy(&rays);
    stage_destroy(&stage);
}

// --- alpha ------------------------------------------------------------------------------------

// The share of segments through a square of one material that it blocks.
static double blocked_share(struct stage *stage, enum bd_rays_alpha alpha)
{
    enum { N = 4096 };
    struct bd_rays *rays = create_rays(stage->scene, 0);
    struct bd_pool *pool = bd_pool_create(2);
    struct bd_segment segments[N];
    uint32_t bits[N / 32], again[N / 32];
    for (int i = 0; i < N; i++) {
        const float x = (float)(0.5 * chance() - 0.25), z = (float)(0.5 * chance() - 0.25);
        segments[i] =
            (struct bd_segment){{x, -0.3f, z}, BD_NO_TRIANGLE, {x, 0.3f, z}, BD_NO_TRIANGLE};
    }
    bd_rays_occluded(rays, pool, alpha, segments, N, bits);
    bd_rays_occluded(rays, pool, alpha, segments, N, again);
    assert_memory_equal(bits, again, sizeof bits);
    int blocked = 0;
    for (int i = 0; i < N / 32; i++) blocked += __builtin_popcount(bits[i]);
    bd_pool_destroy(&pool);
    bd_rays_destroy(&rays);
    return (double)blocked / N;
}

static struct stage *create_square(enum bd_alpha_mode mode, float alpha)
{
    struct stage *stage = stage_create();
    const int32_t material = stage_material(stage, 0.5f);
    stage_floor(stage, material, 1, 0, 1);
    struct bd_material *m = stage_material_at(stage, material);
    m->alpha_mode = mode;
    m->base_color[3] = alpha;
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_scene_finish(stage->scene, &detail), 0);
    return stage;
}

static void what_is_not_opaque_blocks_by_its_alpha(void **unused)
{
    (void)unused;
    static const struct {
        enum bd_alpha_mode mode;
        float alpha;
        double mask, coverage;
    } cases[] = {
        {BD_ALPHA_OPAQUE, 0.1f, 1, 1},  {BD_ALPHA_MASK, 0.6f, 1, 1},    {BD_ALPHA_MASK, 0.4f, 0, 0},
        {BD_ALPHA_BLEND, 0.3f, 0, 0.3}, {BD_ALPHA_BLEND, 0.7f, 1, 0.7},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct stage *stage = create_square(cases[i].mode, cases[i].alpha);
        assert_float_equal(blocked_share(stage, BD_RAYS_ALPHA_MASK), cases[i].mask, 0);
        const double share = blocked_share(stage, BD_RAYS_ALPHA_COVERAGE);
        assert_float_equal(share, cases[i].coverage, 0.03);
        stage_destroy(&stage);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(first_triangles_are_those_of_all_asked_one_by_one),
        cmocka_unit_test(segments_are_blocked_by_what_lies_between_their_ends),
        cmocka_unit_test(no_surface_blocks_what_starts_or_ends_on_it),
        cmocka_unit_test(answers_do_not_depend_on_threads_or_on_the_batch),
        cmocka_unit_test(rays_that_cannot_be_traced_meet_nothing),
        cmocka_unit_test(what_is_not_opaque_blocks_by_its_alpha),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
