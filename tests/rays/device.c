// The device beside the processor, with the same segments: in scenes at their extremes, they differ
// nowhere but where rounding decides.

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "both.h"
#include "tests/reference/stage.h"
#include "tests/tools/load_scene.h"
#include "tests/unit/cmocka_all.h"

#define SEGMENTS 8000u

static struct both both;

// --- scenes -------------------------------------------------------------------------------------

typedef void make_triangle(uint32_t triangle, uint32_t count, float corners[9]);

static struct stage *create_triangles(uint32_t count, make_triangle *make)
{
    struct stage *stage = stage_create();
    float *positions = calloc(9 * (size_t)count, sizeof *positions);
    uint32_t *indices = calloc(3 * (size_t)count, sizeof *indices);
    for (uint32_t t = 0; t < count; t++) make(t, count, positions + 9 * (size_t)t);
    for (uint32_t i = 0; i < 3 * count; i++) indices[i] = i;
    stage_triangles(stage, stage_material(stage, 0.5f), positions, NULL, indices, 3 * count);
    free(positions);
    free(indices);
    return stage;
}

static void finish(struct stage *stage)
{
    struct bd_err_detail detail = {0};
    if (bd_scene_finish(stage->scene, &detail)) fail_msg("%s", detail.message);
}

static void take(struct stage *stage)
{
    struct bd_err_detail detail = {0};
    finish(stage);
    if (both_take(&both, stage->scene, &detail)) fail_msg("%s", detail.message);
}

static void drop(struct stage **stage)
{
    both_drop(&both);
    stage_destroy(stage);
}

static void anywhere(uint32_t triangle, uint32_t count, float corners[9])
{
    (void)triangle;
    double centre[3];
    const double size = 3 / cbrt(count);
    for (int c = 0; c < 3; c++) centre[c] = 2 * both_chance(&both) - 1;
    for (int i = 0; i < 9; i++)
        corners[i] = (float)(centre[i % 3] + size * (both_chance(&both) - 0.5));
}

static void of_any_size(uint32_t triangle, uint32_t count, float corners[9])
{
    anywhere(triangle, count, corners);
    const double scale = pow(2, -24 * both_chance(&both));
    for (int i = 3; i < 9; i++)
        corners[i] = (float)(corners[i % 3] + scale * ((double)corners[i] - corners[i % 3]));
}

// All in one place, but for the last.
static void coincident(uint32_t triangle, uint32_t count, float corners[9])
{
    static const float same[9] = {-1, -1, -1, 1, -1, 0.5f, 0, 1, 1};
    static const float last[9] = {1, -1, -1, 1, 1, -1, 1, 0, 1};
    memcpy(corners, triangle + 1 < count ? same : last, sizeof same);
}

// Points, lines, and now and then a triangle.
static void degenerate(uint32_t triangle, uint32_t count, float corners[9])
{
    anywhere(triangle, count, corners);
    if (triangle % 4 > 0) memcpy(corners + 6, corners + 3, 3 * sizeof *corners);
    if (triangle % 4 > 1) memcpy(corners + 3, corners, 3 * sizeof *corners);
    if (triangle % 4 > 1) memcpy(corners + 6, corners, 3 * sizeof *corners);
}

// Each half as large and half as far away as the one before.
static void ever_smaller(uint32_t triangle, uint32_t count, float corners[9])
{
    anywhere(triangle, count, corners);
    for (int i = 0; i < 9; i++) corners[i] = ldexpf(corners[i], -(int)(triangle % 140));
}

// Fins across the whole cube beside a path along x: their boxes lie over it, they themselves beside
// it, but for the last.
static void fins(uint32_t triangle, uint32_t count, float corners[9])
{
    const float x = (float)(2.0 * triangle / count - 1);
    const float fin[9] = {x, -1, -1, x, 1, 1, x, 1, -1}, wall[9] = {1, 0, -1, 1, 1, 1, 1, -1, 1};
    memcpy(corners, triangle + 1 < count ? fin : wall, sizeof fin);
}

