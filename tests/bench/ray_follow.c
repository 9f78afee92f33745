// How long a structure of rays takes to build, and to follow an edit; and what a ray costs in what
// follows, beside one that is built anew. Scenes made here: a room of a hundred balls, one moved; a
// sheet whose vertices are streamed; many instances of one mesh, one moved.
//
// usage: ray_follow TRIANGLES... ; one line of JSON.

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/assert.h"
#include "rays/rays.h"

#define BALLS 100
#define TURNS 7
#define RAYS  300000
#define SHEET 317u // vertices a side: 100,489, and 199,712 triangles

static double now_ms(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return 1e3 * (double)t.tv_sec + 1e-6 * (double)t.tv_nsec;
}

static uint64_t state = 88172645463325252u;

static double chance(void)
{
    state ^= state << 13, state ^= state >> 7, state ^= state << 17;
    return (double)(state >> 11) * 0x1p-53;
}

// --- scenes -----------------------------------------------------------------------------------

// A point of a shape over [0, 1]^2, by `seed`.
typedef void (*shape_fn)(double u, double v, double seed, float at[3]);

static void ball(double u, double v, double seed, float at[3])
{
    const double across = 6.283185307 * u, down = 3.141592654 * v;
    const double radius = 1 + 0.1 * sin(9 * across + seed) * sin(7 * down);
    at[0] = (float)(radius * sin(down) * cos(across));
    at[1] = (float)(radius * cos(down));
    at[2] = (float)(radius * sin(down) * sin(across));
}

static void sheet(double u, double v, double seed, float at[3])
{
    at[0] = (float)(2 * u - 1), at[2] = (float)(2 * v - 1);
    at[1] = (float)(0.1 * sin(9 * u + seed) + 0.02 * sin(40 * v + 2 * seed));
}

static struct bd_mesh *create_mesh(shape_fn shape, uint32_t side, double seed)
{
    struct bd_mesh *mesh = calloc(1, sizeof *mesh);
    mesh->reference_count = mesh->primitive_count = 1;
    struct bd_primitive *p = mesh->primitives = calloc(1, sizeof *p);
    p->vertex_count = side * side;
    p->index_count = 6 * (side - 1) * (side - 1);
    p->position = calloc(3 * (size_t)p->vertex_count, sizeof(float));
    p->normal = calloc(3 * (size_t)p->vertex_count, sizeof(float));
    p->index = calloc(p->index_count, sizeof *p->index);
    for (uint32_t v = 0; v < p->vertex_count; v++) {
        shape((double)(v % side) / (side - 1), (double)(v / side) / (side - 1), seed,
              p->position + 3 * (size_t)v);
        p->normal[3 * (size_t)v + 1] = 1;
    }
    for (uint32_t q = 0, *to = p->index; q < (side - 1) * (side - 1); q++) {
        const uint32_t at = q / (side - 1) * side + q % (side - 1);
        const uint32_t corners[6] = {at, at + side, at + 1, at + 1, at + side, at + side + 1};
        memcpy(to, corners, sizeof corners);
        to += 6;
    }
    bd_mesh_seal(mesh);
    return mesh;
}

// Objects of a scene: each a mesh, borrowed, at a place.
struct object {
    struct bd_mesh *mesh;
    bd_dmat4 matrix;
};

static struct object object_at(struct bd_mesh *mesh, double scale)
{
    const double s[3] = {scale, scale, scale}, turn[4] = {0, chance(), 0, chance()};
    const double at[3] = {8 * chance() - 4, 8 * chance() - 4, 8 * chance() - 4};
    return (struct object){mesh, bd_dmat4_from_trs(at, turn, s)};
}

