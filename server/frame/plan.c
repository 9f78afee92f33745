#include "frame/plan.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/hash.h"
#include "frame/stage_rows.h"
#include "pass/gather_chosen.h"
#include "pass/gather_tree.h"
#include "pass/light_paths.h"
#include "pass/upsample.h"
#include "technique/sub_frame_light.h"

#define VPL_BUDGET_SHARES 4.0 // unless said otherwise: so many lights' own

bool bd_plan_light_shines(const struct bd_plan *plan, const struct bd_scene *scene,
                          uint32_t placed_light)
{
    if (plan->rig_yields) return false;
    const struct bd_light *light = &scene->lights[scene->placed_lights[placed_light].object];
    bool coloured = light->color[0] > 0 || light->color[1] > 0 || light->color[2] > 0;
    return light->intensity > 0 && coloured;
}

static uint32_t count_lights(const struct bd_plan *plan, const struct bd_scene *scene)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < scene->placed_light_count; i++)
        count += bd_plan_light_shines(plan, scene, i);
    return count;
}

static uint64_t count_vpls(const struct bd_plan *plan, const struct bd_scene *scene)
{
    uint64_t count = 0;
    if (plan->final_gather)
        return bd_plan_light_path_count(plan) +
               bd_plan_photon_vpl_count(plan) *
                   ((plan->light_count > 0) + (uint32_t)plan->emitters);
    for (uint32_t i = 0; !plan->punctuals_by_rays && i < scene->placed_light_count; i++) {
        if (!bd_plan_light_shines(plan, scene, i)) continue;
        const struct bd_light_setup setup = bd_light_setup_of(scene, i);
        uint64_t side = bd_plan_grid_side(plan, &setup);
        count += side * side * setup.face_count;
    }
    return count + bd_plan_light_path_count(plan);
}

// --- what is found by rays --------------------------------------------------------------------

bool bd_plan_traces(const struct bd_plan *plan, uint64_t samples)
{
    if (plan->tracing == BD_TRACING_WHERE_MANY) return plan->triangle_count > samples;
    return plan->tracing == BD_TRACING_ALL;
}

// A frame that asks no rays otherwise is drawn: to build the structure of ten million triangles
// takes as long as drawing them two or three times (tests/bench/results/many_triangles.json).
static enum bd_tracing tracing_of(const struct bd_plan *plan)
{
    if (plan->technique->is_reference || plan->params.drawing == BD_DRAWING_RASTER)
        return BD_TRACING_NONE;
    if (plan->params.drawing == BD_DRAWING_RAYS) return BD_TRACING_ALL;
    const bool has_rays = plan->rays || plan->area_lights || plan->punctuals_by_rays ||
                          plan->light_paths || plan->shows_glass;
    return has_rays && !plan->params.paper_mode && plan->triangle_count > BD_PLAN_DRAWN_MAX
               ? BD_TRACING_WHERE_MANY
               : BD_TRACING_NONE;
}

static uint32_t traced_stages_of(const struct bd_plan *plan, const struct bd_scene *scene,
                                 const struct bd_frame_request *request)
{
    const uint64_t pixels = (uint64_t)request->width_px * request->height_px;
    uint32_t stages = bd_plan_traces(plan, pixels) ? BD_STAGE_BIT(GBUFFER) : 0;
    for (uint32_t i = 0; !plan->punctuals_by_rays && i < scene->placed_light_count; i++) {
        if (!bd_plan_light_shines(plan, scene, i)) continue;
        const struct bd_light_setup setup = bd_light_setup_of(scene, i);
        const uint32_t side = bd_plan_rsm_size(plan, &setup, bd_plan_grid_side(plan, &setup));
        if (bd_plan_traces(plan, bd_light_setup_texels(&setup, plan->params.shadow_size)))
            stages |= BD_STAGE_BIT(SHADOW_MAP);
        if (bd_plan_traces(plan, bd_light_setup_texels(&setup, side))) stages |= BD_STAGE_BIT(RSM);
    }
    return stages & plan->stages;
}

static bool some_map_is_reduced(const struct bd_plan *plan, const struct bd_scene *scene)
{
    for (uint32_t i = 0; i < scene->placed_light_count; i++) {
        if (!bd_plan_light_shines(plan, scene, i)) continue;
        const struct bd_light_setup setup = bd_light_setup_of(scene, i);
        if (bd_plan_grid_side(plan, &setup) * BD_PLAN_BLOCK_TEXELS_MAX < plan->params.rsm_size)
            return true;
    }
    return false;
}