// Of the coincident, a third lie in the plane of all.
static const struct kind {
    const char *name;
    uint32_t count;
    make_triangle *make;
    double most_differ; // of all segments
} kinds[] = {
    {"one", 1, anywhere, 1e-3},
    {"two", 2, anywhere, 1e-3},
    {"many", 3000, anywhere, 1e-3},
    {"of any size", 3000, of_any_size, 1e-3},
    {"coincident", 600, coincident, 0.1},
    {"degenerate", 2000, degenerate, 1e-3},
    {"ever smaller", 1400, ever_smaller, 1e-3},
};

static const struct world {
    double size, offset;
} worlds[] = {{1, 0}, {1e-4, 0}, {1e6, 0}, {1, 1e6}, {1e3, -1e9}};

static void put(struct stage *stage, const struct world *world)
{
    double *m = stage->scene->nodes[0].parent_from_node.m;
    for (int i = 0; i < 15; i++) m[i] *= i % 4 == 3 ? 1 : world->size;
    m[12] += world->offset, m[13] -= world->offset, m[14] += 0.5 * world->offset;
}

// --- both ---------------------------------------------------------------------------------------

struct answers {
    uint32_t bits[EXECUTOR_COUNT][SEGMENTS / 32 + 1];
    size_t blocked;
};

static uint32_t bit_of(const uint32_t *bits, size_t i)
{
    return bits[i / 32] >> i % 32 & 1;
}

// Asks both, and holds them to one another.
static size_t ask(const char *name, const struct bd_segment *segments, size_t count,
                  struct answers *answers)
{
    struct bd_ray_counts traced[EXECUTOR_COUNT];
    const size_t words = (count + 31) / 32;
    for (enum executor e = 0; e < EXECUTOR_COUNT; e++) {
        memset(answers->bits[e], 0xff, sizeof answers->bits[e]);
        traced[e] = both_ask(&both, e, BD_RAYS_ALPHA_MASK, segments, count, answers->bits[e]);
        if (count % 32) assert_int_equal(answers->bits[e][words - 1] >> count % 32, 0);
        assert_int_equal(answers->bits[e][words], UINT32_MAX);
    }
    assert_int_equal(traced[DEVICE].count, traced[PROCESSOR].count);
    assert_true(traced[DEVICE].ms > 0);
    const struct differences d =
        both_compare(&both, segments, count, answers->bits[PROCESSOR], answers->bits[DEVICE]);
    if (d.unexplained)
        fail_msg("%s: %zu of %zu differences are away from any edge, first that of segment %zu, "
                 "which the processor says is %s",
                 name, d.unexplained, d.count, d.first_unexplained,
                 bit_of(answers->bits[PROCESSOR], d.first_unexplained) ? "blocked" : "not");
    answers->blocked = 0;
    for (size_t w = 0; w < words; w++)
        answers->blocked += (size_t)__builtin_popcount(answers->bits[DEVICE][w]);
    return d.count;
}

static void both_answer_alike(void **unused)
{
    (void)unused;
    const size_t count = SEGMENTS / 2 + 7;
    struct bd_segment *segments = calloc(count, sizeof *segments);
    struct answers answers;
    for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++) {
        size_t differ = 0, blocked = 0;
        for (size_t w = 0; w < sizeof worlds / sizeof *worlds; w++) {
            struct stage *stage = create_triangles(kinds[k].count, kinds[k].make);
            put(stage, &worlds[w]);
            take(stage);
            both_choose(&both, segments, count);
            differ += ask(kinds[k].name, segments, count, &answers);
            blocked += answers.blocked;
            drop(&stage);
        }
        printf("    %s: %zu of %zu blocked, %zu differ\n", kinds[k].name, blocked,
               count * sizeof worlds / sizeof *worlds, differ);
        assert_true(blocked > 0 && blocked < 5 * count);
        assert_true((double)differ <= kinds[k].most_differ * 5 * (double)count);
    }
    free(segments);
}

