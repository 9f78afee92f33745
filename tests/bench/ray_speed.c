// How fast rays/ answers, beside Embree alone with the same rays: both questions, coherent rays
// (neighbours of a picture) and incoherent ones (between points of the scene at random), and how
// long its structure takes to build. Processor time of the process.
//
// usage: ray_speed SCENE.glb [MILLIONS [THREADS]]; one line of JSON.

#include <embree3/rtcore.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/assert.h"
#include "rays/rays.h"
#include "scene/model/render_space.h"
#include "scene/model/triangle_order.h"
#include "tests/tools/load_scene.h"

#define TURNS 5

static double ms_of(clockid_t clock)
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

struct work {
    struct bd_scene *scene;
    struct bd_rays *rays;
    struct bd_pool *pool;
    RTCScene embree; // all triangles in render space, as one geometry
    size_t count;
    struct bd_ray *queries;
    struct bd_segment *segments;
    struct bd_ray_hit *hits;
    uint32_t *bits;
};

// --- Embree alone -----------------------------------------------------------------------------

static void place(const struct work *work, const struct bd_triangle_order *order, float *to)
{
    const struct bd_render_space space = bd_render_space_of(work->scene);
    for (uint32_t r = 0; r < order->run_count; r++) {
        const struct bd_triangle_run *run = &order->runs[r];
        const struct bd_primitive *p = &work->scene->meshes[run->mesh]->primitives[run->primitive];
        for (uint32_t i = 0; i < run->instance_count; i++) {
            const uint32_t instance = order->instances[run->first_instance + i];
            const bd_dmat4 *m = &work->scene->instances[instance].world_from_mesh;
            for (uint32_t c = 0; c < p->index_count; c++, to += 3) {
                const float *at = p->position + 3 * (size_t)p->index[c];
                const bd_dvec3 placed = bd_render_from_world(
                    &space, bd_dmat4_point(m, (bd_dvec3){at[0], at[1], at[2]}));
                to[0] = (float)placed.x, to[1] = (float)placed.y, to[2] = (float)placed.z;
            }
        }
    }
}

static double build_embree(struct work *work)
{
    struct bd_triangle_order order;
    bd_triangle_order_init(&order, work->scene);
    RTCDevice device = rtcNewDevice(NULL);
    work->embree = rtcNewScene(device);
    rtcSetSceneFlags(work->embree, RTC_SCENE_FLAG_ROBUST);
    RTCGeometry triangles = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    float *positions = rtcSetNewGeometryBuffer(triangles, RTC_BUFFER_TYPE_VERTEX, 0,
                                               RTC_FORMAT_FLOAT3, 12, 3 * order.triangle_count);
    uint32_t *indices = rtcSetNewGeometryBuffer(triangles, RTC_BUFFER_TYPE_INDEX, 0,
                                                RTC_FORMAT_UINT3, 12, order.triangle_count);
    place(work, &order, positions);
    for (uint32_t i = 0; i < 3 * order.triangle_count; i++) indices[i] = i;
    bd_triangle_order_finish(&order);
    rtcCommitGeometry(triangles);
    rtcAttachGeometry(work->embree, triangles);
    const double start = ms_of(CLOCK_PROCESS_CPUTIME_ID);
    rtcCommitScene(work->embree);
    return ms_of(CLOCK_PROCESS_CPUTIME_ID) - start;
}

#define PIECE 1024u

static void embree_occluded(void *user, uint32_t piece)
{
    struct work *work = user;
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    for (size_t i = piece * PIECE; i < work->count && i < (piece + 1) * PIECE; i++) {
        const struct bd_segment *s = &work->segments[i];
        struct RTCRay ray = {.org_x = s->from[0],
                             .org_y = s->from[1],
                             .org_z = s->from[2],
                             .dir_x = s->to[0] - s->from[0],
                             .dir_y = s->to[1] - s->from[1],
                             .dir_z = s->to[2] - s->from[2],
                             .tnear = 1e-4f,
                             .tfar = 0.9999f,
                             .mask = UINT32_MAX};
        rtcOccluded1(work->embree, &context, &ray);
        work->bits[i / 32] = ray.tfar < 0;
    }
}