static double total_flux_lm(const struct bd_plan *plan, const struct bd_scene *scene)
{
    double flux_lm = 0;
    for (uint32_t i = 0; i < scene->placed_light_count; i++)
        if (bd_plan_light_shines(plan, scene, i)) flux_lm += bd_light_setup_of(scene, i).flux_lm;
    return flux_lm;
}

// --- punctual lights by maps or by rays ----------------------------------------------------------

// So few are always by maps, which last while cameras move.
#define PUNCTUALS_FEW 8u
// What a ray of a pixel takes, chosen and traced, in texels of a shadow map, drawn and looked up:
// 100 by 10 ns in a hall of boxes, 200 by 20 in Sponza.
#define TEXELS_PER_RAY 10.0

static double map_texels(const struct bd_plan *plan, const struct bd_scene *scene)
{
    const double side = plan->params.shadow_size;
    uint64_t faces = 0;
    for (uint32_t i = 0; i < scene->placed_light_count; i++)
        if (bd_plan_light_shines(plan, scene, i)) faces += bd_light_setup_of(scene, i).face_count;
    return (double)faces * side * side;
}

// Sub-frames behind the first send fewer.
static double ray_count(const struct bd_plan *plan, const struct bd_frame_request *request)
{
    const double pixels = (double)request->width_px * request->height_px;
    return pixels * plan->params.light_rays * (1 + 0.25 * (request->aa - 1));
}

// Techniques that know punctual lights alone have no other place for what those send on.
static bool may_be_by_rays(const struct bd_plan *plan)
{
    const bool has_place =
        !plan->technique->indirect || bd_plan_reads(plan, BD_PARAM_INDIRECT_BOUNCES);
    return has_place && !plan->technique->is_reference && plan->params.light_rays > 0 &&
           plan->params.lamps != BD_LAMPS_MAPS;
}

// Papers know lights one by one. A map of what a light sees first knows of no glass before it, and
// of nothing that is there in part.
static bool are_by_rays(const struct bd_plan *plan, const struct bd_scene *scene,
                        const struct bd_frame_request *request)
{
    const struct bd_params *params = &plan->params;
    if (plan->light_count == 0 || !may_be_by_rays(plan)) return false;
    if (params->lamps == BD_LAMPS_RAYS || plan->panes || plan->veils) return true;
    return !params->paper_mode && plan->light_count > PUNCTUALS_FEW &&
           map_texels(plan, scene) > TEXELS_PER_RAY * ray_count(plan, request);
}

// --- blocks -----------------------------------------------------------------------------------

// Pictures of so many pixels and so few rays of each have their indirect light from blocks: it then
// takes a quarter, and what four pixels would have told more a filter has spread anyway. Time at
// equal error, side 2 against none: as long at 256x192, 1.1 to 1.6 times less at 512x384, 2 to 3
// times less at 1024x768, in three scenes; from 16 rays on what blocks cannot tell is more than
// their noise.
#define BLOCKS_PIXELS_MIN (512u * 384u)
#define BLOCKS_RAYS_MAX   8u

// Other sub-frames would share what the first has of each pixel: they are none that it pays for.
uint32_t bd_plan_block_px(const struct bd_technique *technique, const struct bd_params *params,
                          uint32_t width_px, uint32_t height_px, uint32_t aa)
{
    const bool reads = technique->params_read & BD_READS(BD_PARAM_LIGHT_BLOCKS);
    if (!reads || params->sub_frames == BD_SUB_FRAMES_OWN) return 1;
    if (params->light_blocks != 0) return 1u << (params->light_blocks - 1);
    const bool pays = aa == 1 && params->rays <= BLOCKS_RAYS_MAX &&
                      (uint64_t)width_px * height_px >= BLOCKS_PIXELS_MIN;
    return pays ? 2 : 1;
}

// --- the report's share ---------------------------------------------------------------------

static void add_pass(struct bd_report *report, enum bd_stage stage, const char *name)
{
    const uint32_t at = report->pass_count++;
    snprintf(report->passes[at].name, sizeof report->passes[0].name, "%s", name);
    report->passes[at].state = BD_PASS_PLANNED;
    report->passes[at].of_each_sub_frame = bd_stage_rows[stage].of >= BD_STAGE_OF_EACH;
}

static void omit(struct bd_report *report, bool omitted, const char *pass, const char *reason)
{
    if (!omitted) return;
    uint32_t at = report->omitted_count++;
    snprintf(report->omitted[at].pass, sizeof report->omitted[at].pass, "%s", pass);
    snprintf(report->omitted[at].reason, sizeof report->omitted[at].reason, "%s", reason);
}