// Asks both what rays meet first, and holds them to one another.
static size_t meet(const char *name, const struct bd_ray *rays, size_t count,
                   struct bd_ray_hit *hits[EXECUTOR_COUNT])
{
    struct bd_ray_counts traced[EXECUTOR_COUNT];
    for (enum executor e = 0; e < EXECUTOR_COUNT; e++) {
        memset(hits[e], 0xa5, count * sizeof *hits[e]);
        traced[e] = both_meet(&both, e, BD_RAYS_ALPHA_MASK, rays, count, hits[e]);
    }
    assert_true(traced[PROCESSOR].count == count && traced[DEVICE].count == count);
    const struct differences d =
        both_compare_hits(&both, rays, count, hits[PROCESSOR], hits[DEVICE]);
    const size_t i = d.first_unexplained;
    if (d.unexplained)
        fail_msg("%s: %zu of %zu differences are away from any edge, first that of ray %zu: "
                 "triangle %u at %g, and the device says %u at %g",
                 name, d.unexplained, d.count, i, hits[PROCESSOR][i].triangle,
                 (double)hits[PROCESSOR][i].distance, hits[DEVICE][i].triangle,
                 (double)hits[DEVICE][i].distance);
    return d.count;
}

static size_t count_met(const struct bd_ray_hit *hits, size_t count)
{
    size_t met = 0;
    for (size_t i = 0; i < count; i++) met += hits[i].triangle != BD_NO_TRIANGLE;
    return met;
}

static void create_hits(size_t count, struct bd_ray_hit *hits[EXECUTOR_COUNT])
{
    for (int e = 0; e < EXECUTOR_COUNT; e++) hits[e] = calloc(count, sizeof *hits[e]);
}

static void free_hits(struct bd_ray_hit *hits[EXECUTOR_COUNT])
{
    for (int e = 0; e < EXECUTOR_COUNT; e++) free(hits[e]);
}

static void both_meet_the_same_first(void **unused)
{
    (void)unused;
    const size_t count = SEGMENTS / 2 + 7;
    struct bd_ray *rays = calloc(count, sizeof *rays);
    struct bd_ray_hit *hits[EXECUTOR_COUNT];
    create_hits(count, hits);
    for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++) {
        size_t differ = 0, met = 0;
        for (size_t w = 0; w < sizeof worlds / sizeof *worlds; w++) {
            struct stage *stage = create_triangles(kinds[k].count, kinds[k].make);
            put(stage, &worlds[w]);
            take(stage);
            both_choose_rays(&both, rays, count);
            differ += meet(kinds[k].name, rays, count, hits);
            met += count_met(hits[DEVICE], count);
            drop(&stage);
        }
        printf("    %s: %zu of %zu meet something, %zu differ\n", kinds[k].name, met,
               count * sizeof worlds / sizeof *worlds, differ);
        assert_true(met > 0 && met < 5 * count);
        assert_true((double)differ <= kinds[k].most_differ * 5 * (double)count);
    }
    free(rays);
    free_hits(hits);
}

// Of coincident triangles each is met at the same distance.
static void of_triangles_in_one_place_the_first_is_met(void **unused)
{
    (void)unused;
    struct stage *stage = create_triangles(600, coincident);
    struct bd_ray *rays = calloc(SEGMENTS, sizeof *rays);
    struct bd_ray_hit *hits[EXECUTOR_COUNT];
    create_hits(SEGMENTS, hits);
    take(stage);
    both_choose_rays(&both, rays, SEGMENTS);
    for (size_t i = 0; i < SEGMENTS; i++) rays[i].from_triangle = BD_NO_TRIANGLE;
    meet("coincident", rays, SEGMENTS, hits);
    size_t first = 0;
    for (size_t i = 0; i < SEGMENTS; i++) {
        const uint32_t met = hits[DEVICE][i].triangle;
        assert_true(met == 0 || met == 599 || met == BD_NO_TRIANGLE);
        first += met == 0;
    }
    assert_true(first > SEGMENTS / 10);
    free(rays);
    free_hits(hits);
    drop(&stage);
}

