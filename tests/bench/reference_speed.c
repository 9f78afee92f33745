// reference_speed SCENE.glb WxH CAMERA SAMPLES [THREADS]
//
// What the path tracer costs beside Embree alone: renders, records each ray that the render asks
// Embree about, then asks Embree about the same rays again, in the same order, on as many threads,
// and does nothing with the answers. Rendering and asking take turns, five times; prints the
// medians, the extremes and the ratio of the medians as one line of JSON. Times are the process's
// on all its threads together, which neighbours on the machine disturb less than the clock's.
//
// The linker puts __wrap_rtcIntersect1 and __wrap_rtcOccluded1 in the place of Embree's functions
// (--wrap), so that the tracer itself knows nothing of this.

#include <embree3/rtcore.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/assert.h"
#include "base/pool.h"
#include "reference/reference.h"
#include "tests/tools/load_scene.h"

#define TURNS 5

// --- the record ---------------------------------------------------------------------------------

struct recorded {
    struct RTCRay ray;
    bool occlusion;
};

// Rays of one row of the picture.
struct record {
    struct recorded *rays;
    size_t count, capacity;
};

static _Thread_local struct record *recording; // NULL: nothing is recorded
static RTCScene embree_scene;

static void record(RTCScene scene, const struct RTCRay *ray, bool occlusion)
{
    struct record *to = recording;
    if (to->count == to->capacity) {
        to->capacity = to->capacity ? 2 * to->capacity : 4096;
        to->rays = realloc(to->rays, to->capacity * sizeof *to->rays);
        BD_ASSERT(to->rays);
    }
    to->rays[to->count++] = (struct recorded){*ray, occlusion};
    embree_scene = scene;
}

void __real_rtcIntersect1(RTCScene scene, struct RTCIntersectContext *context,
                          struct RTCRayHit *query);
void __real_rtcOccluded1(RTCScene scene, struct RTCIntersectContext *context, struct RTCRay *query);
void __wrap_rtcIntersect1(RTCScene scene, struct RTCIntersectContext *context,
                          struct RTCRayHit *query);
void __wrap_rtcOccluded1(RTCScene scene, struct RTCIntersectContext *context, struct RTCRay *query);

void __wrap_rtcIntersect1(RTCScene scene, struct RTCIntersectContext *context,
                          struct RTCRayHit *query)
{
    if (recording) record(scene, &query->ray, false);
    __real_rtcIntersect1(scene, context, query);
}

void __wrap_rtcOccluded1(RTCScene scene, struct RTCIntersectContext *context, struct RTCRay *query)
{
    if (recording) record(scene, query, true);
    __real_rtcOccluded1(scene, context, query);
}

// --- the two kinds of work ----------------------------------------------------------------------

struct work {
    struct bd_pool *pool;
    const struct bd_reference *reference;
    struct bd_reference_view view;
    uint32_t samples;
    struct record *records; // a row each; NULL: do not record
};

static void trace_row(void *user, uint32_t row)
{
    struct work *work = user;
    if (work->records) recording = &work->records[row];
    for (uint32_t x = 0; x < work->view.width_px; x++) {
        struct bd_reference_pixel pixel = {0};
        bd_reference_trace(work->reference, &bd_integrand_full, &work->view, 0, x, row, 0,
                           work->samples, &pixel);
    }
    recording = NULL;
}

static void ask_row(void *user, uint32_t row)
{
    struct work *work = user;
    const struct record *from = &work->records[row];
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    for (size_t i = 0; i < from->count; i++) {
        struct RTCRayHit query = {.ray = from->rays[i].ray};
        query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        if (from->rays[i].occlusion)
            __real_rtcOccluded1(embree_scene, &context, &query.ray);
        else
            __real_rtcIntersect1(embree_scene, &context, &query);
    }
}

static double cpu_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return 1e3 * (double)now.tv_sec + 1e-6 * (double)now.tv_nsec;
}

static double run_ms(struct work *work, void (*row)(void *user, uint32_t row))
{
    double start = cpu_ms();
    enum bd_err err = bd_pool_run(work->pool, work->view.height_px, row, NULL, work);
    BD_ASSERT_CMP(err, ==, BD_ERR_OK);
    return cpu_ms() - start;
}

// --- turns --------------------------------------------------------------------------------------

static int compare(const void *a, const void *b)
{
    double left = *(const double *)a, right = *(const double *)b;
    return (left > right) - (left < right);
}

static void print_times(const char *name, double times[TURNS])
{
    qsort(times, TURNS, sizeof *times, compare);
    printf("\"%s\": {\"median\": %.1f, \"min\": %.1f, \"max\": %.1f}, ", name, times[TURNS / 2],
           times[0], times[TURNS - 1]);
}

static void measure(struct work *work, const char *scene)
{
    uint32_t rows = work->view.height_px;
    struct record *records = calloc(rows, sizeof *records);
    BD_ASSERT(records);
    work->records = records;
    run_ms(work, trace_row);
    double traced[TURNS], asked[TURNS];
    for (int t = 0; t < TURNS; t++) {
        work->records = NULL;
        traced[t] = run_ms(work, trace_row);
        work->records = records;
        asked[t] = run_ms(work, ask_row);
    }
    size_t rays = 0;
    for (uint32_t r = 0; r < rows; r++) {
        rays += records[r].count;
        free(records[r].rays);
    }
    free(records);
    printf("{\"scene\": \"%s\", \"size\": [%u, %u], \"samples\": %u, \"threads\": %u, "
           "\"rays\": %zu, ",
           scene, work->view.width_px, rows, 2 * work->samples, bd_pool_thread_count(work->pool),
           rays);
    print_times("reference_cpu_ms", traced);
    print_times("embree_cpu_ms", asked);
    printf("\"ratio\": %.3f}\n", traced[TURNS / 2] / asked[TURNS / 2]);
}

static const char *name_of(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

int main(int argc, char **argv)
{
    struct work work = {0};
    if (argc < 5 || sscanf(argv[2], "%ux%u", &work.view.width_px, &work.view.height_px) != 2) {
        fprintf(stderr, "usage: reference_speed SCENE WxH CAMERA SAMPLES [THREADS]\n");
        return 2;
    }
    work.samples = (uint32_t)atoi(argv[4]);
    struct bd_scene *scene = NULL;
    struct bd_reference *reference = NULL;
    struct bd_err_detail detail = {0};
    enum bd_err err = load_scene(argv[1], &scene, &detail);
    if (!err) err = bd_reference_create(scene, 0, NULL, NULL, &reference, &detail);
    if (!err) {
        int32_t camera = bd_scene_find_camera(scene, argv[3]);
        BD_ASSERT_CMP(camera, >=, 0);
        work.view.camera = (uint32_t)camera;
        work.reference = reference;
        work.pool = bd_pool_create(argc > 5 ? (uint32_t)atoi(argv[5]) : 0);
        measure(&work, name_of(argv[1]));
        bd_pool_destroy(&work.pool);
    }
    bd_reference_destroy(&reference);
    bd_scene_release(&scene);
    if (err) fprintf(stderr, "reference_speed: %s: %s\n", detail.field, detail.message);
    return bd_err_exit_code(err);
}
