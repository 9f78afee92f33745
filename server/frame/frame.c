#include "frame/frame.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/clock.h"
#include "frame/stages.h"
#include "frame/sub_frames.h"
#include "image/tonemap.h"
#include "pass/reset_samplers.h"

void bd_renderer_init(struct bd_renderer *renderer, struct bd_gpu *gpu, uint64_t memo_budget_bytes)
{
    *renderer = (struct bd_renderer){
        .gpu = gpu,
        .uploader = {.gpu = gpu, .pause = bd_slicer_pause, .user = &renderer->slicer},
    };
    renderer->memo = bd_memo_create(renderer, memo_budget_bytes);
    bd_reset_samplers(gpu);
}

static const struct bd_processor *processor_of(struct bd_renderer *renderer)
{
    renderer->processor.pool = bd_renderer_pool(renderer);
    renderer->processor.loops = bd_native_loops();
    return &renderer->processor;
}

struct bd_pool *bd_renderer_pool(struct bd_renderer *renderer)
{
    if (!renderer->pool) renderer->pool = bd_pool_create(0);
    return renderer->pool;
}

void bd_renderer_finish(struct bd_renderer *renderer)
{
    bd_memo_destroy(&renderer->memo);
    bd_pool_destroy(&renderer->pool);
}

// --- the light side ---------------------------------------------------------------------------

// How many there are shows when they have been made.
static void count_clusters(struct bd_frame *frame)
{
    frame->report->counts.vpls = 0;
    for (uint32_t i = 0; i < frame->subject.light_count; i++)
        frame->report->counts.vpls += frame->subject.lights[i].vpls->count;
    frame->report->counts.vpls += bd_plan_light_path_count(frame->plan);
}

// How many virtual lights there are shows when they have been made.
static void flag_shared_maps(const struct bd_frame *frame)
{
    const struct bd_imperfect_shadows *shadows = frame->imperfect_shadows;
    if (!shadows || shadows->count == 0) return;
    if (shadows->side_px < frame->plan->params.ism_size)
        bd_report_flag(frame->report, "ism_size_reduced: %u texels a side", shadows->side_px);
    if (shadows->lists[0].vpls_each > 1)
        bd_report_flag(frame->report, "ism_shared: by %u neighbours each",
                       shadows->lists[0].vpls_each);
}

static void flag_lost_photons(struct bd_frame *frame)
{
    const struct bd_photons *photons = frame->photons;
    if (photons->flux_lost > 0)
        bd_report_flag(frame->report, "photons_lost: %.3g %% of the flux",
                       100 * photons->flux_lost / photons->flux_sent);
}

static enum bd_err run_light_side(struct bd_frame *frame)
{
    frame->is_camera_side = false;
    frame->anew = frame->request->fresh == BD_FRESH_ALL;
    enum bd_err built = bd_stage_run(frame, BD_STAGE_RAYS, NULL);
    if (!built) built = bd_stage_run(frame, BD_STAGE_EMITTERS, NULL);
    if (!built) built = bd_stage_run(frame, BD_STAGE_LAMPS, NULL);
    if (built) return built;
    for (uint32_t i = 0; !frame->plan->punctuals_by_rays && i < frame->subject.light_count; i++) {
        struct bd_frame_light *light = &frame->subject.lights[i];
        enum bd_err err = bd_stage_run(frame, BD_STAGE_SHADOW_MAP, light);
        if (!err) err = bd_stage_run(frame, BD_STAGE_RSM, light);
        if (!err) err = bd_stage_run(frame, BD_STAGE_VPL_GRID, light);
        if (!err) err = bd_stage_run(frame, BD_STAGE_VPL_CLUSTERS, light);
        if (!err) err = bd_stage_run(frame, BD_STAGE_VPL_TREE, light);
        if (err) return err;
    }
    enum bd_err err = bd_stage_run(frame, BD_STAGE_LIGHT_PATHS, NULL);
    if (!err) err = bd_stage_run(frame, BD_STAGE_ENV_MAPS, NULL);
    if (!err) err = bd_stage_run(frame, BD_STAGE_PHOTONS, NULL);
    if (!err) err = bd_stage_run(frame, BD_STAGE_POINTS, NULL);
    if (err) return err;
    if (frame->photons && frame->env_maps) flag_lost_photons(frame);
    if (bd_plan_has(frame->plan, BD_STAGE_VPL_CLUSTERS)) count_clusters(frame);
    if (!err) err = bd_stage_run(frame, BD_STAGE_VPL_ORDER, NULL);
    if (!err) err = bd_stage_run(frame, BD_STAGE_SHADOW_POINTS, NULL);
    return err ? err : bd_stage_run(frame, BD_STAGE_IMPERFECT_SHADOWS, NULL);
}