// Single-sided ones, in a frame that is mirrored or not.
static void backs_are_passed_alike(void **unused)
{
    (void)unused;
    struct bd_ray *rays = calloc(SEGMENTS, sizeof *rays);
    struct bd_ray_hit *hits[EXECUTOR_COUNT];
    create_hits(SEGMENTS, hits);
    size_t met[4];
    for (int kind = 0; kind < 4; kind++) {
        const bool mirrored = kind & 1, double_sided = kind & 2;
        struct stage *stage = create_triangles(300, anywhere);
        stage_material_at(stage, 0)->double_sided = double_sided;
        if (mirrored) stage->scene->nodes[0].parent_from_node.m[0] *= -1;
        take(stage);
        both_choose_rays(&both, rays, SEGMENTS);
        for (size_t i = 0; i < SEGMENTS; i++) rays[i].passes_backs = 1;
        for (enum executor e = 0; e < EXECUTOR_COUNT; e++)
            both_meet(&both, e, BD_RAYS_ALPHA_MASK, rays, SEGMENTS, hits[e]);
        size_t differ = 0;
        for (size_t i = 0; i < SEGMENTS; i++)
            differ += hits[PROCESSOR][i].triangle != hits[DEVICE][i].triangle;
        assert_true(differ <= SEGMENTS / 1000);
        met[kind] = count_met(hits[DEVICE], SEGMENTS);
        drop(&stage);
    }
    assert_true(met[0] < met[2] * 9 / 10 && met[1] < met[3] * 9 / 10);
    free(rays);
    free_hits(hits);
}

// From within a ball through its edges, and through its corners, where both may let one in some
// hundreds through: edges about a corner are each tested by themselves.
static void nothing_passes_between_triangles(void **unused)
{
    (void)unused;
    struct bd_segment *segments = calloc(SEGMENTS, sizeof *segments);
    struct answers answers;
    for (size_t w = 0; w < 2 * sizeof worlds / sizeof *worlds; w++) {
        const bool corners = w % 2;
        struct stage *stage = stage_create();
        static const double centre[3] = {0};
        stage_sphere(stage, stage_material(stage, 0.5f), centre, 1, 6, true);
        put(stage, &worlds[w / 2]);
        take(stage);
        for (uint32_t i = 0; i < SEGMENTS; i++) {
            struct bd_segment *s = &segments[i];
            const uint32_t t = (uint32_t)(both_chance(&both) * both.nodes->triangle_count);
            const struct bd_ray_triangle *triangle = &both.nodes->triangles[t];
            const float along = corners ? 0 : (float)(0.05 + 0.9 * both_chance(&both));
            s->from_triangle = s->to_triangle = BD_NO_TRIANGLE;
            for (int c = 0; c < 3; c++) {
                const float on = triangle->a[c] + along * (triangle->b[c] - triangle->a[c]);
                s->from[c] = i % 3 ? (float)(0.2 * both_chance(&both)) : 0;
                s->to[c] = s->from[c] + 1.5f * (on - s->from[c]);
            }
        }
        const size_t differ = ask("a ball", segments, SEGMENTS, &answers);
        if (corners)
            printf("    corners: %zu pass, %zu differ\n", SEGMENTS - answers.blocked, differ);
        assert_true(answers.blocked >= SEGMENTS - (corners ? SEGMENTS / 200 : 0));
        drop(&stage);
    }
    free(segments);
}

// Inside a ball all points see each other: what blocks there is an end's own surface.
static void no_surface_blocks_what_starts_or_ends_on_it(void **unused)
{
    (void)unused;
    struct bd_segment *segments = calloc(3 * SEGMENTS, sizeof *segments);
    struct answers answers;
    for (size_t w = 0; w < sizeof worlds / sizeof *worlds; w++) {
        struct stage *stage = stage_create();
        static const double centre[3] = {0};
        stage_sphere(stage, stage_material(stage, 0.5f), centre, 1, 4, true);
        put(stage, &worlds[w]);
        take(stage);
        both_choose(&both, segments, 3 * SEGMENTS);
        for (uint32_t i = 0; i < SEGMENTS; i++) segments[i] = segments[3 * i];
        assert_int_equal(ask("within a ball", segments, SEGMENTS, &answers), 0);
        assert_int_equal(answers.blocked, 0);
        drop(&stage);
    }
    free(segments);
}

static void an_empty_scene_blocks_nothing(void **unused)
{
    (void)unused;
    struct stage *stage = stage_create();
    struct bd_segment segments[40] = {{{0}, 0, {1, 2, 3}, 0}};
    struct answers answers;
    take(stage);
    assert_int_equal(both.nodes->node_count, 0);
    ask("nothing", segments, 40, &answers);
    assert_int_equal(answers.blocked, 0);
    drop(&stage);
}

