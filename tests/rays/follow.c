// A structure that follows an earlier snapshot's, against one that is built anew: edits at random,
// ray by ray the same bits.

#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "rays/rays.h"
#include "scene/model/render_space.h"
#include "tests/reference/stage.h"
#include "tests/unit/cmocka_all.h"

#define RAYS 51200

static uint64_t state = 1;

static double chance(void)
{
    state ^= state << 13, state ^= state >> 7, state ^= state << 17;
    return (double)(state >> 11) * 0x1p-53;
}

static uint32_t pick(uint32_t count)
{
    return (uint32_t)(chance() * count);
}

// --- a world that is edited -------------------------------------------------------------------

#define SHAPES      6u
#define OBJECTS_MAX 60u
#define MATERIALS   3u

struct object {
    uint32_t shape, material;
    bd_dmat4 matrix;
};

// Shapes are drawn from their seeds, so that equal ones have equal triangles.
struct world {
    double size, offset;
    uint32_t fineness; // of shapes
    bool is_lattice;   // everything stands on corners of a lattice, faces along its planes
    uint64_t seeds[SHAPES];
    enum bd_alpha_mode modes[MATERIALS];
    uint32_t object_count;
    struct object objects[OBJECTS_MAX];
};

// Turned, scaled by `scale` (a mirror where it is negative), unevenly by `uneven`.
static bd_dmat4 somewhere(double scale, double uneven)
{
    const double s[3] = {scale, fabs(scale) * uneven, fabs(scale)};
    const double at[3] = {chance() - 0.5, chance() - 0.5, chance() - 0.5};
    const double turn[4] = {chance() - 0.5, chance() - 0.5, chance() - 0.5, chance()};
    return bd_dmat4_from_trs(at, turn, s);
}

static struct object any_object(void)
{
    const double scale = 0.02 + 0.2 * chance();
    return (struct object){pick(SHAPES), pick(MATERIALS),
                           somewhere(pick(4) ? scale : -scale, pick(5) ? 1 : 12)};
}

static void begin_world(struct world *world, double size, double offset)
{
    *world = (struct world){.size = size, .offset = offset, .fineness = 1, .object_count = 30};
    for (uint32_t s = 0; s < SHAPES; s++) world->seeds[s] = 1 + pick(1000000);
    world->modes[1] = BD_ALPHA_BLEND;
    for (uint32_t o = 0; o < world->object_count; o++) world->objects[o] = any_object();
}

// Corner `c` of a triangle, along one axis: half a square of the lattice, in one of its planes.
static float lattice_of(uint32_t shape, uint32_t c, uint32_t axis, const double centre[3])
{
    const double at = round(4 * centre[axis]) / 4;
    if (axis == shape % 3 || c == 0) return (float)at;
    return (float)(at + ((axis == (shape + 1) % 3) == (c == 1) ? 0.5 : 0));
}

static void add_shape(struct stage *stage, const struct world *world, uint32_t shape,
                      int32_t material)
{
    const uint64_t saved = state;
    const uint32_t triangles = world->fineness * (30 + 60 * shape);
    float *positions = calloc(9 * (size_t)triangles, sizeof *positions);
    uint32_t *indices = calloc(3 * (size_t)triangles, sizeof *indices);
    state = world->seeds[shape];
    for (uint32_t t = 0; t < triangles; t++) {
        const double centre[3] = {2 * chance() - 1, 2 * chance() - 1, 2 * chance() - 1};
        for (uint32_t i = 0; i < 9; i++)
            positions[9 * t + i] = (float)(centre[i % 3] + 0.5 * (chance() - 0.5));
        for (uint32_t i = 0; world->is_lattice && i < 9; i++)
            positions[9 * t + i] = lattice_of(shape, i / 3, i % 3, centre);
        for (uint32_t i = 0; i < 3; i++) indices[3 * t + i] = 3 * t + i;
    }
    stage_triangles(stage, material, positions, NULL, indices, 3 * triangles);
    free(positions);
    free(indices);
    state = saved;
}

