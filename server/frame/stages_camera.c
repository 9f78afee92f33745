// How what is made for each sub-frame, of what the camera sees, is run.

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/hash.h"
#include "frame/stages.h"
#include "frame/sub_frames.h"
#include "pass/area_direct.h"
#include "pass/upsample.h"
#include "technique/glass_light.h"
#include "technique/sub_frame_light.h"

enum bd_err bd_run_gbuffer(struct bd_frame *frame, struct bd_frame_light *light)
{
    (void)light;
    const struct bd_viewpoint *viewpoint = &frame->subject.viewpoint;
    const struct bd_gbuffer_inputs inputs = {
        .scene = frame->scene,
        .viewpoint = viewpoint,
        .lambert = frame->plan->params.lambert,
        .emission = frame->plan->emission,
        .glass = frame->plan->glass,
        .tracer = bd_stage_tracer(frame, (uint64_t)viewpoint->width_px * viewpoint->height_px),
    };
    return bd_gbuffer_render(&frame->context, &inputs, &frame->made.gbuffer, frame->detail);
}

enum bd_err bd_run_direct(struct bd_frame *frame, struct bd_frame_light *light)
{
    (void)light;
    const struct bd_subject *subject = &frame->subject;
    struct bd_direct_light *lights = calloc(subject->light_count + 1, sizeof *lights);
    BD_ASSERT(lights);
    for (uint32_t i = 0; i < subject->light_count; i++)
        lights[i] =
            (struct bd_direct_light){&subject->lights[i].setup, subject->lights[i].shadow_map};
    const struct bd_direct_inputs inputs = {
        .scene = frame->scene,
        .viewpoint = &subject->viewpoint,
        .gbuffer = frame->made.gbuffer,
        .lights = lights,
        .light_count = subject->light_count,
        .lambert = frame->plan->params.lambert,
        .irradiance = frame->plan->from_screen,
    };
    enum bd_err err = bd_direct_run(&frame->context, &inputs, &frame->made.direct, frame->detail);
    free(lights);
    return err;
}

// A quarter of the rays for sub-frames behind the first, whose noise is added up with theirs; each
// goes by numbers of its own.
#define LATER_SHARE 4u

static uint64_t seed_of_sub_frame(const struct bd_subject *subject)
{
    const double sample_px[2] = {subject->viewpoint.sample_x_px, subject->viewpoint.sample_y_px};
    return bd_key_bytes(bd_key_number(bd_key_begin("area"), subject->seed), sample_px,
                        sizeof sample_px);
}

// Of a round's noise, that its filters go by. In the mean over N rounds noise is left as 1 /
// sqrt(N) and blur stays, unless later rounds smooth less. 16 rays, side spot, 16 rounds: indirect
// light 3.59 % off with the filter as it is, 2.65 without, 2.73, 2.49 and 2.35 with powers 1, 2
// and 3.
static float part_of_round(const struct bd_frame *frame)
{
    const float rounds = (float)(frame->subject.round + 1);
    return 1 / (rounds * rounds * rounds);
}

// The same of what each sub-frame has rays of its own for.
static float part_of_sub_frame(const struct bd_frame *frame)
{
    return 1 / (float)(frame->subject.round * BD_SUB_FRAMES_OF_ROUND + 1);
}

static uint32_t light_rays_of(const struct bd_frame *frame)
{
    const struct bd_viewpoint *v = &frame->subject.viewpoint;
    const uint32_t rays = frame->plan->params.light_rays;
    const bool is_first = v->sample_x_px == 0.5 && v->sample_y_px == 0.5;
    const uint32_t later = rays / LATER_SHARE & ~1u;
    return is_first ? rays : later ? later : 2;
}

struct bd_visibility_inputs bd_stage_light_visibility(const struct bd_frame *frame)
{
    const struct bd_plan *plan = frame->plan;
    return (struct bd_visibility_inputs){
        .occluders = frame->occluders,
        .pool = bd_renderer_pool(frame->renderer),
        .alpha = plan->params.alpha_coverage ? BD_RAYS_ALPHA_COVERAGE : BD_RAYS_ALPHA_MASK,
        .panes = plan->panes ? &frame->panes : NULL,
        .straight = plan->straight,
        .veils = plan->veils,
    };
}