static void segments_that_cannot_be_traced_are_blocked_by_nothing(void **unused)
{
    (void)unused;
    static const float odd[] = {NAN,     -NAN,   INFINITY, -INFINITY, 1e30f, -FLT_MAX,
                                1.9e18f, 1e-40f, -1e-30f,  0,         -0.0f};
    enum { ODD = sizeof odd / sizeof *odd };
    struct bd_segment segments[6 * ODD];
    struct answers answers;
    for (int i = 0; i < 6 * ODD; i++) {
        struct bd_segment *s = &segments[i];
        *s = (struct bd_segment){.from_triangle = BD_NO_TRIANGLE, .to_triangle = BD_NO_TRIANGLE};
        (i % 6 < 3 ? s->from : s->to)[i % 3] = odd[i / 6];
    }
    struct stage *stage = create_triangles(100, anywhere);
    take(stage);
    ask("odd", segments, 6 * ODD, &answers);
    assert_int_equal(answers.blocked, 0);
    struct bd_ray rays[6 * ODD];
    struct bd_ray_hit *hits[EXECUTOR_COUNT];
    create_hits(6 * ODD, hits);
    for (int i = 0; i < 6 * ODD; i++) {
        rays[i] = (struct bd_ray){.from_triangle = BD_NO_TRIANGLE, .far = INFINITY};
        // One that begins at an odd place goes somewhere, if it can begin there at all.
        rays[i].direction[(i + 1) % 3] = i % 6 < 3 && !(fabsf(odd[i / 6]) < 1.8e18f);
        (i % 6 < 3 ? rays[i].origin : rays[i].direction)[i % 3] = odd[i / 6];
    }
    meet("odd", rays, 6 * ODD, hits);
    for (int i = 0; i < 6 * ODD; i++) assert_int_equal(hits[DEVICE][i].triangle, BD_NO_TRIANGLE);
    free_hits(hits);
    drop(&stage);
}

// Walks that one dispatch does not end.
static void long_walks_are_gone_to_their_end(void **unused)
{
    (void)unused;
    enum { COUNT = 200 };
    struct bd_segment segments[COUNT];
    struct answers answers;
    struct stage *stage = create_triangles(30000, fins);
    take(stage);
    const struct bd_ray_node *root = &both.nodes->nodes[0];
    for (int i = 0; i < COUNT; i++) {
        struct bd_segment *s = &segments[i];
        *s = (struct bd_segment){.from_triangle = BD_NO_TRIANGLE, .to_triangle = BD_NO_TRIANGLE};
        for (int c = 0; c < 3; c++) {
            const float size = root->most[c] - root->least[c];
            const float at = c == 0 ? 0.0001f : (c == 1 ? 0.3f : 0.4f) + 0.0004f * (float)i;
            s->from[c] = s->to[c] = root->least[c] + at * size;
        }
        s->to[0] = i % 2 ? root->most[0] : root->most[0] + 0.1f;
    }
    ask("fins", segments, COUNT, &answers);
    assert_int_equal(answers.blocked, COUNT / 2);
    struct bd_ray rays[COUNT];
    struct bd_ray_hit *hits[EXECUTOR_COUNT];
    create_hits(COUNT, hits);
    for (int i = 0; i < COUNT; i++) {
        rays[i] = (struct bd_ray){.from_triangle = BD_NO_TRIANGLE, .direction = {1}};
        memcpy(rays[i].origin, segments[i].from, sizeof rays[i].origin);
        rays[i].far = (i % 2 ? 0.99f : 1) * (segments[i].to[0] - segments[i].from[0]);
    }
    meet("fins", rays, COUNT, hits);
    assert_int_equal(count_met(hits[DEVICE], COUNT), COUNT / 2);
    free_hits(hits);
    drop(&stage);
}

// --- alpha --------------------------------------------------------------------------------------