// --- layers ---------------------------------------------------------------------------------

static bool wants(const struct bd_frame *frame, uint32_t layer)
{
    return frame->plan->layers >> layer & 1;
}

static enum bd_err create_layers(struct bd_frame *frame, struct bd_tex *layers[BD_LAYER_COUNT])
{
    for (uint32_t l = 0; l < BD_LAYER_RENDERED_COUNT; l++) {
        if (!wants(frame, l)) continue;
        const struct bd_tex_desc desc = {
            .name = bd_layer_name((enum bd_layer)l),
            .format = BD_FORMAT_RGBA32F,
            .width_px = frame->request->width_px,
            .height_px = frame->request->height_px,
        };
        enum bd_err err = bd_tex_create(frame->context.gpu, &desc, &layers[l], frame->detail);
        if (err) return err;
    }
    return BD_ERR_OK;
}

// Into the layers themselves (`only`), or into their sums over sub-frames.
static enum bd_err composite(struct bd_frame *frame, bool first, bool only,
                             struct bd_tex *layers[BD_LAYER_COUNT])
{
    const struct bd_composite_inputs inputs = {
        .scene = frame->scene,
        .viewpoint = &frame->subject.viewpoint,
        .gbuffer = frame->made.gbuffer,
        .direct = frame->made.direct ? frame->made.direct->radiance : NULL,
        .area_light = frame->made.area_light,
        .indirect = frame->made.indirect,
        .glass = frame->made.glass,
        .filtered = frame->plan->filtered,
        .whole = frame->plan->follows && !frame->plan->params.lambert,
        .lambert = frame->plan->params.lambert,
        // What their strata have apart is the same in all rounds, and no noise of the mean.
        .halves_exchanged = frame->subject.round % 2 == 1,
        .first = first,
        .only = only,
    };
    bd_stage_mark(frame, "composite", BD_PASS_RAN);
    bd_gpu_pass_begin(frame->context.gpu, "composite");
    const enum bd_err err = bd_composite_run(&frame->context, &inputs, layers, frame->detail);
    bd_gpu_pass_end(frame->context.gpu);
    return err;
}

// --- what is told of indirect light ---------------------------------------------------------

static void count_indirect(const struct bd_indirect *indirect, struct bd_indirect_counts *counts)
{
    if (!indirect) return;
    counts->fragments += indirect->fragment_count;
    counts->subsplats += indirect->subsplats.drawn;
    counts->subsplats_tested += indirect->subsplats.tested;
    counts->subsplats_split += indirect->subsplats.split;
    counts->screen_parts += indirect->screen_parts;
    counts->rays += indirect->rays.count;
    counts->rays_ms += indirect->rays.ms;
    counts->subsplats_limited |= indirect->subsplats.is_limited;
}

static void report_counts(struct bd_report *report, const struct bd_indirect_counts *counts)
{
    report->counts.fragments = counts->fragments;
    report->counts.subsplats = counts->subsplats;
    report->counts.subsplats_tested = counts->subsplats_tested;
    report->counts.subsplats_split = counts->subsplats_split;
    report->counts.screen_parts = counts->screen_parts;
    report->counts.rays = counts->rays;
    report->counts.mrays_per_s =
        counts->rays_ms > 0 ? 1e-3 * (double)counts->rays / counts->rays_ms : 0;
    if (counts->subsplats_limited)
        bd_report_flag(report, "subsplats_limited: coarser than radiance_threshold asks for");
}

// --- sub-frames -----------------------------------------------------------------------------