enum bd_err bd_run_area_light(struct bd_frame *frame, struct bd_frame_light *light)
{
    (void)light;
    const struct bd_plan *plan = frame->plan;
    const struct bd_area_direct_inputs inputs = {
        .scene = frame->scene,
        .viewpoint = &frame->subject.viewpoint,
        .gbuffer = frame->made.gbuffer,
        .lights = frame->emitters,
        .punctuals = frame->lamps,
        .visibility = bd_stage_light_visibility(frame),
        .rays = light_rays_of(frame),
        .seed = seed_of_sub_frame(&frame->subject),
        .lambert = plan->params.lambert,
        .filtered = plan->params.noise_filter,
        .irradiance = plan->from_screen,
        .variance_part = part_of_sub_frame(frame),
    };
    return bd_area_direct_run(&frame->context, &inputs, &frame->made.area_light, frame->detail);
}

static struct bd_discontinuity_inputs discontinuity_inputs(const struct bd_frame *frame)
{
    const struct bd_params *params = &frame->plan->params;
    return (struct bd_discontinuity_inputs){
        .gbuffer = frame->made.gbuffer,
        .viewpoint = &frame->subject.viewpoint,
        .space = &frame->scene->space,
        .settings =
            {
                .depth_test = (enum bd_depth_test)params->depth_test,
                .normal_test = (enum bd_normal_test)params->normal_test,
                .neighbourhood = (enum bd_neighbourhood)params->neighbourhood,
                .depth_threshold = params->depth_threshold,
                .normal_threshold = params->normal_threshold,
                // What the pixel's own normal adds is put back at every pixel.
                .geometric_normals = params->surface_detail == BD_SURFACE_DETAIL_DIRECTION,
                .coarsest_side = params->coarsest,
                .finest_level = params->finest_level,
                .lone_pixels = true,
            },
    };
}

enum bd_err bd_run_discontinuity(struct bd_frame *frame, struct bd_frame_light *light)
{
    (void)light;
    const struct bd_discontinuity_inputs inputs = discontinuity_inputs(frame);
    return bd_discontinuity_run(&frame->context, &inputs, &frame->made.discontinuity,
                                frame->detail);
}

enum bd_err bd_run_fragments(struct bd_frame *frame, struct bd_frame_light *light)
{
    (void)light;
    const struct bd_discontinuity_inputs inputs = discontinuity_inputs(frame);
    return bd_fragments_run(&frame->context, &inputs, frame->made.discontinuity,
                            BD_REFINEMENT_ONE_PASS, &frame->made.fragments, frame->detail);
}

enum bd_err bd_run_surfaces(struct bd_frame *frame, struct bd_frame_light *light)
{
    (void)light;
    const struct bd_discontinuity_inputs inputs = discontinuity_inputs(frame);
    return bd_surfaces_run(&frame->context, &inputs, frame->made.discontinuity,
                           &frame->made.surfaces, frame->detail);
}

// Calls `run` with what a technique is given of the frame.
static enum bd_err with_inputs(struct bd_frame *frame,
                               enum bd_err (*run)(struct bd_frame *frame,
                                                  const struct bd_technique_inputs *inputs))
{
    const uint32_t most = bd_stage_lists_most(frame);
    const struct bd_vpl_list **lists = calloc(most, sizeof *lists);
    const struct bd_vpl_list **gathered = calloc(most, sizeof *gathered);
    const struct bd_vpl_tree **trees = calloc(most, sizeof *trees);
    BD_ASSERT(lists && gathered && trees);
    const uint32_t count = bd_stage_lists(frame, lists);
    bd_stage_gathered_lists(frame, gathered);
    bd_stage_trees(frame, trees);
    const struct bd_imperfect_view maps = {
        .shadows = frame->imperfect_shadows,
        .points = frame->shadow_points,
        .lists = gathered,
        .bias = (float)frame->plan->params.ism_bias,
        .filled = frame->plan->params.ism_holes,
    };
    const struct bd_env_view images = {frame->env_maps, frame->plan->params.paper_mode};
    struct bd_light_uniform *punctuals =
        frame->plan->follows || frame->plan->shows_glass ? bd_stage_punctuals(frame) : NULL;
    const struct bd_first_light first_light = {
        .lights = frame->emitters,
        .punctuals = punctuals,
        .punctual_count = punctuals ? frame->subject.light_count : 0,
        .space = &frame->scene->space,
    };
    const struct bd_technique_inputs inputs = {
        .scene = frame->scene,
        .viewpoint = &frame->subject.viewpoint,
        .made = frame->made,
        .params = &frame->plan->params,
        .vpl_lists = lists,
        .vpl_trees = trees,
        .vpls_in_order = frame->order,
        .list_count = count,
        .light_paths = frame->light_paths,
        .photons = frame->photons,
        .points = frame->points,
        .first_light = &first_light,
        .snapshot = frame->snapshot,
        .occluders = frame->plan->rays ? frame->occluders : NULL,
        .maps = maps.shadows ? &maps : NULL,
        .images = images.maps ? &images : NULL,
        .panes = frame->plan->panes ? &frame->panes : NULL,
        .straight = frame->plan->straight,
        .veils = frame->plan->veils,
        .pool = frame->renderer->pool,
        .chosen = frame->plan->chosen,
        .filtered = frame->plan->filtered,
        .variance_part = part_of_round(frame),
        .seed = frame->subject.seed,
        .seed_of_sub_frame = seed_of_sub_frame(&frame->subject),
        .alone = frame->subject.alone,
        .glossy_receivers = frame->plan->glossy,
        .rough_receivers = frame->plan->rough,
        .glass = frame->plan->goes_on,
        .normal_maps = frame->plan->normal_maps,
    };
    enum bd_err err = run(frame, &inputs);
    free(punctuals);
    free(lists);
    free(gathered);
    free(trees);
    return err;
}