// Of 5 x 3 texels; all kinds of wrapping, either filter, a transform, colours at the corners.
static void add_map(struct stage *stage, struct bd_material *material, int kind)
{
    struct bd_scene *s = stage->scene;
    struct bd_picture *picture = calloc(1, sizeof *picture);
    *picture = (struct bd_picture){.reference_count = 1, .width_px = 5, .height_px = 3};
    picture->rgba = malloc(4 * 15);
    for (int i = 0; i < 60; i++) picture->rgba[i] = (uint8_t)(256 * both_chance(&both));
    bd_picture_seal(picture);
    s->pictures = calloc(1, sizeof *s->pictures);
    s->textures = calloc(1, sizeof *s->textures);
    s->pictures[0] = picture;
    s->textures[0] = (struct bd_texture){.wrap_s = (enum bd_wrap)(kind % 3),
                                         .wrap_t = (enum bd_wrap)(kind / 3 % 3),
                                         .nearest = kind % 2};
    s->picture_count = s->texture_count = 1;
    const float transform[6] = {1.7f, -0.4f, 0.1f, 0.3f, 2.1f, -0.6f};
    memcpy(material->base_color_map.uv_transform, transform, sizeof transform);
    material->base_color_map.texture = 0;
}

static struct stage *create_cutouts(int kind)
{
    struct stage *stage = stage_create();
    const int32_t opaque = stage_material(stage, 0.5f), cutout = stage_material(stage, 0.5f);
    stage_material_at(stage, opaque)->alpha_mode = BD_ALPHA_OPAQUE;
    for (int i = 0; i < 12; i++) {
        const double y = (i - 5.5) / 12, tilt = 0.1 * both_chance(&both);
        const double corners[4][3] = {{-1, y, 1}, {1, y + tilt, 1}, {1, y, -1}, {-1, y - tilt, -1}};
        stage_quad(stage, i == 5 ? opaque : cutout, corners);
        struct bd_primitive *p = stage->scene->meshes[i]->primitives;
        for (uint32_t v = 0; v < 2 * p->vertex_count; v++)
            p->uv[0][v] = (float)(10 * both_chance(&both) - 5);
        if (i % 3) continue;
        p->color = calloc(4 * (size_t)p->vertex_count, sizeof *p->color);
        for (uint32_t v = 0; v < 4 * p->vertex_count; v++) p->color[v] = (float)both_chance(&both);
    }
    struct bd_material *m = stage_material_at(stage, cutout);
    m->alpha_mode = kind % 4 == 3 ? BD_ALPHA_MASK : BD_ALPHA_BLEND;
    m->alpha_cutoff = 0.4f;
    m->base_color[3] = 0.9f;
    if (kind > 0) add_map(stage, m, kind);
    return stage;
}

// Of what rays meet first, by either reading of what blends.
static void check_alpha_of_rays(int kind)
{
    struct bd_ray *rays = calloc(SEGMENTS, sizeof *rays);
    struct bd_ray_hit *hits[EXECUTOR_COUNT];
    create_hits(SEGMENTS, hits);
    both_choose_rays(&both, rays, SEGMENTS);
    for (int coverage = 0; coverage < 2; coverage++) {
        const enum bd_rays_alpha alpha = coverage ? BD_RAYS_ALPHA_COVERAGE : BD_RAYS_ALPHA_MASK;
        for (enum executor e = 0; e < EXECUTOR_COUNT; e++)
            both_meet(&both, e, alpha, rays, SEGMENTS, hits[e]);
        size_t differ = 0;
        for (size_t i = 0; i < SEGMENTS; i++)
            differ += hits[PROCESSOR][i].triangle != hits[DEVICE][i].triangle;
        if (differ > SEGMENTS / 1000)
            fail_msg("kind %d: %zu rays differ, coverage %d", kind, differ, coverage);
        assert_true(count_met(hits[DEVICE], SEGMENTS) > SEGMENTS / 20);
    }
    free(rays);
    free_hits(hits);
}

static void alpha_is_alike(void **unused)
{
    (void)unused;
    struct bd_segment *segments = calloc(SEGMENTS, sizeof *segments);
    struct answers answers;
    for (int kind = 0; kind < 19; kind++) {
        struct stage *stage = create_cutouts(kind);
        take(stage);
        assert_non_null(both.occluders[DEVICE]->cutouts);
        both_choose(&both, segments, SEGMENTS);
        const size_t masked = ask("cutouts", segments, SEGMENTS, &answers);
        const size_t blocked = answers.blocked;
        for (enum executor e = 0; e < EXECUTOR_COUNT; e++)
            both_ask(&both, e, BD_RAYS_ALPHA_COVERAGE, segments, SEGMENTS, answers.bits[e]);
        size_t differ = 0, covered = 0;
        for (size_t w = 0; w < SEGMENTS / 32; w++) {
            const uint32_t *const *bits = (const uint32_t *[]){answers.bits[0], answers.bits[1]};
            differ += (size_t)__builtin_popcount(bits[PROCESSOR][w] ^ bits[DEVICE][w]);
            covered += (size_t)__builtin_popcount(bits[DEVICE][w]);
        }
        if (masked > SEGMENTS / 1000 || differ > SEGMENTS / 1000)
            fail_msg("kind %d: %zu differ, %zu with coverage", kind, masked, differ);
        assert_true(blocked > SEGMENTS / 20 && blocked < SEGMENTS * 19 / 20);
        assert_int_equal(kind % 4 == 3, covered == blocked);
        check_alpha_of_rays(kind);
        drop(&stage);
    }
    free(segments);
}