static void begin_camera_side(struct bd_frame *frame)
{
    frame->is_camera_side = true;
    frame->anew = frame->request->fresh != BD_FRESH_NONE;
}

// Light of blocks, which every sub-frame then shares.
static enum bd_err light_blocks(struct bd_frame *frame)
{
    const struct bd_viewpoint whole = frame->subject.viewpoint;
    const struct bd_pixel_blocks blocks = bd_pixel_blocks_of(&whole, frame->plan->block_px);
    frame->subject.viewpoint = bd_viewpoint_of_blocks(&whole, &blocks);
    enum bd_err err = bd_stage_run(frame, BD_STAGE_GBUFFER, NULL);
    if (!err) err = bd_stage_run(frame, BD_STAGE_INDIRECT, NULL);
    frame->first = (struct bd_sub_frame){frame->subject.viewpoint, blocks, frame->made.gbuffer,
                                         frame->made.indirect};
    frame->subject.viewpoint = whole;
    bd_stage_note_round(frame);
    bd_stage_leave_camera_side(frame);
    return err;
}

// Its light is its own, or the first one's.
static bool is_of_sub_frame(enum bd_stage stage, bool is_shared)
{
    const enum bd_stage_of of = bd_stage_rows[stage].of;
    return bd_stage_rows[stage].run &&
           (of == BD_STAGE_OF_EACH || of == (is_shared ? BD_STAGE_OF_SHARER : BD_STAGE_OF_WHOLE));
}

// Of its round, whose light the others share.
static bool is_first(const struct bd_frame *frame, uint32_t index)
{
    return frame->plan->in_rounds ? bd_begins_round(index) : index == 0;
}

// Where it looks, and of what blends what it sees.
static void go_to_sub_frame(struct bd_frame *frame, uint32_t index)
{
    bd_sub_frame_place(&frame->subject.viewpoint, index);
    if (!frame->plan->blends) frame->subject.viewpoint.sub_frame = 0;
}

static enum bd_err see_sub_frame(struct bd_frame *frame, uint32_t index)
{
    const bool is_shared =
        frame->plan->shared && (!is_first(frame, index) || frame->plan->block_px > 1);
    go_to_sub_frame(frame, index);
    enum bd_err err = BD_ERR_OK;
    for (enum bd_stage stage = 0; !err && stage < BD_STAGE_COUNT; stage++)
        if (is_of_sub_frame(stage, is_shared)) err = bd_stage_run(frame, stage, NULL);
    return err;
}

static enum bd_err add_sub_frame(struct bd_frame *frame, struct bd_frame_sums *sums)
{
    enum bd_err err = composite(frame, sums->count == 0, false, sums->layers);
    if (err) return err;
    if (sums->count == 0 && frame->plan->block_px > 1)
        count_indirect(frame->first.indirect, &sums->counts);
    count_indirect(frame->made.indirect, &sums->counts);
    count_indirect(frame->made.glass, &sums->counts);
    sums->count++;
    return BD_ERR_OK;
}

// The first sub-frame of a round, and the light that all of the round share.
static enum bd_err see_first(struct bd_frame *frame, uint32_t index)
{
    go_to_sub_frame(frame, index);
    enum bd_err err = frame->plan->block_px > 1 ? light_blocks(frame) : BD_ERR_OK;
    if (!err) err = see_sub_frame(frame, index);
    if (!err && frame->plan->block_px == 1)
        frame->first = (struct bd_sub_frame){frame->subject.viewpoint,
                                             bd_pixel_blocks_of(&frame->subject.viewpoint, 1),
                                             frame->made.gbuffer, frame->made.indirect};
    return err;
}

// What is decided by chance, from the lights' side on. What the round before drew is forgotten.
static enum bd_err draw_anew(struct bd_frame *frame, uint32_t round)
{
    bd_stage_forget_round(frame);
    frame->subject.seed = bd_seed_of_round(frame->request->seed, round);
    frame->subject.round = round;
    enum bd_err err = run_light_side(frame);
    begin_camera_side(frame);
    if (!err) err = see_first(frame, round * BD_SUB_FRAMES_OF_ROUND);
    if (!err) bd_stage_note_round(frame);
    return err;
}