// A corner of the world on each side, so that what is within does not move its middle.
static void add_corners(struct stage *stage, int32_t material)
{
    static const float positions[18] = {-2, -2, -2, -2, -2, -1.9f, -2, -1.9f, -2,
                                        2,  2,  2,  2,  2,  1.9f,  2,  1.9f,  2};
    static const uint32_t indices[6] = {0, 1, 2, 3, 4, 5};
    stage_triangles(stage, material, positions, NULL, indices, 6);
}

static struct bd_node *add_node(struct bd_scene *s)
{
    s->nodes = realloc(s->nodes, (s->node_count + 1) * sizeof *s->nodes);
    s->nodes[s->node_count] = s->nodes[0];
    return &s->nodes[s->node_count++];
}

// Mesh 0 is the corners; shape s of material m is mesh 1 + s * MATERIALS + m. Nodes of the stage
// are hidden but for the first.
static struct stage *create_stage(const struct world *world)
{
    struct stage *stage = stage_create();
    for (uint32_t m = 0; m < MATERIALS; m++) {
        struct bd_material *material = stage_material_at(stage, stage_material(stage, 0.5f));
        material->alpha_mode = world->modes[m];
        material->base_color[3] = 0.6f;
    }
    add_corners(stage, 0);
    for (uint32_t i = 0; i < SHAPES * MATERIALS; i++)
        add_shape(stage, world, i / MATERIALS, (int32_t)(i % MATERIALS));
    for (uint32_t n = 1; n < stage->scene->node_count; n++) stage->scene->nodes[n].is_hidden = true;
    for (uint32_t o = 0; o < world->object_count; o++) {
        const struct object *object = &world->objects[o];
        struct bd_node *node = add_node(stage->scene);
        node->mesh = (int32_t)(1 + object->shape * MATERIALS + object->material);
        node->parent_from_node = object->matrix;
        node->is_hidden = false;
    }
    for (uint32_t n = 0; n < stage->scene->node_count; n++) {
        double *m = stage->scene->nodes[n].parent_from_node.m;
        for (int i = 0; i < 15; i++) m[i] *= i % 4 == 3 ? 1 : world->size;
        m[12] += world->offset, m[13] -= world->offset, m[14] += 0.5 * world->offset;
    }
    struct bd_err_detail detail = {0};
    if (bd_scene_finish(stage->scene, &detail)) fail_msg("%s", detail.message);
    return stage;
}

enum edit {
    MOVE,
    STRETCH, // so that what was kept is placed
    MIRROR,
    REMOVE,
    ADD,
    DOUBLE, // another one in the same place
    NEW_VERTICES,
    NEW_ALPHA_MODE,
    NOTHING,
    EDIT_COUNT,
};

static void edit(struct world *world, enum edit what)
{
    struct object *object = &world->objects[pick(world->object_count)];
    const bool has_room = world->object_count < OBJECTS_MAX;
    switch (what) {
    case MOVE:
        object->matrix = somewhere(0.1, 1);
        break;
    case STRETCH:
        object->matrix = somewhere(0.1, 15);
        break;
    case MIRROR:
        for (int i = 0; i < 3; i++) object->matrix.m[i] *= -1;
        break;
    case REMOVE:
        if (world->object_count > 10) *object = world->objects[--world->object_count];
        break;
    case ADD:
        if (has_room) world->objects[world->object_count++] = any_object();
        break;
    case DOUBLE:
        if (has_room) world->objects[world->object_count++] = *object;
        break;
    case NEW_VERTICES:
        world->seeds[pick(2)] = 1 + pick(1000000);
        break;
    case NEW_ALPHA_MODE:
        world->modes[2] = (enum bd_alpha_mode)pick(3);
        break;
    case NOTHING:
    case EDIT_COUNT:
        break;
    }
}

// --- asking both ------------------------------------------------------------------------------

struct questions {
    struct bd_pool *pool;
    struct bd_segment segments[RAYS];
    struct bd_ray rays[RAYS];
    uint32_t bits[2][RAYS / 32];
    struct bd_ray_hit hits[2][RAYS];
};