static void list_passes(const struct bd_plan *plan, struct bd_report *report)
{
    for (enum bd_stage stage = 0; stage < BD_STAGE_COUNT; stage++) {
        const char *names[BD_STAGE_PASSES_MAX];
        if (!bd_plan_has(plan, stage)) continue;
        const uint32_t count = bd_stage_passes(plan, stage, names);
        for (uint32_t i = 0; i < count; i++) add_pass(report, stage, names[i]);
    }
}

// Passes that are left out whole. Of a technique without indirect light that is the usual one.
static void list_omitted_passes(const struct bd_plan *plan, struct bd_report *report)
{
    static const struct bd_technique_pass usual[] = {{"gather", 0}, {NULL, 0}};
    const struct bd_technique_pass *own = plan->technique->passes ? plan->technique->passes : usual;
    for (enum bd_stage stage = 0; stage < BD_STAGE_COUNT; stage++) {
        const struct bd_stage_row *row = &bd_stage_rows[stage];
        const char *why = row->why_not ? row->why_not(plan) : NULL;
        if (!why || bd_plan_has(plan, stage)) continue;
        omit(report, row->pass != NULL, row->pass, why);
        omit(report, row->second_pass != NULL, row->second_pass, why);
        for (const struct bd_technique_pass *pass = own; !row->pass && pass->name; pass++)
            omit(report, !(pass->when & ~BD_WHEN_GLOSSY), pass->name, why);
    }
}

static void list_omitted_parts(const struct bd_plan *plan, const struct bd_features *features,
                               struct bd_report *report)
{
    for (enum bd_stage stage = 0; stage < BD_STAGE_COUNT; stage++) {
        const struct bd_stage_row *row = &bd_stage_rows[stage];
        const struct bd_stage_part *part = bd_plan_has(plan, stage) ? row->parts : NULL;
        for (; part && part->why_not; part++)
            omit(report, part->is_left_out(plan, features), row->pass, part->why_not);
    }
}

static void list_omitted_of_blocks(const struct bd_plan *plan, struct bd_report *report)
{
    const struct bd_params *p = &plan->params;
    if (!(plan->technique->params_read & BD_READS(BD_PARAM_LIGHT_THRESHOLD))) return;
    omit(report, isinf(p->light_threshold), "gather", "blocks split by light: light_threshold=inf");
    omit(report, p->surface_detail != BD_SURFACE_DETAIL_DIRECTION, "gather",
         "blocks split by light: surface_detail has no irradiance vector");
}

static const char *pass_when(const struct bd_technique *technique, enum bd_when when)
{
    const struct bd_technique_pass *pass = technique->passes;
    while (pass->name && !(pass->when & when)) pass++;
    return pass->name;
}

// Passes that bring back nothing of what a clamp takes off, and why.
static void list_omitted_of_clamp(const struct bd_plan *plan, struct bd_report *report)
{
    const struct bd_params *p = &plan->params;
    const bool nothing = isinf(p->clamp_per_m2);
    const char *no_screen = nothing                           ? "clamp=inf"
                            : p->iterations == 0              ? "iterations=0"
                            : p->residual == BD_RESIDUAL_RAYS ? "residual=rays"
                                                              : "mirrors and glass bring light";
    omit(report, !plan->from_screen, pass_when(plan->technique, BD_WHEN_SCREEN), no_screen);
    for (const struct bd_technique_pass *pass = plan->technique->passes; pass->name; pass++)
        omit(report, !plan->short_rays && pass->when & BD_WHEN_SHORT, pass->name,
             nothing ? "clamp=inf" : "residual=screen");
}

// Why light is reflected by the diffuse lobe alone.
static const char *no_glossy_lobe(const struct bd_plan *plan)
{
    if (plan->params.lambert) return "glossy lobe: brdf=lambert";
    return plan->technique->model.glossy_receivers
               ? "glossy lobe: every surface is rough and no metal"
               : "glossy lobe: the technique has none for indirect light";
}

// Papers on photons and on points have none of it.
static bool leaves_rough(const struct bd_plan *plan)
{
    return plan->params.paper_mode && !plan->final_gather;
}

static const char *no_rough_lobe(const struct bd_plan *plan, const struct bd_scene *scene)
{
    if (plan->params.lambert) return "brdf=lambert";
    if (leaves_rough(plan)) return "paper_mode=on";
    return scene->features.has_rough ? "far_rays below 8: rough lobes as in even light"
                                     : "every surface is smooth or metal";
}

static const char *no_caustics(const struct bd_plan *plan, const struct bd_scene *scene)
{
    if (!scene->features.has_transmissive && !scene->features.has_mirror)
        return "no surface lets light through or is a mirror";
    if (!plan->goes_on) return "glass is opaque";
    return plan->params.caustics ? "no lamp shines" : "caustics=off";
}