static enum bd_err add_later(struct bd_frame *frame, struct bd_frame_sums *sums, uint32_t index)
{
    const bool begins = frame->plan->in_rounds && bd_round_of(index) != frame->subject.round;
    enum bd_err err = BD_ERR_OK;
    bd_stage_leave_camera_side(frame);
    if (begins) err = draw_anew(frame, bd_round_of(index));
    if (!err && begins && is_first(frame, index)) return add_sub_frame(frame, sums);
    bd_stage_leave_camera_side(frame);
    if (!err) err = see_sub_frame(frame, index);
    if (!err) err = add_sub_frame(frame, sums);
    if (!err) bd_stage_forget_camera_side(frame);
    return err;
}

// From as many as were added up before, by this frame's like or one of fewer sub-frames.
static enum bd_err add_sub_frames(struct bd_frame *frame, struct bd_frame_sums *sums)
{
    enum bd_err err = sums->count == 0 ? add_sub_frame(frame, sums) : BD_ERR_OK;
    for (uint32_t s = sums->count; !err && s < frame->request->aa; s++)
        err = add_later(frame, sums, s);
    bd_stage_forget_round(frame);
    return err;
}

static enum bd_err finish_sums(struct bd_frame *frame, const struct bd_frame_sums *sums,
                               struct bd_tex *layers[BD_LAYER_COUNT])
{
    enum bd_err err = BD_ERR_OK;
    bd_gpu_pass_begin(frame->context.gpu, "composite");
    for (uint32_t l = 0; !err && l < BD_LAYER_RENDERED_COUNT; l++) {
        const struct bd_composite_sums inputs = {frame->scene, &frame->subject.viewpoint,
                                                 sums->layers[l], sums->count};
        if (layers[l])
            err = bd_composite_finish(&frame->context, &inputs, l, layers[l], frame->detail);
    }
    bd_gpu_pass_end(frame->context.gpu);
    return err;
}

// The first sub-frame is seen whole, kept for the others and for a frame of one sub-frame: those
// look through the same places.
static enum bd_err run_sub_frames(struct bd_frame *frame, struct bd_tex *layers[BD_LAYER_COUNT])
{
    struct bd_frame_sums *sums;
    enum bd_err err = see_first(frame, 0);
    if (err) return err;
    if (frame->request->aa == 1) {
        struct bd_indirect_counts counts = {0};
        if (frame->plan->block_px > 1) count_indirect(frame->first.indirect, &counts);
        err = composite(frame, true, true, layers);
        count_indirect(frame->made.indirect, &counts);
        count_indirect(frame->made.glass, &counts);
        report_counts(frame->report, &counts);
        return err;
    }
    err = bd_stage_take_sums(frame, &sums);
    if (!err && sums->count == frame->request->aa)
        bd_stage_mark(frame, "composite", BD_PASS_REUSED);
    if (!err) err = add_sub_frames(frame, sums);
    if (!err) err = finish_sums(frame, sums, layers);
    if (!err) report_counts(frame->report, &sums->counts);
    bd_stage_keep_sums(frame, &sums, err == BD_ERR_OK);
    return err;
}

static enum bd_err run_camera_side(struct bd_frame *frame, struct bd_tex *layers[BD_LAYER_COUNT])
{
    begin_camera_side(frame);
    enum bd_err err = run_sub_frames(frame, layers);
    frame->is_camera_side = false;
    return err;
}

// --- readback -------------------------------------------------------------------------------

// Rows of one copy: few enough for a slice, and for a small buffer.
#define READBACK_BYTES_MAX (4u << 20)
#define READBACK_ROWS_MIN  8u
#define TEXEL_BYTES        (4 * sizeof(float))

struct band {
    uint32_t first_row, row_count;
    float *rgba;
};

static void copy_to_image(const struct band *band, struct bd_image *image)
{
    const uint32_t channels = image->channel_count;
    const size_t texels = (size_t)image->width_px * band->row_count;
    float *to = image->pixels + (size_t)image->width_px * band->first_row * channels;
    for (size_t i = 0; i < texels; i++)
        memcpy(to + i * channels, band->rgba + 4 * i, channels * sizeof(float));
}

