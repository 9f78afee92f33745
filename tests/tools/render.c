// render SCENE.glb OUT.(exr|png|jpg) TECHNIQUE WxH CAMERA [KEY=VALUE]...
//
// One frame through import, scheduler and encoder, without daemon and sockets; prints the passes.
// `aa` among the settings is the request's, not the technique's. Every layer goes into an EXR.

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "image/encode.h"
#include "scene/import/import.h"
#include "sched/sched.h"
#include "tests/tools/load_scene.h"

static void print_report(const struct bd_report *r)
{
    printf("%s %s: total %.1f ms, gpu %.1f, load %.1f, compile %.1f, readback %.1f, %.0f MiB\n",
           r->technique, r->camera, r->time_ms.total, r->time_ms.gpu, r->time_ms.load,
           r->time_ms.compile, r->time_ms.readback, r->memory_gpu_peak_mib);
    for (uint32_t p = 0; p < r->pass_count; p++)
        printf("  %-12s %8.2f ms  %s\n", r->passes[p].name, r->passes[p].ms,
               bd_pass_state_name(r->passes[p].state));
    for (uint32_t o = 0; o < r->omitted_count; o++)
        printf("  left out %-12s %s\n", r->omitted[o].pass, r->omitted[o].reason);
    for (uint32_t f = 0; f < r->flag_count; f++) printf("  flag %s\n", r->flags[f]);
}

static enum bd_err write_picture(const char *path, const struct bd_job_result *result,
                                 struct bd_err_detail *detail)
{
    struct bd_encode_request request = bd_encode_request_default;
    const char *dot = strrchr(path, '.');
    if (!dot || !bd_encode_format_from_name(dot + 1, &request.format))
        return bd_err_set(detail, BD_ERR_USAGE, path, "must end in .exr, .png or .jpg");
    struct bd_named_layer layers[BD_LAYER_COUNT];
    size_t count = 0;
    for (int l = 0; l < BD_LAYER_COUNT; l++)
        if (result->layers[l])
            layers[count++] =
                (struct bd_named_layer){bd_layer_name((enum bd_layer)l), result->layers[l]};
    struct bd_encoded encoded;
    const struct bd_manifest manifest = {0};
    enum bd_err err = bd_encode(&request, layers, count, &manifest, &encoded, detail);
    if (err) return err;
    FILE *file = fopen(path, "wb");
    if (!file || fwrite(encoded.bytes.data, 1, encoded.bytes.size_bytes, file) != encoded.bytes.size_bytes)
        err = bd_err_set(detail, BD_ERR_IO, path, "cannot be written");
    if (file) fclose(file);
    bd_bytes_finish(&encoded.bytes);
    return err;
}

static enum bd_err read_arguments(int argc, char **argv, struct bd_frame_request *request,
                                  struct bd_err_detail *detail)
{
    snprintf(request->technique, sizeof request->technique, "%s", argv[3]);
    snprintf(request->camera, sizeof request->camera, "%s", argv[5]);
    bool traced = bd_frame_request_is_traced(request);
    request->layers = (1u << (traced ? BD_LAYER_COUNT : BD_LAYER_RENDERED_COUNT)) - 1;
    if (traced) request->layers &= ~BD_LAYERS_DOUBT;
    if (sscanf(argv[4], "%ux%u", &request->width_px, &request->height_px) != 2)
        return bd_err_set(detail, BD_ERR_USAGE, "size", "%s: must be WxH", argv[4]);
    for (int i = 6; i < argc; i++) {
        if (sscanf(argv[i], "aa=%u", &request->aa) == 1) continue;
        enum bd_err err = bd_param_list_add(&request->params, argv[i], detail);
        if (err) return err;
    }
    return BD_ERR_OK;
}

static enum bd_err run(struct bd_sched *sched, const struct bd_job_request *request,
                       const char *path, struct bd_err_detail *detail)
{
    struct bd_job *job;
    enum bd_err err = bd_sched_submit(sched, request, &job, detail);
    if (err) return err;
    bd_job_wait(job);
    const struct bd_job_result *result = bd_job_result(job);
    err = result->err;
    print_report(&result->report);
    if (err)
        *detail = result->detail;
    else
        err = write_picture(path, result, detail);
    bd_job_release(&job);
    return err;
}

int main(int argc, char **argv)
{
    if (argc < 6) {
        fprintf(stderr, "usage: render SCENE OUT TECHNIQUE WxH CAMERA [KEY=VALUE]...\n");
        return 2;
    }
    struct bd_err_detail detail = {0};
    const struct bd_sched_options options = {
        .device = "auto",
        .queue_length_max = 4,
        .frame_limits = {.side_px_max = 16384, .pixel_count_max = UINT64_C(1) << 28},
    };
    struct bd_job_request request = {.frame = bd_frame_request_default};
    struct bd_sched *sched = NULL;
    enum bd_err err = import_scene(argv[1], &request.scene, &detail);
    if (!err) err = read_arguments(argc, argv, &request.frame, &detail);
    if (!err) err = bd_sched_create(&options, &sched, &detail);
    if (!err) err = run(sched, &request, argv[2], &detail);
    bd_sched_destroy(&sched);
    bd_scene_release(&request.scene);
    if (err) fprintf(stderr, "render: %s: %s\n", detail.field, detail.message);
    return bd_err_exit_code(err);
}