static uint32_t any_end(uint64_t triangle_count)
{
    return pick(2) ? BD_NO_TRIANGLE : pick((uint32_t)triangle_count);
}

// A point of the lattice, in render space.
static void lattice_point(const struct bd_render_space *space, float at[3])
{
    const bd_dvec3 place = {pick(33) / 16.0 - 1, pick(33) / 16.0 - 1, pick(33) / 16.0 - 1};
    const bd_dvec3 placed = bd_render_from_world(space, place);
    at[0] = (float)placed.x, at[1] = (float)placed.y, at[2] = (float)placed.z;
}

static void ask_anything(struct questions *q, const struct bd_scene *scene, bool on_lattice)
{
    const uint64_t triangle_count = scene->features.triangle_count;
    const struct bd_render_space space = bd_render_space_of(scene);
    for (int i = 0; i < RAYS; i++) {
        struct bd_segment *s = &q->segments[i];
        struct bd_ray *ray = &q->rays[i];
        for (int c = 0; c < 3; c++) {
            s->from[c] = (float)(0.5 * chance() - 0.25);
            s->to[c] = (float)(0.5 * chance() - 0.25);
        }
        if (on_lattice) {
            lattice_point(&space, s->from);
            lattice_point(&space, s->to);
        }
        for (int c = 0; c < 3; c++) {
            ray->origin[c] = s->from[c];
            ray->direction[c] = s->to[c] - s->from[c];
        }
        s->from_triangle = ray->from_triangle = any_end(triangle_count);
        s->to_triangle = any_end(triangle_count);
        ray->far = i % 2 ? INFINITY : 1;
    }
}

static uint32_t answer(struct questions *q, int which, const struct bd_rays *rays)
{
    const enum bd_rays_alpha alpha = BD_RAYS_ALPHA_COVERAGE;
    uint32_t blocked = 0;
    bd_rays_occluded(rays, q->pool, alpha, q->segments, RAYS, q->bits[which]);
    bd_rays_nearest(rays, q->pool, alpha, q->rays, RAYS, q->hits[which]);
    for (int i = 0; i < RAYS / 32; i++) blocked += (uint32_t)__builtin_popcount(q->bits[which][i]);
    return blocked;
}

// To within rounding.
static bool is_on_edge(const struct bd_ray_hit *hit)
{
    return hit->triangle != BD_NO_TRIANGLE &&
           fminf(fminf(fabsf(hit->u), fabsf(hit->v)), fabsf(1 - hit->u - hit->v)) < 1e-6f;
}

static void compare(const struct questions *q, const char *where, int edges_max)
{
    int edges = 0;
    for (int i = 0; i < RAYS / 32; i++)
        if (q->bits[0][i] != q->bits[1][i])
            fail_msg("%s: segments %d to %d: %08x, anew %08x", where, 32 * i, 32 * i + 31,
                     q->bits[0][i], q->bits[1][i]);
    for (int i = 0; i < RAYS; i++) {
        const struct bd_ray_hit *a = &q->hits[0][i], *b = &q->hits[1][i];
        if (memcmp(a, b, sizeof *a) == 0) continue;
        if (edges++ < edges_max && (is_on_edge(a) || is_on_edge(b))) continue;
        fail_msg("%s: ray %d: %u at %.9g (%.9g, %.9g), anew %u at %.9g (%.9g, %.9g)", where, i,
                 a->triangle, a->distance, a->u, a->v, b->triangle, b->distance, b->u, b->v);
    }
}

static struct bd_rays *create_rays(struct bd_scene *scene, const struct bd_rays *earlier,
                                   uint64_t repeated_max)
{
    const struct bd_rays_build build = {.thread_count = 2, .repeated_max = repeated_max};
    struct bd_rays *rays = NULL;
    struct bd_err_detail detail = {0};
    if (earlier ? bd_rays_follow(earlier, scene, &build, &rays, &detail)
                : bd_rays_create(scene, &build, &rays, &detail))
        fail_msg("%s", detail.message);
    return rays;
}

// --- tests ------------------------------------------------------------------------------------