static enum bd_err read_band(struct bd_frame *frame, const struct bd_tex *tex,
                             const struct band *band)
{
    struct bd_gpu *gpu = frame->context.gpu;
    struct bd_readback *pending;
    bd_gpu_pass_begin(gpu, "readback");
    enum bd_err err = bd_gpu_readback_rows_start(gpu, tex, 0, band->first_row, band->row_count,
                                                 &pending, frame->detail);
    bd_gpu_pass_end(gpu);
    if (err) return err;
    return bd_gpu_readback_finish(gpu, &pending, band->rgba,
                                  frame->request->width_px * TEXEL_BYTES * band->row_count);
}

static uint32_t band_rows_max(const struct bd_frame *frame)
{
    uint32_t rows = (uint32_t)(READBACK_BYTES_MAX / (frame->request->width_px * TEXEL_BYTES));
    return rows < READBACK_ROWS_MIN ? READBACK_ROWS_MIN : rows;
}

static enum bd_err read_layer(struct bd_frame *frame, const struct bd_tex *tex, float *rgba,
                              struct bd_image *image)
{
    struct bd_slicer *slicer = frame->context.slicer;
    const uint32_t width = image->width_px, height = image->height_px;
    const uint32_t rows_max = band_rows_max(frame);
    bd_slicer_work(slicer, "readback");
    for (uint32_t row = 0; row < height;) {
        uint32_t rows = bd_slicer_rows(slicer, width, height - row);
        if (rows > rows_max) rows = rows_max;
        const struct band band = {row, rows, rgba};
        enum bd_err err = read_band(frame, tex, &band);
        if (err) return err;
        copy_to_image(&band, image);
        err = bd_slicer_checkpoint(slicer, (double)width * rows);
        if (err) return err;
        row += rows;
    }
    return BD_ERR_OK;
}

static enum bd_err read_layers(struct bd_frame *frame, struct bd_tex *textures[BD_LAYER_COUNT],
                               struct bd_image *layers[BD_LAYER_COUNT])
{
    const uint64_t start_ns = bd_clock_ns();
    const double away_ms = frame->away_ms;
    const uint32_t width = frame->request->width_px, height = frame->request->height_px;
    float *rgba = malloc(width * TEXEL_BYTES * band_rows_max(frame));
    BD_ASSERT(rgba);
    bd_stage_mark(frame, "readback", BD_PASS_RAN);
    enum bd_err err = BD_ERR_OK;
    for (uint32_t l = 0; !err && l < BD_LAYER_COUNT; l++) {
        if (!textures[l]) continue;
        layers[l] = bd_image_create(width, height, bd_layer_channel_count((enum bd_layer)l));
        if (!layers[l])
            err = bd_err_set(frame->detail, BD_ERR_NO_MEMORY, "size", "no memory for a layer");
        if (!err) err = read_layer(frame, textures[l], rgba, layers[l]);
    }
    free(rgba);
    frame->report->time_ms.readback = bd_ms_since(start_ns) - (frame->away_ms - away_ms);
    return err;
}

static enum bd_err inspect_beauty(struct bd_frame *frame, const struct bd_image *beauty,
                                  struct bd_exposure_sum *exposure)
{
    bool is_lit = false;
    enum bd_err err = BD_ERR_OK;
    for (uint32_t row = 0; !err && row < beauty->height_px; row++) {
        is_lit |= bd_report_inspect_row(frame->report, beauty, row);
        if (frame->plan->doubts) bd_exposure_add_row(exposure, beauty, row);
        err = bd_slicer_pause(frame->context.slicer);
    }
    if (!err) bd_report_conclude(frame->report, is_lit);
    return err;
}

static enum bd_err estimate_error(struct bd_frame *frame, struct bd_image *const *layers,
                                  const struct bd_exposure_sum *exposure)
{
    const struct bd_image *beauty = layers[BD_LAYER_BEAUTY];
    struct bd_doubt_sums sums = bd_doubt_sums_of(bd_exposure_of(exposure));
    enum bd_err err = BD_ERR_OK;
    for (uint32_t row = 0; !err && row < beauty->height_px; row++) {
        bd_doubt_sums_add_row(&sums, beauty, layers[BD_LAYER_NOISE], layers[BD_LAYER_BLUR], row);
        err = bd_slicer_pause(frame->context.slicer);
    }
    if (!err) bd_report_own_estimate(frame->report, &sums);
    return err;
}