// Where none is for glossy receivers alone, the one that lights.
static const char *glossy_pass(const struct bd_technique *technique)
{
    const char *name = pass_when(technique, BD_WHEN_GLOSSY);
    return name ? name : bd_technique_light_pass(technique);
}

static void list_omitted(const struct bd_plan *plan, const struct bd_scene *scene,
                         struct bd_report *report)
{
    list_omitted_passes(plan, report);
    if (plan->technique->is_reference) return;
    list_omitted_parts(plan, &scene->features, report);
    if (bd_plan_has(plan, BD_STAGE_FRAGMENTS)) list_omitted_of_blocks(plan, report);
    if (plan->indirect && !plan->glossy)
        omit(report, true, glossy_pass(plan->technique), no_glossy_lobe(plan));
    if (plan->follows && !plan->rough)
        omit(report, true, pass_when(plan->technique, BD_WHEN_ROUGH), no_rough_lobe(plan, scene));
    if (plan->follows && !plan->caustics)
        omit(report, true, pass_when(plan->technique, BD_WHEN_CAUSTICS), no_caustics(plan, scene));
    if (plan->indirect && plan->technique->inputs & BD_INPUT_SCREEN)
        list_omitted_of_clamp(plan, report);
}

// Whether the technique's own rays and photons go on through glass.
static bool follows(const struct bd_plan *plan)
{
    return plan->technique->inputs & (BD_INPUT_FINAL_GATHER | BD_INPUT_PHOTONS | BD_INPUT_POINTS);
}

// Rays alone go through glass.
static bool may_look_through(const struct bd_plan *plan)
{
    const bool is_of_papers = plan->params.paper_mode &&
                              !(plan->technique->inputs & (BD_INPUT_PHOTONS | BD_INPUT_POINTS));
    if (plan->params.lambert || is_of_papers) return false;
    if (!follows(plan) && plan->params.light_rays == 0) return false;
    return !bd_plan_reads(plan, BD_PARAM_RESIDUAL) || bd_params_bring_back(&plan->params);
}

// What this frame carries of light transport: the technique's model, or what was asked of the
// reference.
static struct bd_model model_of(const struct bd_plan *plan)
{
    struct bd_model model = plan->technique->model;
    if (plan->technique->is_reference) {
        model.lights = plan->params.lights;
        model.indirect_lights = plan->params.indirect_lights;
        model.transmission = plan->params.transmission;
        model.coverage = plan->params.alpha_coverage;
    }
    if (!plan->technique->is_reference && !may_look_through(plan)) model.transmission = false;
    if (bd_plan_reads(plan, BD_PARAM_INDIRECT_BOUNCES))
        model.indirect_bounces = plan->params.indirect_bounces;
    if (!plan->technique->is_reference && plan->params.light_rays == 0)
        model.lights &= BD_LIGHTS_PUNCTUAL;
    model.indirect_lights &= model.lights;
    if (bd_plan_reads(plan, BD_PARAM_INDIRECT_VISIBILITY))
        model.indirect_visibility = plan->params.indirect_visibility != BD_VISIBILITY_NONE;
    return model;
}

// A picture of one sub-frame sees what blends or does not.
static void flag_blending(const struct bd_plan *plan, const struct bd_features *f,
                          struct bd_report *report)
{
    const bool references = plan->technique->is_reference && plan->params.alpha_coverage;
    if (!f->has_blend || references || (plan->veils && plan->blends)) return;
    bd_report_flag(report, "blend_as_mask%s",
                   plan->veils    ? ": as it is seen"
                   : plan->blends ? ": as lamps see it"
                                  : "");
}

