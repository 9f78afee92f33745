// vpl_reference SCENE.glb OUT WxH CAMERA PIXELS SEED THREADS [KEY=VALUE]...
//
// The VPL reference (algorithms.md E9, rung R4): what technique `rsm` with these settings and
// brdf=lambert tends to in exact arithmetic. G-buffer, reflective shadow maps and VPLs are made by
// the passes themselves and read back; the sum over all of them is worked out here, in double
// precision (vpl_sum.h), at PIXELS of the picture's pixels (vpl_pixels.h), or at all that are lit.
//
// OUT gets one line of JSON, then a record of 64 bytes for each pixel (struct record), as numbers
// lie in this machine's memory. The line is printed, too. THREADS 0: as many as the machine has.

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/clock.h"
#include "frame/plan.h"
#include "pass/gather.h"
#include "base/pool.h"
#include "tests/tools/load_scene.h"
#include "vpl_pixels.h"
#include "vpl_sum.h"

#define RECEIVERS_PER_JOB 16
// VPLs a light of the rough picture by which pixels are chosen, and the side of their map: the same
// pixels, whatever the settings.
#define ROUGH_SIDE   32
#define ROUGH_MAP_PX 1024

struct record {
    uint32_t x, y;
    double probability;
    double irradiance_lx[3], radiance_cd_m2[3];
};
_Static_assert(sizeof(struct record) == 64, "no padding: others read it");

struct arguments {
    const char *scene, *out;
    uint32_t pixels, threads;
    uint64_t seed;
    struct bd_frame_request request;
};

// One picture. What the device made is kept on the host, rows from the top.
struct view {
    struct bd_pass_context context;
    struct bd_plan plan;
    struct bd_gpu_scene *scene;
    struct bd_viewpoint viewpoint;
    struct bd_gbuffer *gbuffer;
    struct vpl_set vpls;
    float (*irradiance)[4]; // rough
    float *depth, (*normals)[4];
    uint16_t (*albedo)[4], (*material)[4];
};

static struct bd_slicer slicer;

// --- from the device ----------------------------------------------------------------------------

static enum bd_err read_tex(struct bd_gpu *gpu, const struct bd_tex *tex, size_t texel_bytes,
                            void **out, struct bd_err_detail *detail)
{
    const struct bd_tex_desc *desc = bd_tex_desc(tex);
    size_t bytes = texel_bytes * desc->width_px * desc->height_px;
    struct bd_readback *pending;
    *out = malloc(bytes);
    BD_ASSERT(*out);
    enum bd_err err = bd_gpu_readback_start(gpu, tex, 0, &pending, detail);
    return err ? err : bd_gpu_readback_finish(gpu, &pending, *out, bytes);
}

static enum bd_err append_list(struct view *v, const struct bd_vpl_list *list)
{
    size_t vpl_bytes = bd_buf_size_bytes(list->vpls), quad_bytes = bd_buf_size_bytes(list->quads);
    float *vpls = malloc(vpl_bytes), *quads = malloc(quad_bytes);
    BD_ASSERT(vpls && quads);
    enum bd_err err = bd_buf_read(v->context.gpu, list->vpls, 0, vpls, vpl_bytes);
    if (!err) err = bd_buf_read(v->context.gpu, list->quads, 0, quads, quad_bytes);
    if (!err) vpl_set_append(&v->vpls, vpls, quads, list->count);
    free(vpls);
    free(quads);
    return err;
}

// A grid over a light's map of that side.
static enum bd_err make_grid(struct view *v, const struct bd_light_setup *light, uint32_t map_px,
                             uint32_t side, struct bd_vpl_list **out, struct bd_err_detail *detail)
{
    const struct bd_params *params = &v->plan.params;
    const struct bd_rsm_inputs map = {
        .scene = v->scene,
        .light = light,
        .side_px = map_px,
        .lambert = params->lambert,
        .paper_mode = params->paper_mode,
    };
    struct bd_rsm *rsm;
    enum bd_err err = bd_rsm_render(&v->context, &map, &rsm, detail);
    if (err) return err;
    const struct bd_vpl_grid_inputs grid = {
        .rsm = rsm,
        .light = light,
        .space = &v->scene->space,
        .grid_side = side,
        .kernel = (enum bd_vpl_kernel)params->vpl_kernel,
        .near_field = params->near_field,
    };
    err = bd_vpl_grid_run(&v->context, &grid, out, detail);
    bd_rsm_destroy(v->context.gpu, &rsm);
    return err;
}

