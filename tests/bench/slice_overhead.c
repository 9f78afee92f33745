// What slices cost a frame that nobody interrupts: the same frame in slices and in as few as can
// be, in turns, everything made anew. And the longest slice.
//
// usage: slice_overhead SCENE.glb RUNS

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "frame/frame.h"
#include "tests/tools/load_scene.h"

#define RUNS_MAX 101
#define WHOLE    1e12 // units, of a slice

struct frame_case {
    const char *technique, *setting;
    uint32_t side_px;
};

static const struct frame_case cases[] = {
    {"rsm", "vpls=1024", 512},
    {"multires_gather", "vpls=1024", 512},
    {"hisr", NULL, 512},
};

static double render_ms(struct bd_renderer *renderer, struct bd_scene *scene,
                        const struct bd_frame_request *request, double forced_units,
                        struct bd_slicer *seen)
{
    struct bd_image *layers[BD_LAYER_COUNT] = {0};
    static struct bd_report report;
    struct bd_err_detail detail = {0};
    memset(&report, 0, sizeof report);
    renderer->slicer.forced_units = forced_units;
    if (bd_frame_render(renderer, scene, request, NULL, NULL, layers, &report, &detail)) {
        fprintf(stderr, "%s\n", detail.message);
        exit(1);
    }
    for (int l = 0; l < BD_LAYER_COUNT; l++) bd_image_destroy(&layers[l]);
    *seen = renderer->slicer;
    return report.time_ms.total - report.time_ms.compile;
}

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *values, int count)
{
    qsort(values, (size_t)count, sizeof *values, by_size);
    return values[count / 2];
}

static void measure(struct bd_renderer *renderer, struct bd_scene *scene,
                    const struct frame_case *c, int runs)
{
    struct bd_frame_request request = bd_frame_request_default;
    struct bd_err_detail detail;
    snprintf(request.technique, sizeof request.technique, "%s", c->technique);
    request.width_px = request.height_px = c->side_px;
    request.fresh = BD_FRESH_ALL;
    if (c->setting && bd_param_list_add(&request.params, c->setting, &detail)) exit(1);
    double cut[RUNS_MAX], whole[RUNS_MAX], ratios[RUNS_MAX], longest[RUNS_MAX];
    uint32_t slices = 0, few = 0;
    const char *kind = "";
    struct bd_slicer seen;
    for (int run = -2; run < runs; run++) { // two to compile and to learn
        int at = run < 0 ? 0 : run;
        cut[at] = render_ms(renderer, scene, &request, 0, &seen);
        slices = seen.slice_count, longest[at] = seen.longest_ms, kind = seen.longest_kind;
        whole[at] = render_ms(renderer, scene, &request, WHOLE, &seen);
        few = seen.slice_count;
        ratios[at] = cut[at] / whole[at];
    }
    printf("{\"technique\": \"%s\", \"side_px\": %u, \"ms\": %.1f, \"whole_ms\": %.1f, "
           "\"ratio\": %.4f, \"slices\": %u, \"whole_slices\": %u, \"longest_ms\": %.1f, "
           "\"longest_of\": \"%s\"}\n",
           c->technique, c->side_px, median(cut, runs), median(whole, runs), median(ratios, runs),
           slices, few, median(longest, runs), kind);
    fflush(stdout);
}

int main(int argc, char **argv)
{
    int runs = argc == 3 ? atoi(argv[2]) : 0;
    if (runs < 1 || runs > RUNS_MAX) {
        fprintf(stderr, "usage: slice_overhead SCENE.glb RUNS (1 to %d)\n", RUNS_MAX);
        return 2;
    }
    const struct bd_gpu_options options = {.device = "auto"};
    struct bd_scene *scene = NULL;
    struct bd_gpu *gpu = NULL;
    struct bd_renderer renderer;
    struct bd_err_detail detail = {0};
    if (load_scene(argv[1], &scene, &detail) || bd_gpu_create(&options, &gpu, &detail)) {
        fprintf(stderr, "%s\n", detail.message);
        return 1;
    }
    bd_renderer_init(&renderer, gpu, UINT64_C(1) << 30);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
        measure(&renderer, scene, &cases[i], runs);
    bd_renderer_finish(&renderer);
    bd_gpu_destroy(&gpu);
    bd_scene_release(&scene);
    return 0;
}