static void embree_nearest(void *user, uint32_t piece)
{
    struct work *work = user;
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    for (size_t i = piece * PIECE; i < work->count && i < (piece + 1) * PIECE; i++) {
        const struct bd_ray *q = &work->queries[i];
        struct RTCRayHit hit = {.ray = {.org_x = q->origin[0],
                                        .org_y = q->origin[1],
                                        .org_z = q->origin[2],
                                        .dir_x = q->direction[0],
                                        .dir_y = q->direction[1],
                                        .dir_z = q->direction[2],
                                        .tnear = 1e-4f,
                                        .tfar = INFINITY,
                                        .mask = UINT32_MAX},
                                .hit.geomID = RTC_INVALID_GEOMETRY_ID};
        rtcIntersect1(work->embree, &context, &hit);
        work->hits[i] = (struct bd_ray_hit){hit.hit.primID, hit.hit.u, hit.hit.v, hit.ray.tfar};
    }
}

// --- rays -------------------------------------------------------------------------------------

static double median(double *values)
{
    for (int i = 1; i < TURNS; i++)
        for (int k = i; k > 0 && values[k] < values[k - 1]; k--) {
            const double swap = values[k];
            values[k] = values[k - 1], values[k - 1] = swap;
        }
    return values[TURNS / 2];
}

// From one point of the scene in all directions, row by row.
static void make_coherent(struct work *work)
{
    const uint32_t width = (uint32_t)sqrt((double)work->count);
    for (size_t i = 0; i < work->count; i++) {
        const double z = 1 - 2 * ((double)(i / width) + 0.5) / (double)width;
        const double angle = 2 * 3.14159265358979 * ((double)(i % width) + 0.5) / width;
        const double across = sqrt(fmax(1 - z * z, 0));
        work->queries[i] = (struct bd_ray){
            .origin = {0.01f, 0.02f, 0.03f},
            .from_triangle = BD_NO_TRIANGLE,
            .direction = {(float)(across * cos(angle)), (float)(across * sin(angle)), (float)z},
            .far = INFINITY,
        };
    }
}

// From where those met something, to where others did; rays in a direction of the half space that
// they came from.
static void make_incoherent(struct work *work, const struct bd_ray_hit *hits)
{
    size_t met = 0;
    float(*points)[3] = malloc(work->count * sizeof *points);
    for (size_t i = 0; i < work->count; i++) {
        if (hits[i].triangle == BD_NO_TRIANGLE) continue;
        for (int c = 0; c < 3; c++)
            points[met][c] = work->queries[i].origin[c] +
                             0.999f * hits[i].distance * work->queries[i].direction[c];
        met++;
    }
    BD_ASSERT(met > 0);
    for (size_t i = 0; i < work->count; i++) {
        const float *from = points[(size_t)(chance() * (double)met)];
        const float *to = points[(size_t)(chance() * (double)met)];
        memcpy(work->segments[i].from, from, 12);
        memcpy(work->segments[i].to, to, 12);
        memcpy(work->queries[i].origin, from, 12);
        for (int c = 0; c < 3; c++)
            work->queries[i].direction[c] = (float)(chance() - 0.5) - 0.5f * from[c];
    }
    free(points);
}

static void ask(struct work *work, bool is_occluded, bool is_ours)
{
    const uint32_t pieces = (uint32_t)((work->count + PIECE - 1) / PIECE);
    if (is_ours && is_occluded)
        bd_rays_occluded(work->rays, work->pool, BD_RAYS_ALPHA_MASK, work->segments, work->count,
                         work->bits);
    else if (is_ours)
        bd_rays_nearest(work->rays, work->pool, BD_RAYS_ALPHA_MASK, work->queries, work->count,
                        work->hits);
    else if (bd_pool_run(work->pool, pieces, is_occluded ? embree_occluded : embree_nearest, NULL,
                         work))
        BD_ASSERT(!"nobody stops it");
}