static struct bd_rays *begin_rays(const struct world *world, uint64_t repeated_max)
{
    struct stage *stage = create_stage(world);
    struct bd_rays *rays = create_rays(stage->scene, NULL, repeated_max);
    stage_destroy(&stage);
    return rays;
}

// Of the world as it is now, following `*rays` and in its place: asked beside one that is built
// anew. Whether it was built on what was there.
static bool follow_and_compare(const struct world *world, uint64_t repeated_max,
                               struct questions *q, struct bd_rays **rays, const char *edit)
{
    char where[80];
    struct stage *stage = create_stage(world);
    struct bd_rays *next = create_rays(stage->scene, *rays, repeated_max);
    struct bd_rays *anew = create_rays(stage->scene, NULL, repeated_max);
    const bool shares = bd_rays_share(*rays, next);
    bd_rays_destroy(rays);
    ask_anything(q, stage->scene, world->is_lattice);
    const uint32_t blocked = answer(q, 0, next);
    answer(q, 1, anew);
    snprintf(where, sizeof where, "size %g at %g, %s", world->size, world->offset, edit);
    compare(q, where, world->is_lattice ? RAYS / 5000 : 0);
    if (blocked < RAYS / 50 || blocked > RAYS * 49 / 50)
        fail_msg("%s: %u are blocked", where, blocked);
    bd_rays_destroy(&anew);
    stage_destroy(&stage);
    *rays = next;
    return shares;
}

static void what_follows_answers_as_what_is_built_anew(void **state_of_group)
{
    static const double places[][2] = {{1, 0}, {1e-4, 0}, {1e6, 0}, {1, 1e6}, {1e3, -1e9}};
    static const char *const names[EDIT_COUNT] = {"moved",    "stretched",  "mirrored",
                                                  "removed",  "added",      "doubled",
                                                  "vertices", "alpha mode", "nothing"};
    for (size_t p = 0; p < sizeof places / sizeof *places; p++) {
        const uint64_t repeated_max = p % 2 ? BD_RAYS_REPEATED_MAX : 0;
        uint32_t shared = 0;
        struct world world;
        begin_world(&world, places[p][0], places[p][1]);
        struct bd_rays *rays = begin_rays(&world, repeated_max);
        for (enum edit what = 0; what < EDIT_COUNT; what++) {
            edit(&world, what);
            shared += follow_and_compare(&world, repeated_max, *state_of_group, &rays, names[what]);
        }
        bd_rays_destroy(&rays);
        if (shared < EDIT_COUNT / 2) fail_msg("%u of %d shared", shared, EDIT_COUNT);
    }
}

// One object that is most of the world, and so large that its part is built in a hurry.
static void what_moves_again_is_beside_what_stays(void **state_of_group)
{
    struct world world;
    begin_world(&world, 1, 0);
    world.fineness = 60;
    world.object_count = 1;
    world.objects[0] = (struct object){5, 0, somewhere(0.6, 1)};
    struct bd_rays *rays = begin_rays(&world, 0);
    for (int move = 0; move < 3; move++) {
        world.objects[0].matrix = somewhere(0.6, 1);
        const bool shares = follow_and_compare(&world, 0, *state_of_group, &rays, "moved again");
        assert_int_equal(shares, move > 0);
    }
    bd_rays_destroy(&rays);
}

// A large object moves once, then a small one all the time: the large one is not built again each
// time for ever.
static void what_has_come_to_rest_goes_back_to_what_stays(void **state_of_group)
{
    struct world world;
    begin_world(&world, 1, 0);
    world.object_count = 2;
    world.objects[0] = (struct object){5, 0, somewhere(0.2, 1)};
    world.objects[1] = (struct object){0, 0, somewhere(0.2, 1)};
    struct bd_rays *rays = begin_rays(&world, 0);
    uint32_t anew = 0;
    for (int move = 0; move < 12; move++) {
        world.objects[move > 0].matrix = somewhere(0.2, 1);
        anew += !follow_and_compare(&world, 0, *state_of_group, &rays, "moved beside");
    }
    bd_rays_destroy(&rays);
    if (anew < 1 || anew > 2) fail_msg("%u times anew", anew);
}