static void flag_what_is_not_honoured(const struct bd_plan *plan, const struct bd_scene *scene,
                                      struct bd_report *report)
{
    const struct bd_features *f = &scene->features;
    const struct bd_model model = model_of(plan);
    for (uint32_t i = 0; i < scene->flags.count; i++)
        if (!plan->rig_yields || strcmp(scene->flags.text[i], "default_lights") != 0)
            bd_report_flag(report, "%s", scene->flags.text[i]);
    if (plan->unoccluded) bd_report_flag(report, "%s", BD_FLAG_UNOCCLUDED);
    flag_blending(plan, f, report);
    if (f->has_transmissive && !model.transmission)
        bd_report_flag(report, "transmission_as_opaque");
    else if (f->has_transmissive && plan->shows_glass && !plan->panes)
        bd_report_flag(report, "transmission_as_opaque: as lamps see it");
    if (plan->panes && plan->straight == BD_STRAIGHT_ALL && f->has_lens)
        bd_report_flag(report, "transmission_shadow");
    if (plan->indirect && f->has_glossy && !plan->params.lambert && !model.glossy_receivers)
        bd_report_flag(report, "glossy_as_diffuse: of indirect light");
    if (bd_plan_has(plan, BD_STAGE_RSM) && some_map_is_reduced(plan, scene))
        bd_report_flag(report, "rsm_size_reduced: %d texels a side of each VPL",
                       BD_PLAN_BLOCK_TEXELS_MAX);
    if (f->has_emissive && !(model.lights & BD_LIGHTS_EMISSIVE)) {
        double total = f->emissive_flux_lm + f->punctual_flux_lm;
        bd_report_flag(report, "emissive_not_lighting: %.3g %% of the flux",
                       total > 0 ? 100 * f->emissive_flux_lm / total : 0.0);
    }
    if (f->has_environment && !(model.lights & BD_LIGHTS_ENVIRONMENT))
        bd_report_flag(
            report, "environment_not_lighting%s",
            bd_scene_lights_yield(scene, false, true) ? ": the default lights shine instead" : "");
}

static bool has_indirect(const struct bd_plan *plan)
{
    return plan->technique->is_reference ? plan->params.bounces > 0 : plan->indirect;
}

// Light that is interpolated between blocks does not know.
static bool doubts(const struct bd_plan *plan)
{
    if (!plan->chosen)
        return bd_plan_has(plan, BD_STAGE_AREA_LIGHT) || bd_plan_has(plan, BD_STAGE_GLASS);
    return !bd_plan_has(plan, BD_STAGE_FRAGMENTS) && plan->params.rays > 1;
}

static uint32_t layers_of(const struct bd_plan *plan, const struct bd_frame_request *request)
{
    uint32_t layers = request->layers | 1u << BD_LAYER_BEAUTY;
    if (plan->doubts) layers |= BD_LAYERS_DOUBT;
    if (!plan->unoccluded || !request->auto_exposure) return layers;
    uint32_t dark = plan->technique->is_reference || plan->emission || plan->area_lights
                        ? 0
                        : 1u << BD_LAYER_EMISSION;
    return layers | (BD_LAYERS_METERED & ~dark);
}

// A sample through the pixel's centre, or several over its area.
static const char *filter_name(const struct bd_plan *plan, uint32_t aa)
{
    bool box = plan->technique->is_reference ? plan->params.filter == 1 : aa > 1;
    return box ? "box" : "point";
}

static const char *camera_name(const struct bd_scene *scene, int32_t placed_camera)
{
    const struct bd_placement *camera = &scene->placed_cameras[placed_camera];
    return camera->node != BD_NONE ? scene->nodes[camera->node].name
                                   : scene->cameras[camera->object].name;
}

static void describe_request(const struct bd_plan *plan, const struct bd_scene *scene,
                             const struct bd_frame_request *request, struct bd_report *report)
{
    char hex[BD_SHA256_HEX];
    bd_sha256_hex(scene->content_sha256, hex);
    snprintf(report->scene, sizeof report->scene, "sha256:%s", hex);
    report->width_px = request->width_px;
    report->height_px = request->height_px;
    snprintf(report->camera, sizeof report->camera, "%s",
             request->pose.is_set ? "pose" : camera_name(scene, plan->camera));
    snprintf(report->technique, sizeof report->technique, "%s", plan->technique->name);
    bd_params_write(&plan->params, plan->technique, &report->params);
    report->seed = request->seed;
    report->aa = request->aa;
    snprintf(report->filter, sizeof report->filter, "%s", filter_name(plan, request->aa));
    memcpy(report->region, request->region, sizeof report->region);
    report->counts.lights = plan->rig_yields ? 0 : scene->placed_light_count;
    report->counts.triangles = scene->features.triangle_count;
}

static bool asks(const struct bd_plan *plan, enum bd_visibility whom)
{
    return bd_plan_reads(plan, BD_PARAM_INDIRECT_VISIBILITY) &&
           plan->params.indirect_visibility == whom;
}

// Instead of triangles.
static bool asks_images(const struct bd_plan *plan)
{
    return plan->technique->inputs & BD_INPUT_PHOTONS &&
           plan->params.intersections == BD_INTERSECTIONS_IMAGES;
}