// --- nodes --------------------------------------------------------------------------------------

static bool stop(void *user)
{
    (void)user;
    return true;
}

static enum bd_err create_nodes(struct stage *stage, const struct bd_rays_build *build,
                                uint64_t bytes_max, struct bd_ray_nodes **out)
{
    struct bd_err_detail detail = {0};
    const enum bd_err err = bd_ray_nodes_create(stage->scene, build, bytes_max, out, &detail);
    assert_int_equal(err != BD_ERR_OK, *out == NULL);
    return err;
}

static void nodes_do_not_depend_on_threads(void **unused)
{
    (void)unused;
    struct stage *stage = create_triangles(40000, of_any_size);
    finish(stage);
    struct bd_ray_nodes *one, *many;
    for (uint32_t threads = 2; threads <= 8; threads += 3) {
        const struct bd_rays_build alone = {.thread_count = 1}, build = {.thread_count = threads};
        assert_int_equal(create_nodes(stage, &alone, UINT64_MAX, &one), BD_ERR_OK);
        assert_int_equal(create_nodes(stage, &build, UINT64_MAX, &many), BD_ERR_OK);
        assert_int_equal(one->node_count, many->node_count);
        assert_int_equal(one->triangle_count, 40000);
        assert_memory_equal(one->nodes, many->nodes, one->node_count * sizeof *one->nodes);
        assert_memory_equal(one->triangles, many->triangles, 40000 * sizeof *one->triangles);
        bd_ray_nodes_destroy(&one);
        bd_ray_nodes_destroy(&many);
    }
    stage_destroy(&stage);
}

static void what_is_not_for_a_device_is_said_so(void **unused)
{
    (void)unused;
    struct stage *stage = create_triangles(1000, anywhere);
    finish(stage);
    struct bd_ray_nodes *nodes;
    const struct bd_rays_build build = {0}, stopped = {.should_stop = stop};
    assert_int_equal(create_nodes(stage, &stopped, UINT64_MAX, &nodes), BD_ERR_CANCELLED);
    assert_int_equal(create_nodes(stage, &build, 63999, &nodes), BD_ERR_UNSUPPORTED);
    assert_int_equal(create_nodes(stage, &build, 64000, &nodes), BD_ERR_OK);
    assert_true(nodes->node_count * sizeof *nodes->nodes <= 64000);
    bd_ray_nodes_destroy(&nodes);
    stage_destroy(&stage);
}

static int open(void **state)
{
    (void)state;
    both_open(&both);
    return 0;
}

static int close(void **state)
{
    (void)state;
    both_close(&both);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(both_answer_alike),
        cmocka_unit_test(both_meet_the_same_first),
        cmocka_unit_test(of_triangles_in_one_place_the_first_is_met),
        cmocka_unit_test(backs_are_passed_alike),
        cmocka_unit_test(nothing_passes_between_triangles),
        cmocka_unit_test(no_surface_blocks_what_starts_or_ends_on_it),
        cmocka_unit_test(an_empty_scene_blocks_nothing),
        cmocka_unit_test(segments_that_cannot_be_traced_are_blocked_by_nothing),
        cmocka_unit_test(long_walks_are_gone_to_their_end),
        cmocka_unit_test(alpha_is_alike),
        cmocka_unit_test(nodes_do_not_depend_on_threads),
        cmocka_unit_test(what_is_not_for_a_device_is_said_so),
    };
    return cmocka_run_group_tests(tests, open, close);
}