// Rays through edges and corners, along faces, and among triangles that lie on one another.
static void what_lies_on_a_lattice_is_met_alike(void **state_of_group)
{
    static const double steps[3] = {0, 0.25, -0.5};
    struct world world;
    begin_world(&world, 1, 0);
    world.is_lattice = true;
    struct bd_rays *rays = NULL;
    for (int move = -1; move < 12; move++) {
        for (uint32_t o = 0; o < world.object_count; o++) {
            double *m = world.objects[o].matrix.m;
            if (move >= 0 && o != pick(30) && o > 2) continue;
            memset(m, 0, sizeof world.objects[o].matrix.m);
            for (int c = 0; c < 4; c++) m[5 * c] = c < 3 ? 0.5 : 1;
            for (int c = 0; c < 3; c++) m[12 + c] = steps[pick(3)];
        }
        if (move < 0)
            rays = begin_rays(&world, 0);
        else
            follow_and_compare(&world, 0, *state_of_group, &rays, "on a lattice");
    }
    bd_rays_destroy(&rays);
}

// Where the world ends elsewhere, render space is another.
static void what_has_another_render_space_shares_nothing(void **state_of_group)
{
    struct world world;
    begin_world(&world, 1, 0);
    struct bd_rays *rays = begin_rays(&world, 0);
    world.objects[0].matrix = somewhere(3, 1);
    assert_false(follow_and_compare(&world, 0, *state_of_group, &rays, "grown"));
    bd_rays_destroy(&rays);
}

// --- threads ----------------------------------------------------------------------------------

struct tracer {
    struct questions *questions;
    const struct bd_rays *rays;
    _Atomic bool stops;
};

static void *trace(void *user)
{
    struct tracer *tracer = user;
    do answer(tracer->questions, 1, tracer->rays);
    while (!atomic_load(&tracer->stops));
    return NULL;
}

static void what_is_followed_may_be_traced(void **state_of_group)
{
    struct world world;
    begin_world(&world, 1, 0);
    struct tracer tracer = {.questions = *state_of_group};
    struct bd_rays *first = begin_rays(&world, 0), *rays = begin_rays(&world, 0);
    struct stage *first_stage = create_stage(&world);
    tracer.rays = first;
    ask_anything(tracer.questions, first_stage->scene, false);
    answer(tracer.questions, 0, first);
    stage_destroy(&first_stage);
    pthread_t thread;
    assert_int_equal(pthread_create(&thread, NULL, trace, &tracer), 0);
    for (int i = 0; i < 20; i++) {
        edit(&world, (enum edit)(i % EDIT_COUNT));
        struct stage *stage = create_stage(&world);
        struct bd_rays *next = create_rays(stage->scene, i % 2 ? rays : first, 0);
        bd_rays_destroy(&rays);
        stage_destroy(&stage);
        rays = next;
    }
    atomic_store(&tracer.stops, true);
    pthread_join(thread, NULL);
    compare(tracer.questions, "traced meanwhile", 0);
    bd_rays_destroy(&first);
    bd_rays_destroy(&rays);
}

static int begin_group(void **state_of_group)
{
    struct questions *q = *state_of_group = calloc(1, sizeof *q);
    q->pool = bd_pool_create(2);
    return 0;
}

static int end_group(void **state_of_group)
{
    struct questions *q = *state_of_group;
    bd_pool_destroy(&q->pool);
    free(q);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_follows_answers_as_what_is_built_anew),
        cmocka_unit_test(what_moves_again_is_beside_what_stays),
        cmocka_unit_test(what_has_come_to_rest_goes_back_to_what_stays),
        cmocka_unit_test(what_lies_on_a_lattice_is_met_alike),
        cmocka_unit_test(what_has_another_render_space_shares_nothing),
        cmocka_unit_test(what_is_followed_may_be_traced),
    };
    return cmocka_run_group_tests(tests, begin_group, end_group);
}