static enum bd_err light_indirectly(struct bd_frame *frame,
                                    const struct bd_technique_inputs *inputs)
{
    return frame->plan->technique->indirect(&frame->context, inputs, &frame->made.indirect,
                                            frame->detail);
}

static enum bd_err share_light(struct bd_frame *frame, const struct bd_technique_inputs *inputs)
{
    struct bd_technique_inputs own = *inputs;
    const struct bd_first_sub_frame first = {&frame->first.viewpoint, frame->first.blocks,
                                             frame->first.gbuffer, frame->first.indirect};
    own.variance_part = part_of_sub_frame(frame);
    return bd_sub_frame_light(&frame->context, frame->plan->technique, &own, &first,
                              &frame->made.indirect, frame->detail);
}

enum bd_err bd_run_indirect(struct bd_frame *frame, struct bd_frame_light *light)
{
    (void)light;
    return with_inputs(frame, light_indirectly);
}

// Of a sub-frame that shares light: its missing pixels are lit by themselves, and so are lobes.
// Both may choose and ask, lobes not where rays of theirs bring all; neither upsamples.
static bool has_lit_by(const struct bd_frame *frame, const struct bd_technique_pass *pass)
{
    const bool lights = frame->made.indirect->fragment_count > 0, lobes = frame->plan->glossy;
    if (pass->when & BD_WHEN_FIRST) return false;
    if (pass->when & (BD_WHEN_GLOSSY | BD_WHEN_FILTERED)) return lobes;
    if (pass->when) return lights || (lobes && !frame->plan->follows);
    return lights && strcmp(pass->name, bd_technique_light_pass(frame->plan->technique)) == 0;
}

enum bd_err bd_run_share(struct bd_frame *frame, struct bd_frame_light *light)
{
    (void)light;
    const struct bd_technique *technique = frame->plan->technique;
    enum bd_err err = with_inputs(frame, share_light);
    if (err) return err;
    for (const struct bd_technique_pass *pass = technique->passes; pass->name; pass++)
        if (has_lit_by(frame, pass)) bd_stage_mark(frame, pass->name, BD_PASS_RAN);
    return BD_ERR_OK;
}

// For glass of a pixel as many as a quarter of those that it has for lights: each end asks lights
// itself.
#define GLASS_SHARE 4u

static enum bd_err show_glass(struct bd_frame *frame, const struct bd_technique_inputs *inputs)
{
    const struct bd_visibility_inputs visibility = bd_stage_light_visibility(frame);
    const uint32_t rays = light_rays_of(frame) / GLASS_SHARE & ~1u;
    return bd_glass_light(&frame->context, inputs, &visibility, rays ? rays : 2, &frame->made.glass,
                          frame->detail);
}

enum bd_err bd_run_glass(struct bd_frame *frame, struct bd_frame_light *light)
{
    (void)light;
    return with_inputs(frame, show_glass);
}

void bd_stage_forget_camera_side(struct bd_frame *frame)
{
    for (int i = 0; i < BD_STAGE_COUNT; i++)
        if (frame->keys[i]) bd_memo_forget(frame->renderer->memo, frame->keys[i]);
    bd_stage_leave_camera_side(frame);
}

void bd_stage_leave_camera_side(struct bd_frame *frame)
{
    memset(frame->keys, 0, sizeof frame->keys);
    frame->made = (struct bd_made){0};
}