// Whether who looks for lights looks through glass. Who follows light round lenses leaves those
// out. Images know of no triangles behind each other.
static bool looks_straight(const struct bd_plan *plan, const struct bd_features *features)
{
    const bool has_any =
        features->has_pane || (plan->straight == BD_STRAIGHT_ALL && features->has_lens);
    return has_any && may_look_through(plan) && may_be_by_rays(plan) && !asks_images(plan);
}

static bool looks_through_veils(const struct bd_plan *plan, const struct bd_features *features)
{
    return features->has_blend && plan->params.alpha_coverage && may_be_by_rays(plan) &&
           !plan->params.paper_mode && !asks_images(plan);
}

// --- the plan -------------------------------------------------------------------------------

static enum bd_err find_camera(const struct bd_scene *scene, const char *name, int32_t *out,
                               struct bd_err_detail *detail)
{
    *out = bd_scene_find_camera(scene, name);
    if (*out != BD_NONE) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_USAGE, "camera",
                      "%.63s: no such camera; the scene has %u, by index or by name", name,
                      scene->placed_camera_count);
}

static void flag_namesakes(const struct bd_scene *scene, const char *camera,
                           struct bd_report *report)
{
    int32_t first;
    uint32_t count = camera[0] ? bd_scene_count_cameras(scene, camera, &first) : 1;
    if (count > 1)
        bd_report_flag(report, "camera_ambiguous: the first of %u of that name; name it by index",
                       count);
}

static bool anything_shines(const struct bd_scene *scene)
{
    const struct bd_plan all = {0};
    const struct bd_features *f = &scene->features;
    return f->has_emissive || f->has_environment || count_lights(&all, scene) > 0;
}

// `auto` has no use for indirect light where no light is.
static const struct bd_technique *technique_of(const struct bd_scene *scene,
                                               const struct bd_frame_request *request,
                                               struct bd_err_detail *detail)
{
    if (bd_technique_is_auto(request->technique) && !anything_shines(scene) &&
        bd_params_are_read(&request->params, &bd_technique_direct))
        return &bd_technique_direct;
    return bd_technique_for(request->technique, &request->params, detail);
}

enum bd_err bd_plan_make(const struct bd_scene *scene, const struct bd_frame_request *request,
                         struct bd_plan *out, struct bd_report *report,
                         struct bd_err_detail *detail)
{
    memset(out, 0, sizeof *out);
    memset(report, 0, sizeof *report);
    out->technique = technique_of(scene, request, detail);
    if (!out->technique) return BD_ERR_USAGE;
    enum bd_err err = bd_params_read(&request->params, out->technique, &out->params, detail);
    if (!err) err = find_camera(scene, request->camera, &out->camera, detail);
    if (err) return err;