static struct bd_scene *create_scene(const struct object *objects, uint32_t count)
{
    struct bd_scene *scene = bd_scene_create();
    struct bd_err_detail detail = {0};
    scene->materials = calloc(1, sizeof *scene->materials);
    scene->material_count = 1;
    scene->materials[0].base_color_map.texture = scene->materials[0].normal_map.texture = BD_NONE;
    scene->materials[0].metallic_roughness_map.texture = BD_NONE;
    scene->materials[0].emissive_map.texture = BD_NONE;
    scene->materials[0].transmission_map.texture = BD_NONE;
    scene->meshes = calloc(count, sizeof *scene->meshes);
    scene->nodes = calloc(count, sizeof *scene->nodes);
    for (uint32_t o = 0; o < count; o++) {
        struct bd_node *node = &scene->nodes[scene->node_count++];
        uint32_t mesh = scene->mesh_count;
        if (o > 0 && objects[o].mesh == objects[o - 1].mesh)
            mesh--;
        else
            scene->meshes[scene->mesh_count++] = bd_mesh_retain(objects[o].mesh);
        *node = (struct bd_node){.parent = BD_NONE, .camera = BD_NONE, .light = BD_NONE};
        node->mesh = (int32_t)mesh;
        node->parent_from_node = objects[o].matrix;
    }
    if (bd_scene_finish(scene, &detail)) BD_ASSERT(!"a scene of meshes");
    return scene;
}

// --- measuring --------------------------------------------------------------------------------

static struct bd_rays *create_rays(struct bd_rays **earlier, struct bd_scene *scene, double *ms)
{
    const struct bd_rays_build build = {.repeated_max = BD_RAYS_REPEATED_MAX};
    struct bd_err_detail detail = {0};
    struct bd_rays *rays;
    const double begin = now_ms(CLOCK_MONOTONIC);
    enum bd_err err = earlier ? bd_rays_follow(*earlier, scene, &build, &rays, &detail)
                              : bd_rays_create(scene, &build, &rays, &detail);
    *ms = now_ms(CLOCK_MONOTONIC) - begin;
    if (err) fprintf(stderr, "ray_follow: %s\n", detail.message);
    BD_ASSERT(!err);
    return rays;
}

static int compare(const void *a, const void *b)
{
    const double left = *(const double *)a, right = *(const double *)b;
    return (left > right) - (left < right);
}

static double share_of(double *values, uint32_t count, double share)
{
    qsort(values, count, sizeof *values, compare);
    return values[(uint32_t)(share * (count - 1) + 0.5)];
}

// Processor time of segments between random points, us each.
static double trace_us(const struct bd_rays *rays, struct bd_pool *pool)
{
    struct bd_segment *segments = calloc(RAYS, sizeof *segments);
    uint32_t *bits = calloc(RAYS / 32 + 1, sizeof *bits);
    const uint64_t saved = state;
    for (uint32_t i = 0; i < RAYS; i++) {
        for (int c = 0; c < 3; c++) {
            segments[i].from[c] = (float)(0.5 * chance() - 0.25);
            segments[i].to[c] = (float)(0.5 * chance() - 0.25);
        }
        segments[i].from_triangle = segments[i].to_triangle = 7;
    }
    state = saved;
    double us[5];
    for (int turn = 0; turn < 5; turn++) {
        const double begin = now_ms(CLOCK_PROCESS_CPUTIME_ID);
        bd_rays_occluded(rays, pool, BD_RAYS_ALPHA_MASK, segments, RAYS, bits);
        us[turn] = 1e3 * (now_ms(CLOCK_PROCESS_CPUTIME_ID) - begin) / RAYS;
    }
    free(segments);
    free(bits);
    return share_of(us, 5, 0.5);
}

struct work {
    uint32_t count, changed; // objects, and which is edited
    struct object *objects;
    shape_fn streamed; // NULL: the object is moved
    uint32_t turns;
};

static void edit(struct work *work, uint32_t turn)
{
    struct object *object = &work->objects[work->changed];
    if (!work->streamed) {
        object->matrix.m[12] = 6 * chance() - 3;
        return;
    }
    bd_mesh_release(&object->mesh);
    object->mesh = create_mesh(work->streamed, SHEET, turn + 1);
}