// The light's VPLs go to the set; `*rough` is a shorter list of the same light.
static enum bd_err make_vpls(struct view *v, const struct bd_light_setup *light,
                             struct bd_vpl_list **rough, struct bd_err_detail *detail)
{
    const uint32_t side = bd_plan_grid_side(&v->plan, light);
    struct bd_vpl_list *all = NULL;
    enum bd_err err =
        make_grid(v, light, bd_plan_rsm_size(&v->plan, light, side), side, &all, detail);
    if (!err) err = append_list(v, all);
    if (!err) err = make_grid(v, light, ROUGH_MAP_PX, ROUGH_SIDE, rough, detail);
    bd_vpl_list_destroy(v->context.gpu, &all);
    return err;
}

static enum bd_err gather_roughly(struct view *v, const struct bd_vpl_list *const *lists,
                                  uint32_t count, struct bd_err_detail *detail)
{
    const struct bd_gather_inputs inputs = {
        .scene = v->scene,
        .viewpoint = &v->viewpoint,
        .gbuffer = v->gbuffer,
        .lists = lists,
        .list_count = count,
    };
    struct bd_indirect *indirect;
    enum bd_err err = bd_gather_run(&v->context, &inputs, &indirect, detail);
    if (err) return err;
    err = read_tex(v->context.gpu, indirect->irradiance, sizeof *v->irradiance,
                   (void **)&v->irradiance, detail);
    bd_indirect_destroy(v->context.gpu, &indirect);
    return err;
}

static enum bd_err run_light_side(struct view *v, const struct bd_scene *scene,
                                  struct bd_err_detail *detail)
{
    uint32_t count = 0;
    struct bd_vpl_list **rough = calloc(scene->placed_light_count + 1, sizeof *rough);
    BD_ASSERT(rough);
    enum bd_err err = BD_ERR_OK;
    for (uint32_t i = 0; !err && i < scene->placed_light_count; i++) {
        if (!bd_plan_light_shines(&v->plan, scene, i)) continue;
        const struct bd_light_setup light = bd_light_setup_of(scene, i);
        err = make_vpls(v, &light, &rough[count++], detail);
    }
    if (!err) err = gather_roughly(v, (const struct bd_vpl_list *const *)rough, count, detail);
    for (uint32_t i = 0; i < count; i++) bd_vpl_list_destroy(v->context.gpu, &rough[i]);
    free(rough);
    return err;
}

static enum bd_err run_camera_side(struct view *v, struct bd_err_detail *detail)
{
    const struct bd_gbuffer_inputs inputs = {
        .scene = v->scene, .viewpoint = &v->viewpoint, .lambert = v->plan.params.lambert};
    struct bd_gpu *gpu = v->context.gpu;
    enum bd_err err = bd_gbuffer_render(&v->context, &inputs, &v->gbuffer, detail);
    if (err) return err;
    err = read_tex(gpu, v->gbuffer->depth, sizeof *v->depth, (void **)&v->depth, detail);
    if (!err)
        err = read_tex(gpu, v->gbuffer->normals, sizeof *v->normals, (void **)&v->normals, detail);
    if (!err)
        err = read_tex(gpu, v->gbuffer->albedo, sizeof *v->albedo, (void **)&v->albedo, detail);
    if (!err)
        err =
            read_tex(gpu, v->gbuffer->material, sizeof *v->material, (void **)&v->material, detail);
    return err;
}

// --- receivers ----------------------------------------------------------------------------------

// common/normals.glsl.
static void unit_from_octahedral(const float e[2], double n[3])
{
    n[0] = e[0];
    n[1] = e[1];
    n[2] = 1 - fabs(n[0]) - fabs(n[1]);
    double t = fmax(-n[2], 0);
    n[0] += n[0] >= 0 ? -t : t;
    n[1] += n[1] >= 0 ? -t : t;
    double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (int i = 0; i < 3; i++) n[i] /= length;
}

static bool is_lit(const struct view *v, size_t at)
{
    return v->material[at][3] > 0 && v->material[at][2] == 0;
}

// common/view.glsl, from the same depth.
static void set_position(const struct view *v, uint32_t x, uint32_t y, double position[3])
{
    const struct bd_viewpoint *p = &v->viewpoint;
    double depth = v->depth[(size_t)y * p->width_px + x];
    double scale = p->orthographic ? v->scene->space.render_per_m : depth;
    double right = (2 * (x + p->sample_x_px) / p->width_px - 1) * p->half_width * scale;
    double up = (1 - 2 * (y + p->sample_y_px) / p->height_px) * p->half_height * scale;
    bd_dvec3 at = bd_render_from_world(&v->scene->space, p->position_m);
    at = bd_dvec3_add(at, bd_dvec3_scale(p->axis_x, right));
    at = bd_dvec3_add(at, bd_dvec3_scale(p->axis_y, up));
    at = bd_dvec3_sub(at, bd_dvec3_scale(p->axis_z, depth));
    position[0] = at.x;
    position[1] = at.y;
    position[2] = at.z;
}

