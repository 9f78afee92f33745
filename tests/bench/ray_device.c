// How fast the device answers which segments are blocked and what rays meet first, beside the
// processor with the same ones, coherent (from one point in all directions) and incoherent (between
// points of the scene at random), and how many of them the two answer otherwise.
//
// usage: ray_device SCENE.glb [MILLIONS [TURNS]]; one line of JSON. 77: the scene is the
// processor's.

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/rays/both.h"
#include "tests/tools/load_scene.h"

#define TURNS_MAX 101

static const char *const executor_names[] = {"processor", "device"};

static double median(double *values, int turns)
{
    for (int i = 1; i < turns; i++)
        for (int k = i; k > 0 && values[k] < values[k - 1]; k--) {
            const double swap = values[k];
            values[k] = values[k - 1], values[k - 1] = swap;
        }
    return values[turns / 2];
}

// From a point in all directions, row by row, as far as the scene is wide.
static void look_round(struct bd_segment *segments, size_t count)
{
    const uint32_t width = (uint32_t)sqrt((double)count);
    for (size_t i = 0; i < count; i++) {
        const double z = 1 - 2 * ((double)(i / width) + 0.5) / (double)width;
        const double angle = 2 * 3.14159265358979 * ((double)(i % width) + 0.5) / width;
        const double across = sqrt(fmax(1 - z * z, 0));
        const float from[3] = {0.01f, 0.02f, 0.03f};
        segments[i] = (struct bd_segment){{from[0], from[1], from[2]},
                                          BD_NO_TRIANGLE,
                                          {from[0] + 0.3f * (float)(across * cos(angle)),
                                           from[1] + 0.3f * (float)(across * sin(angle)),
                                           from[2] + 0.3f * (float)z},
                                          BD_NO_TRIANGLE};
    }
}

static void measure(struct both *both, const char *what, const struct bd_segment *segments,
                    size_t count, int turns)
{
    uint32_t *bits[EXECUTOR_COUNT];
    printf(", \"%s\": {", what);
    size_t blocked = 0;
    for (enum executor e = 0; e < EXECUTOR_COUNT; e++) {
        double ms[TURNS_MAX];
        struct bd_ray_counts traced;
        bits[e] = calloc(count / 32 + 1, sizeof *bits[e]);
        // Compiles.
        both_ask(both, e, BD_RAYS_ALPHA_MASK, segments, count < 1024 ? count : 1024, bits[e]);
        for (int turn = 0; turn < turns; turn++) {
            traced = both_ask(both, e, BD_RAYS_ALPHA_MASK, segments, count, bits[e]);
            ms[turn] = traced.ms;
        }
        printf("\"%s_mrays_per_s\": %.2f, ", executor_names[e],
               1e-3 * (double)traced.count / median(ms, turns));
    }
    for (size_t i = 0; i <= count / 32; i++) blocked += (size_t)__builtin_popcount(bits[0][i]);
    const struct differences d = both_compare(both, segments, count, bits[0], bits[1]);
    printf("\"blocked\": %.3f, \"differ\": %zu, \"unexplained\": %zu}",
           (double)blocked / (double)count, d.count, d.unexplained);
    if (d.unexplained) {
        const struct bd_segment *s = &segments[d.first_unexplained];
        fprintf(stderr, "unexplained: %a %a %a to %a %a %a\n", (double)s->from[0],
                (double)s->from[1], (double)s->from[2], (double)s->to[0], (double)s->to[1],
                (double)s->to[2]);
    }
    for (int e = 0; e < EXECUTOR_COUNT; e++) free(bits[e]);
}

// From the same point, to no end.
static void rays_of(const struct bd_segment *segments, struct bd_ray *rays, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        rays[i] = (struct bd_ray){.from_triangle = segments[i].from_triangle, .far = INFINITY};
        memcpy(rays[i].origin, segments[i].from, sizeof rays[i].origin);
        for (int c = 0; c < 3; c++) rays[i].direction[c] = segments[i].to[c] - segments[i].from[c];
    }
}

static void measure_nearest(struct both *both, const char *what, const struct bd_ray *rays,
                            size_t count, int turns)
{
    struct bd_ray_hit *hits[EXECUTOR_COUNT];
    printf(", \"nearest_%s\": {", what);
    size_t met = 0;
    for (enum executor e = 0; e < EXECUTOR_COUNT; e++) {
        double ms[TURNS_MAX];
        hits[e] = calloc(count, sizeof *hits[e]);
        both_meet(both, e, BD_RAYS_ALPHA_MASK, rays, count < 1024 ? count : 1024, hits[e]);
        for (int turn = 0; turn < turns; turn++)
            ms[turn] = both_meet(both, e, BD_RAYS_ALPHA_MASK, rays, count, hits[e]).ms;
        printf("\"%s_mrays_per_s\": %.2f, ", executor_names[e],
               1e-3 * (double)count / median(ms, turns));
    }
    for (size_t i = 0; i < count; i++) met += hits[PROCESSOR][i].triangle != BD_NO_TRIANGLE;
    const struct differences d =
        both_compare_hits(both, rays, count, hits[PROCESSOR], hits[DEVICE]);
    printf("\"met\": %.3f, \"differ\": %zu, \"unexplained\": %zu}", (double)met / (double)count,
           d.count, d.unexplained);
    for (int e = 0; e < EXECUTOR_COUNT; e++) free(hits[e]);
}

int main(int argc, char **argv)
{
    if (argc < 2) {
        fprintf(stderr, "usage: ray_device SCENE.glb [MILLIONS [TURNS]]\n");
        return 2;
    }
    const size_t count = (size_t)(1e6 * (argc > 2 ? atof(argv[2]) : 1));
    int turns = argc > 3 ? atoi(argv[3]) : 5;
    turns = turns < 1 ? 1 : turns < TURNS_MAX ? turns : TURNS_MAX;
    struct both both;
    struct bd_scene *scene = NULL;
    struct bd_err_detail detail = {0};
    both_open(&both);
    enum bd_err err = load_scene(argv[1], &scene, &detail);
    if (!err) err = both_take(&both, scene, &detail);
    if (err) fprintf(stderr, "ray_device: %s: %s\n", detail.field, detail.message);
    if (err) return err == BD_ERR_UNSUPPORTED ? 77 : bd_err_exit_code(err);
    const char *slash = strrchr(argv[1], '/');
    printf("{\"scene\": \"%s\", \"device\": \"%s\", \"triangles\": %u, \"nodes\": %u",
           slash ? slash + 1 : argv[1], bd_gpu_caps(both.context.gpu)->device_class,
           both.nodes->triangle_count, both.nodes->node_count);
    printf(", \"mib\": %.1f, \"build_ms\": %.1f, \"processor_build_ms\": %.1f",
           (double)bd_occluders_bytes(both.occluders[DEVICE]) / (1 << 20), both.built_ms[DEVICE],
           both.built_ms[PROCESSOR]);
    struct bd_segment *segments = calloc(count, sizeof *segments);
    struct bd_ray *rays = calloc(count, sizeof *rays);
    look_round(segments, count);
    measure(&both, "coherent", segments, count, turns);
    rays_of(segments, rays, count);
    measure_nearest(&both, "coherent", rays, count, turns);
    both_choose(&both, segments, count);
    measure(&both, "incoherent", segments, count, turns);
    both_choose_rays(&both, rays, count);
    measure_nearest(&both, "incoherent", rays, count, turns);
    printf("}\n");
    free(segments);
    free(rays);
    bd_scene_release(&scene);
    both_close(&both);
    return 0;
}