static void measure(struct work *work, const char *what, bool is_first)
{
    struct bd_scene *scene = create_scene(work->objects, work->count);
    struct bd_pool *pool = bd_pool_create(0);
    double *follow_ms = calloc(work->turns, sizeof *follow_ms), build_ms, anew_ms, first_ms = 0;
    struct bd_rays *rays = create_rays(NULL, scene, &build_ms);
    for (uint32_t turn = 0; turn < work->turns; turn++) {
        edit(work, turn);
        bd_scene_release(&scene);
        scene = create_scene(work->objects, work->count);
        struct bd_rays *next = create_rays(&rays, scene, &follow_ms[turn]);
        bd_rays_destroy(&rays);
        rays = next;
        if (turn == 0) first_ms = follow_ms[0];
    }
    struct bd_rays *anew = create_rays(NULL, scene, &anew_ms);
    const double us = trace_us(rays, pool), anew_us = trace_us(anew, pool);
    printf("%s{\"what\": \"%s\", \"triangles\": %llu, \"instances\": %u, \"build_ms\": %.1f, "
           "\"follow_first_ms\": %.2f, \"follow_p50_ms\": %.2f, \"follow_p95_ms\": %.2f, "
           "\"ray_us\": %.3f, \"anew_ray_us\": %.3f, \"cost\": %.2f, \"mib\": %.1f, "
           "\"anew_mib\": %.1f}",
           is_first ? "" : ", ", what, (unsigned long long)scene->features.triangle_count,
           work->count, fmin(build_ms, anew_ms), first_ms, share_of(follow_ms, work->turns, 0.5),
           share_of(follow_ms, work->turns, 0.95), us, anew_us, us / anew_us,
           (double)bd_rays_bytes(rays) / (1 << 20), (double)bd_rays_bytes(anew) / (1 << 20));
    fflush(stdout);
    bd_rays_destroy(&anew);
    bd_rays_destroy(&rays);
    bd_scene_release(&scene);
    bd_pool_destroy(&pool);
    free(follow_ms);
}

// --- what is measured -------------------------------------------------------------------------

static struct object corner(double at)
{
    static struct bd_mesh *mesh;
    static const double turn[4] = {0, 0, 0, 1}, s[3] = {0.1, 0.1, 0.1};
    const double place[3] = {at, at, at};
    if (!mesh) mesh = create_mesh(sheet, 2, 0);
    return (struct object){mesh, bd_dmat4_from_trs(place, turn, s)};
}

// Two corners hold the bounds, so that nothing that moves within them moves the middle.
static void end_objects(struct work *work)
{
    work->objects[work->count - 2] = corner(-6);
    work->objects[work->count - 1] = corner(6);
}

static void free_objects(struct work *work)
{
    for (uint32_t o = 0; o + 2 < work->count; o++)
        if (o == 0 || work->objects[o].mesh != work->objects[o - 1].mesh)
            bd_mesh_release(&work->objects[o].mesh);
    free(work->objects);
}

static void measure_balls(uint64_t triangles, bool has_sheet, bool is_first)
{
    const uint32_t side = 1 + (uint32_t)sqrt((double)triangles / 2 / BALLS);
    struct work work = {.count = BALLS + has_sheet + 2, .turns = TURNS};
    work.objects = calloc(work.count, sizeof *work.objects);
    for (uint32_t b = 0; b < BALLS; b++)
        work.objects[b] = object_at(create_mesh(ball, side, b), 0.3 + 0.4 * chance());
    if (has_sheet) {
        work.objects[BALLS] = object_at(create_mesh(sheet, SHEET, 0), 2);
        work.changed = BALLS;
        work.streamed = sheet;
        work.turns = 20;
    }
    end_objects(&work);
    measure(&work, has_sheet ? "100,489 vertices streamed" : "one ball of 100 moved", is_first);
    free_objects(&work);
}

static void measure_one(void)
{
    struct work work = {.count = 3, .turns = TURNS, .objects = calloc(3, sizeof(struct object))};
    work.objects[0] = object_at(create_mesh(ball, 708, 0), 2);
    end_objects(&work);
    measure(&work, "the only object moved", false);
    free_objects(&work);
}

static void measure_instances(uint32_t count)
{
    struct work work = {.count = count + 2, .turns = TURNS};
    struct bd_mesh *mesh = create_mesh(ball, 13, 0);
    work.objects = calloc(work.count, sizeof *work.objects);
    for (uint32_t o = 0; o < count; o++) work.objects[o] = object_at(mesh, 0.1);
    end_objects(&work);
    measure(&work, "one instance moved", false);
    free_objects(&work);
}

int main(int argc, char **argv)
{
    printf("[");
    for (int a = 1; a < argc; a++) measure_balls(strtoull(argv[a], NULL, 10), false, a == 1);
    measure_balls(1000, true, argc == 1);
    measure_balls(1000000, true, false);
    measure_one();
    measure_instances(10000);
    printf("]\n");
    return 0;
}