static struct vpl_receiver receiver_at(const struct view *v, uint32_t x, uint32_t y)
{
    struct vpl_receiver r;
    const float *normals = v->normals[(size_t)y * v->viewpoint.width_px + x];
    unit_from_octahedral(normals, r.normal);
    unit_from_octahedral(normals + 2, r.normal_geometric);
    set_position(v, x, y, r.position);
    return r;
}

static struct vpl_pixel *choose_pixels(const struct view *v, const struct arguments *arguments,
                                       uint32_t *chosen)
{
    size_t count = (size_t)v->viewpoint.width_px * v->viewpoint.height_px;
    bool *lit = malloc(count * sizeof *lit);
    float(*normals)[3] = malloc(count * sizeof *normals);
    BD_ASSERT(lit && normals);
    for (size_t i = 0; i < count; i++) {
        double n[3];
        lit[i] = is_lit(v, i);
        unit_from_octahedral(v->normals[i] + 2, n);
        for (int c = 0; c < 3; c++) normals[i][c] = (float)n[c];
    }
    const struct vpl_picture picture = {
        .width_px = v->viewpoint.width_px,
        .height_px = v->viewpoint.height_px,
        .lit = lit,
        .depth = v->depth,
        .normals = (const float(*)[3])normals,
        .irradiance = (const float(*)[4])v->irradiance,
    };
    uint32_t most = arguments->pixels ? arguments->pixels : (uint32_t)count;
    struct vpl_pixel *pixels = vpl_pixels_choose(&picture, most, arguments->seed, chosen);
    free(lit);
    free(normals);
    return pixels;
}

// --- the sum ------------------------------------------------------------------------------------

struct work {
    const struct view *view;
    const struct vpl_pixel *pixels;
    uint32_t count;
    struct record *records;
};

static struct record record_of(const struct view *v, const struct vpl_pixel *pixel,
                               const double irradiance[3])
{
    const uint16_t *albedo = v->albedo[(size_t)pixel->y * v->viewpoint.width_px + pixel->x];
    struct record r = {.x = pixel->x, .y = pixel->y, .probability = pixel->probability};
    for (int c = 0; c < 3; c++) {
        r.irradiance_lx[c] = irradiance[c] * v->scene->space.unit_cd_m2;
        r.radiance_cd_m2[c] = r.irradiance_lx[c] * (albedo[c] / 65535.0) / M_PI;
    }
    return r;
}

static void sum_job(void *user, uint32_t job)
{
    const struct work *work = user;
    uint32_t first = job * RECEIVERS_PER_JOB, left = work->count - first;
    uint32_t count = left < RECEIVERS_PER_JOB ? left : RECEIVERS_PER_JOB;
    struct vpl_receiver receivers[RECEIVERS_PER_JOB] = {0};
    double irradiance[RECEIVERS_PER_JOB][3];
    for (uint32_t i = 0; i < count; i++)
        receivers[i] =
            receiver_at(work->view, work->pixels[first + i].x, work->pixels[first + i].y);
    vpl_sum(&work->view->vpls, receivers, count, irradiance);
    for (uint32_t i = 0; i < count; i++)
        work->records[first + i] = record_of(work->view, &work->pixels[first + i], irradiance[i]);
}

static void write_records(FILE *file, const char *line, const struct work *work)
{
    fputs(line, file);
    fwrite(work->records, sizeof *work->records, work->count, file);
    if (fclose(file) != 0) perror("vpl_reference");
    fputs(line, stdout);
}