static enum bd_err inspect(struct bd_frame *frame, struct bd_image *layers[BD_LAYER_COUNT])
{
    struct bd_exposure_sum exposure = {0};
    enum bd_err err = inspect_beauty(frame, layers[BD_LAYER_BEAUTY], &exposure);
    if (!err && frame->plan->doubts) err = estimate_error(frame, layers, &exposure);
    if (err) return err;
    for (uint32_t l = 0; l < BD_LAYER_RENDERED_COUNT; l++)
        if (BD_LAYERS_DOUBT & ~frame->request->layers & 1u << l) bd_image_destroy(&layers[l]);
    return BD_ERR_OK;
}

// --- the report -----------------------------------------------------------------------------

static void report_device(struct bd_report *report, const struct bd_gpu *gpu)
{
    const struct bd_gpu_caps *caps = bd_gpu_caps(gpu);
    memcpy(report->device.name, caps->name, sizeof report->device.name);
    memcpy(report->device.device_class, caps->device_class, sizeof report->device.device_class);
    report->device.software = caps->software;
}

static void report_pass_times(struct bd_report *report, struct bd_gpu *gpu)
{
    struct bd_gpu_pass_time times[256];
    uint32_t count;
    while ((count = bd_gpu_take_pass_times(gpu, times, 256)) > 0) {
        for (uint32_t t = 0; t < count; t++) {
            report->time_ms.gpu += times[t].ms;
            for (uint32_t p = 0; p < report->pass_count; p++)
                if (strcmp(report->passes[p].name, times[t].name) == 0)
                    report->passes[p].ms += times[t].ms;
        }
    }
}

static void report_memory(struct bd_report *report, const struct bd_gpu *gpu)
{
    struct bd_gpu_memory memory;
    bd_gpu_memory(gpu, &memory);
    report->memory_gpu_mib = (double)memory.used_bytes / (1 << 20);
    report->memory_gpu_peak_mib = (double)memory.peak_bytes / (1 << 20);
}

// --- setting a frame aside ------------------------------------------------------------------

void bd_renderer_suspend(struct bd_renderer *renderer, struct bd_suspended_frame *out)
{
    struct bd_frame *frame = renderer->frame;
    BD_ASSERT(frame);
    *out = (struct bd_suspended_frame){
        .frame = frame,
        .slicer = renderer->slicer,
        .compile_ms = bd_gpu_compile_ms(renderer->gpu),
        .upload_ms = renderer->uploader.upload_ms,
        .light_unit_cd_m2 = frame->scene ? frame->scene->space.unit_cd_m2 : 0,
    };
    bd_gpu_suspend(renderer->gpu, &out->gpu);
    report_pass_times(frame->report, renderer->gpu); // the next frame's begin at none
    renderer->frame = NULL;
    out->since_ns = bd_clock_ns();
}

void bd_renderer_resume(struct bd_renderer *renderer, const struct bd_suspended_frame *suspended)
{
    struct bd_frame *frame = suspended->frame;
    struct bd_slicer *slicer = &renderer->slicer;
    BD_ASSERT(!renderer->frame);
    frame->away_ms += bd_ms_since(suspended->since_ns);
    bd_gpu_resume(renderer->gpu, &suspended->gpu);
    // What others learnt stays.
    const struct bd_slicer learnt = *slicer;
    *slicer = suspended->slicer;
    slicer->kind_count = learnt.kind_count;
    memcpy(slicer->kinds, learnt.kinds, sizeof slicer->kinds);
    // A frame of the same geometry under other lights had the uploaded scene in its own unit.
    if (frame->scene) frame->scene->space.unit_cd_m2 = suspended->light_unit_cd_m2;
    frame->away_compile_ms += bd_gpu_compile_ms(renderer->gpu) - suspended->compile_ms;
    frame->away_upload_ms += renderer->uploader.upload_ms - suspended->upload_ms;
    renderer->frame = frame;
}