    const struct bd_features *f = &scene->features;
    const uint32_t lights = model_of(out).lights;
    out->rig_yields = bd_scene_lights_yield(scene, (lights & BD_LIGHTS_EMISSIVE) != 0,
                                            (lights & BD_LIGHTS_ENVIRONMENT) != 0);
    const bool renders = !out->technique->is_reference;
    out->emitters = renders && f->has_emissive && lights & BD_LIGHTS_EMISSIVE;
    out->sky = renders && f->has_environment && lights & BD_LIGHTS_ENVIRONMENT;
    out->area_lights = out->emitters || out->sky;
    out->light_count = count_lights(out, scene);
    out->straight = follows(out) ? BD_STRAIGHT_PANES : BD_STRAIGHT_ALL;
    out->panes = looks_straight(out, f);
    out->veils = renders && looks_through_veils(out, f);
    out->punctuals_by_rays = are_by_rays(out, scene, request);
    const bool reflects = out->technique->indirect != NULL;
    const bool reflects_areas = reflects && out->area_lights &&
                                model_of(out).indirect_lights & ~(uint32_t)BD_LIGHTS_PUNCTUAL;
    out->indirect = reflects_areas || (reflects && out->light_count > 0);
    out->bounces = model_of(out).indirect_bounces;
    const bool is_clamped = out->indirect && out->technique->inputs & BD_INPUT_SCREEN;
    out->short_rays = is_clamped && bd_params_bring_back(&out->params);
    out->final_gather = out->indirect && out->technique->inputs & BD_INPUT_FINAL_GATHER;
    out->photons = out->indirect && out->technique->inputs & BD_INPUT_PHOTONS;
    out->points = out->indirect && out->technique->inputs & BD_INPUT_POINTS;
    out->follows = out->final_gather || out->photons || out->points;
    out->light_paths = !out->photons && !out->points &&
                       (reflects_areas || out->final_gather ||
                        (out->indirect && (out->bounces > 1 || out->punctuals_by_rays)));
    out->glass = renders && f->has_transmissive && model_of(out).transmission;
    out->shows_glass = out->glass && !follows(out) && (out->area_lights || out->light_count > 0);
    out->goes_on =
        follows(out) && model_of(out).transmission && (f->has_transmissive || f->has_mirror);
    out->from_screen = is_clamped && bd_params_give_back(&out->params, out->goes_on);
    out->glossy = out->indirect && out->technique->model.glossy_receivers && !out->params.lambert &&
                  (f->has_glossy || (out->glass && follows(out)));
    out->rough = out->follows && !out->params.lambert && f->has_rough && !leaves_rough(out) &&
                 (out->short_rays || !(out->technique->inputs & BD_INPUT_SCREEN)) &&
                 out->params.far_rays >= BD_FAR_RAYS_FOR_ROUGH;
    out->caustics = out->follows && out->goes_on && out->params.caustics &&
                    (out->light_count > 0 || out->emitters);
    out->flux_lm = total_flux_lm(out, scene);
    out->images = out->photons && asks_images(out);
    out->rays = out->indirect && !out->images && (out->follows || asks(out, BD_VISIBILITY_RAYS));
    out->imperfect = out->indirect && asks(out, BD_VISIBILITY_ISM);
    const bool asked = (out->rays || out->imperfect) && !out->photons && !out->points;
    out->chosen = out->final_gather || (asked && out->params.rays < count_vpls(out, scene) &&
                                        out->params.rays <= BD_RAYS_CHOSEN_MAX);
    const bool is_noisy = (out->chosen && out->params.rays > 1) ||
                          (out->photons && (out->glossy || out->rough)) || out->points;
    out->filtered = is_noisy && out->params.noise_filter;
    const bool may_share =
        out->indirect && bd_technique_shares(out->technique, &out->params, out->glossy);
    out->block_px = may_share ? bd_plan_block_px(out->technique, &out->params, request->width_px,
                                                 request->height_px, request->aa)
                              : 1;
    out->shared = may_share && (request->aa > 1 || out->block_px > 1);
    out->blends = f->has_blend && renders && request->aa > 1 && !out->params.paper_mode;
    out->normal_maps = f->has_normal_map;
    out->emission = f->has_emissive || f->has_unlit;
    out->unoccluded = has_indirect(out) && !model_of(out).indirect_visibility;
    out->triangle_count = f->triangle_count;
    out->tracing = tracing_of(out);
    for (enum bd_stage stage = 0; stage < BD_STAGE_COUNT; stage++)
        if (bd_stage_rows[stage].is_needed(out)) out->stages |= 1u << stage;
    out->in_rounds =
        out->chosen || out->follows || out->shows_glass || bd_plan_has(out, BD_STAGE_AREA_LIGHT);
    out->doubts = doubts(out);
    out->layers = layers_of(out, request);
    out->traced_stages = traced_stages_of(out, scene, request);
    report->unoccluded = out->unoccluded;
    describe_request(out, scene, request, report);
    if (out->indirect && !out->photons && !out->points)
        report->counts.vpls = count_vpls(out, scene);
    list_passes(out, report);
    list_omitted(out, scene, report);
    flag_what_is_not_honoured(out, scene, report);
    flag_namesakes(scene, request->camera, report);
    return BD_ERR_OK;
}

// By its logarithm; at least 1.
static uint32_t nearest_power_of_two(double number)
{
    return 1u << (uint32_t)fmax(round(log2(fmax(number, 1))), 0);
}

static uint32_t tree_root_side(double roots, uint32_t leaf_side)
{
    uint32_t side = nearest_power_of_two(sqrt(roots));
    while (leaf_side / side > BD_TREE_ROOT_LEAVES_MAX) side *= 2;
    return side < leaf_side ? side : leaf_side;
}

// Of all VPLs. Light paths have a share of their own unless it is told.
static double vpl_budget_of(const struct bd_plan *plan)
{
    const struct bd_params *params = &plan->params;
    const double shares = VPL_BUDGET_SHARES + (plan->light_paths ? 1 : 0);
    return params->vpl_budget ? params->vpl_budget : shares * params->vpls;
}

// As many as a light has, and at most a quarter of the budget where punctual lights are there, too.
uint32_t bd_plan_light_path_count(const struct bd_plan *plan)
{
    if (!plan->light_paths) return 0;
    if (plan->final_gather && !plan->sky) return 0;
    const bool has_maps = plan->light_count > 0 && !plan->punctuals_by_rays;
    const double share = vpl_budget_of(plan) / (has_maps ? 4 : 1);
    const double most =
        fmin(share, plan->punctuals_by_rays ? BD_LIGHT_PATHS_OF_PUNCTUALS_MAX : BD_LIGHT_PATHS_MAX);
    const double count = fmax(fmin(plan->params.vpls, most), 1);
    if (!(plan->technique->inputs & BD_INPUT_VPL_TREE)) return (uint32_t)count;
    const uint32_t side = nearest_power_of_two(sqrt(count));
    return side * side;
}