static void measure(struct work *work, const char *what, bool is_occluded)
{
    double cpu_ms[2][TURNS], wall_ms[TURNS];
    for (int turn = 0; turn < TURNS; turn++)
        for (int ours = 0; ours < 2; ours++) {
            const double wall = ms_of(CLOCK_MONOTONIC), cpu = ms_of(CLOCK_PROCESS_CPUTIME_ID);
            ask(work, is_occluded, ours == 1);
            cpu_ms[ours][turn] = ms_of(CLOCK_PROCESS_CPUTIME_ID) - cpu;
            wall_ms[turn] = ms_of(CLOCK_MONOTONIC) - wall;
        }
    const double ours = median(cpu_ms[1]), theirs = median(cpu_ms[0]);
    const double millions = 1e-6 * (double)work->count;
    printf(", \"%s\": {\"mrays_per_s\": %.2f, \"mrays_per_cpu_s\": %.2f, "
           "\"embree_mrays_per_cpu_s\": %.2f, \"ratio\": %.3f}",
           what, millions / (1e-3 * median(wall_ms)), millions / (1e-3 * ours),
           millions / (1e-3 * theirs), theirs / ours);
}

int main(int argc, char **argv)
{
    if (argc < 2) {
        fprintf(stderr, "usage: ray_speed SCENE.glb [MILLIONS [THREADS]]\n");
        return 2;
    }
    struct work work = {.count = (size_t)(1e6 * (argc > 2 ? atof(argv[2]) : 1))};
    struct bd_err_detail detail = {0};
    enum bd_err err = load_scene(argv[1], &work.scene, &detail);
    const struct bd_rays_build build = {.thread_count = argc > 3 ? (uint32_t)atoi(argv[3]) : 0,
                                        .repeated_max = BD_RAYS_REPEATED_MAX};
    const double cpu = ms_of(CLOCK_PROCESS_CPUTIME_ID), wall = ms_of(CLOCK_MONOTONIC);
    if (!err) err = bd_rays_create(work.scene, &build, &work.rays, &detail);
    if (err) {
        fprintf(stderr, "ray_speed: %s: %s\n", detail.field, detail.message);
        return bd_err_exit_code(err);
    }
    const char *slash = strrchr(argv[1], '/');
    printf("{\"scene\": \"%s\", \"triangles\": %llu, \"build_cpu_ms\": %.1f, \"build_ms\": %.1f",
           slash ? slash + 1 : argv[1], (unsigned long long)work.scene->features.triangle_count,
           ms_of(CLOCK_PROCESS_CPUTIME_ID) - cpu, ms_of(CLOCK_MONOTONIC) - wall);
    printf(", \"embree_build_cpu_ms\": %.1f, \"mib\": %.1f", build_embree(&work),
           (double)bd_rays_bytes(work.rays) / (1 << 20));
    work.pool = bd_pool_create(build.thread_count);
    work.queries = calloc(work.count, sizeof *work.queries);
    work.segments = calloc(work.count, sizeof *work.segments);
    work.hits = calloc(work.count, sizeof *work.hits);
    work.bits = calloc(work.count / 32 + 1, sizeof *work.bits);
    for (size_t i = 0; i < work.count; i++)
        work.segments[i].from_triangle = work.segments[i].to_triangle =
            work.queries[i].from_triangle = BD_NO_TRIANGLE;
    make_coherent(&work);
    measure(&work, "nearest_coherent", false);
    for (size_t i = 0; i < work.count; i++)
        for (int c = 0; c < 3; c++) {
            work.segments[i].from[c] = work.queries[i].origin[c];
            work.segments[i].to[c] =
                work.queries[i].origin[c] + 0.3f * work.queries[i].direction[c];
        }
    measure(&work, "occluded_coherent", true);
    ask(&work, false, true);
    make_incoherent(&work, work.hits);
    measure(&work, "nearest_incoherent", false);
    measure(&work, "occluded_incoherent", true);
    printf("}\n");
    bd_rays_destroy(&work.rays);
    bd_scene_release(&work.scene);
    return 0;
}