// Everything after the scene; `file` is closed.
static enum bd_err sum_view(struct view *v, struct bd_scene *scene, FILE *file,
                            const struct arguments *arguments, struct bd_err_detail *detail)
{
    enum bd_err err = run_camera_side(v, detail);
    if (!err) err = run_light_side(v, scene, detail);
    if (err) return err;
    struct work work = {.view = v};
    struct vpl_pixel *pixels = choose_pixels(v, arguments, &work.count);
    work.pixels = pixels;
    work.records = calloc(work.count + 1, sizeof *work.records);
    BD_ASSERT(work.records);
    struct bd_pool *pool = bd_pool_create(arguments->threads);
    uint64_t start_ns = bd_clock_ns();
    err = bd_pool_run(pool, (work.count + RECEIVERS_PER_JOB - 1) / RECEIVERS_PER_JOB, sum_job, NULL,
                      &work);
    char line[512];
    snprintf(line, sizeof line,
             "{\"build\": \"" BD_VERSION "\", \"size\": [%u, %u], \"vpls\": %zu, "
             "\"pixels\": %u, \"seed\": %" PRIu64 ", \"threads\": %u, \"sum_s\": %.3f}\n",
             v->viewpoint.width_px, v->viewpoint.height_px, v->vpls.count, work.count,
             arguments->seed, bd_pool_thread_count(pool), bd_ms_since(start_ns) / 1e3);
    if (!err) write_records(file, line, &work);
    bd_pool_destroy(&pool);
    free(work.records);
    free(pixels);
    return err;
}

static void finish_view(struct view *v)
{
    bd_gbuffer_destroy(v->context.gpu, &v->gbuffer);
    vpl_set_finish(&v->vpls);
    free(v->irradiance);
    free(v->depth);
    free(v->normals);
    free(v->albedo);
    free(v->material);
}

static enum bd_err run_view(struct bd_gpu *gpu, struct bd_scene *scene, FILE *file,
                            const struct arguments *arguments, struct bd_err_detail *detail)
{
    static struct bd_report report;
    struct view v = {.context = {.gpu = gpu, .slicer = &slicer}};
    enum bd_err err = bd_plan_make(scene, &arguments->request, &v.plan, &report, detail);
    if (err) return err;
    struct bd_uploader uploader = {.gpu = gpu};
    bd_slicer_init(&slicer, gpu, NULL, NULL);
    err = bd_gpu_scene_create(&uploader, scene, &v.scene, detail);
    if (err) return err;
    v.viewpoint = bd_viewpoint_of(scene, &arguments->request.pose, (uint32_t)v.plan.camera,
                                  arguments->request.width_px, arguments->request.height_px);
    err = sum_view(&v, scene, file, arguments, detail);
    finish_view(&v);
    bd_gpu_scene_destroy(&uploader, &v.scene);
    return err;
}

// --- from the command line ----------------------------------------------------------------------

static enum bd_err read_arguments(int argc, char **argv, struct arguments *out,
                                  struct bd_err_detail *detail)
{
    struct bd_frame_request *request = &out->request;
    *request = bd_frame_request_default;
    snprintf(request->technique, sizeof request->technique, "rsm");
    snprintf(request->camera, sizeof request->camera, "%s", argv[4]);
    out->scene = argv[1];
    out->out = argv[2];
    if (sscanf(argv[3], "%ux%u", &request->width_px, &request->height_px) != 2)
        return bd_err_set(detail, BD_ERR_USAGE, "size", "%s: must be WxH", argv[3]);
    out->pixels = (uint32_t)strtoul(argv[5], NULL, 10);
    out->seed = strtoull(argv[6], NULL, 10);
    out->threads = (uint32_t)strtoul(argv[7], NULL, 10);
    enum bd_err err = bd_param_list_add(&request->params, "brdf=lambert", detail);
    for (int i = 8; !err && i < argc; i++)
        err = bd_param_list_add(&request->params, argv[i], detail);
    return err;
}

static enum bd_err run(const struct arguments *arguments, FILE *file, struct bd_err_detail *detail)
{
    const struct bd_gpu_options options = {.device = "auto"};
    struct bd_scene *scene = NULL;
    struct bd_gpu *gpu = NULL;
    enum bd_err err = load_scene(arguments->scene, &scene, detail);
    if (!err) err = bd_gpu_create(&options, &gpu, detail);
    if (!err) err = run_view(gpu, scene, file, arguments, detail);
    if (gpu) bd_gpu_destroy(&gpu);
    bd_scene_release(&scene);
    return err;
}

int main(int argc, char **argv)
{
    struct arguments arguments = {0};
    struct bd_err_detail detail = {0};
    if (argc < 8) {
        fputs("usage: vpl_reference SCENE OUT WxH CAMERA PIXELS SEED THREADS [KEY=VALUE]...\n",
              stderr);
        return 2;
    }
    enum bd_err err = read_arguments(argc, argv, &arguments, &detail);
    FILE *file = err ? NULL : fopen(arguments.out, "wb");
    if (!err && !file) err = bd_err_set(&detail, BD_ERR_IO, "out", "%s: no file", argv[2]);
    if (!err) err = run(&arguments, file, &detail);
    if (err) fprintf(stderr, "vpl_reference: %s: %s\n", detail.field, detail.message);
    return bd_err_exit_code(err);
}