// --- the frame ------------------------------------------------------------------------------

static enum bd_err run_frame(struct bd_frame *frame, struct bd_image *layers[BD_LAYER_COUNT])
{
    struct bd_tex *textures[BD_LAYER_COUNT] = {0};
    enum bd_err err = bd_slicer_checkpoint(&frame->renderer->slicer, 0); // late before it began
    if (!err) err = bd_stage_upload(frame);
    frame->subject = bd_subject_of(frame->snapshot, frame->plan, frame->request);
    if (!err) err = run_light_side(frame);
    if (!err) flag_shared_maps(frame);
    if (!err) err = create_layers(frame, textures);
    if (!err) err = run_camera_side(frame, textures);
    if (!err) err = read_layers(frame, textures, layers);
    if (!err) err = inspect(frame, layers);
    for (uint32_t l = 0; l < BD_LAYER_COUNT; l++) bd_tex_destroy(frame->context.gpu, &textures[l]);
    bd_subject_finish(&frame->subject);
    return err;
}

static void destroy_images(struct bd_image *layers[BD_LAYER_COUNT])
{
    for (uint32_t l = 0; l < BD_LAYER_COUNT; l++) bd_image_destroy(&layers[l]);
}

enum bd_err bd_frame_render(struct bd_renderer *renderer, struct bd_scene *scene,
                            const struct bd_frame_request *request,
                            enum bd_err (*should_stop)(void *user), void *user,
                            struct bd_image *layers[BD_LAYER_COUNT], struct bd_report *report,
                            struct bd_err_detail *detail)
{
    uint64_t start_ns = bd_clock_ns();
    struct bd_gpu *gpu = renderer->gpu;
    struct bd_plan plan;
    enum bd_err err = bd_plan_make(scene, request, &plan, report, detail);
    report_device(report, gpu);
    if (!err) bd_plan_place(&plan, bd_gpu_caps(gpu)->software, report);
    if (err || request->plan_only) return err;
    BD_ASSERT(!plan.technique->is_reference); // sched/ takes those elsewhere

    double compile_ms = bd_gpu_compile_ms(gpu), upload_ms = renderer->uploader.upload_ms;
    bd_slicer_init(&renderer->slicer, gpu, should_stop, user);
    bd_gpu_memory_reset_peak(gpu);
    struct bd_frame frame = {
        .renderer = renderer,
        .context = {gpu, &renderer->slicer, plan.native ? processor_of(renderer) : NULL},
        .snapshot = scene,
        .request = request,
        .plan = &plan,
        .report = report,
        .detail = detail,
    };
    if (plan.panes) bd_surface_hits_init(&frame.panes, scene);
    const struct bd_report planned = *report;
    BD_ASSERT(!renderer->frame);
    renderer->frame = &frame;
    bd_memo_begin_frame(renderer->memo);
    err = run_frame(&frame, layers);
    if (err == BD_ERR_NO_MEMORY && bd_memo_evict_unused(renderer->memo) > 0) {
        // Other scenes' and views' outputs stood in the way: once more with the room to itself.
        destroy_images(layers);
        *report = planned;
        frame.is_camera_side = false;
        err = run_frame(&frame, layers);
    }
    bd_memo_end_frame(renderer->memo);
    if (plan.panes) bd_surface_hits_finish(&frame.panes);
    renderer->frame = NULL;
    if (err) destroy_images(layers);
    report_pass_times(report, gpu);
    report_memory(report, gpu);
    report->time_ms.compile = bd_gpu_compile_ms(gpu) - compile_ms - frame.away_compile_ms;
    report->time_ms.load = renderer->uploader.upload_ms - upload_ms - frame.away_upload_ms;
    report->time_ms.total = bd_ms_since(start_ns) - frame.away_ms;
    if (err == BD_ERR_CANCELLED) report->stopped = BD_STOPPED_CANCELLED;
    if (err == BD_ERR_DEADLINE) report->stopped = BD_STOPPED_DEADLINE;
    return err;
}