uint32_t bd_plan_photon_vpl_count(const struct bd_plan *plan)
{
    return plan->final_gather ? plan->params.vpls : 0;
}

uint32_t bd_plan_light_path_root_side(const struct bd_plan *plan)
{
    const uint32_t leaf_side = (uint32_t)lround(sqrt(bd_plan_light_path_count(plan)));
    if (leaf_side == 0 || !(plan->technique->inputs & BD_INPUT_VPL_TREE)) return 0;
    return tree_root_side(plan->params.tree_roots, leaf_side);
}

// Each light has as many as asked for, up to a budget of all; beyond it they are split by flux.
// Papers know lights one by one.
static double vpls_of(const struct bd_plan *plan, const struct bd_light_setup *light)
{
    const struct bd_params *params = &plan->params;
    if (params->vpl_budget == 0 && params->paper_mode) return params->vpls;
    const double budget = vpl_budget_of(plan) - bd_plan_light_path_count(plan);
    if (plan->light_count * (double)params->vpls <= budget || !(plan->flux_lm > 0))
        return params->vpls;
    return budget * light->flux_lm / plan->flux_lm;
}

uint32_t bd_plan_grid_side(const struct bd_plan *plan, const struct bd_light_setup *light)
{
    const double side = sqrt(vpls_of(plan, light) / light->face_count);
    if (plan->technique->inputs & (BD_INPUT_VPL_CLUSTERS | BD_INPUT_VPL_TREE))
        return nearest_power_of_two(side);
    return side > 1 ? (uint32_t)round(side) : 1;
}

uint32_t bd_plan_clusters_most(const struct bd_plan *plan, const struct bd_light_setup *light,
                               uint32_t grid_side)
{
    if (plan->params.vpl_budget == 0 || !(plan->flux_lm > 0)) return 0;
    const double budget = vpl_budget_of(plan) - bd_plan_light_path_count(plan);
    const double least = (double)grid_side * grid_side * light->face_count;
    return (uint32_t)fmax(budget * light->flux_lm / plan->flux_lm, least);
}

uint32_t bd_plan_tree_root_side(const struct bd_plan *plan, const struct bd_light_setup *light,
                                uint32_t grid_side)
{
    return tree_root_side((double)plan->params.tree_roots / light->face_count, grid_side);
}

uint32_t bd_plan_rsm_size(const struct bd_plan *plan, const struct bd_light_setup *light,
                          uint32_t grid_side)
{
    uint64_t most = (uint64_t)grid_side * BD_PLAN_BLOCK_TEXELS_MAX;
    // A light that has fewer VPLs for its budget keeps the texels of each.
    const double share = fmin(vpls_of(plan, light) / plan->params.vpls, 1);
    const uint32_t asked = (uint32_t)ceil(plan->params.rsm_size * sqrt(share));
    if (asked < grid_side) return grid_side;
    return asked > most ? (uint32_t)most : asked;
}

static bool is_native_by_itself(bool device_is_software)
{
    const char *forced = getenv("BD_EXECUTOR");
    return forced ? strcmp(forced, "native") == 0 : device_is_software;
}

// Other devices draw faster than the processor traces.
static void place_tracing(struct bd_plan *plan, bool device_is_software, struct bd_report *report)
{
    if (!device_is_software && plan->tracing == BD_TRACING_WHERE_MANY) {
        plan->tracing = BD_TRACING_NONE;
        plan->traced_stages = 0;
    }
    for (enum bd_stage stage = 0; stage < BD_STAGE_COUNT; stage++)
        omit(report, plan->traced_stages >> stage & 1, bd_stage_rows[stage].pass,
             "drawing triangles: rays find those that are seen");
}

void bd_plan_place(struct bd_plan *plan, bool device_is_software, struct bd_report *report)
{
    place_tracing(plan, device_is_software, report);
    if (!bd_plan_reads(plan, BD_PARAM_EXECUTOR)) return;
    const enum bd_executor asked = (enum bd_executor)plan->params.executor;
    plan->native = asked == BD_EXECUTOR_NATIVE ||
                   (asked == BD_EXECUTOR_AUTO && is_native_by_itself(device_is_software));
    snprintf(report->executor, sizeof report->executor, "%s", plan->native ? "native" : "device");
}
