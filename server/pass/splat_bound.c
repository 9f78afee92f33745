#include "pass/splat_bound.h"

#include <math.h>

#include "base/assert.h"
#include "pass/kernels.h"
#include "shared/bindings.h"
#include "shared/splat.h"

// Powers of two between which the bound lies: the scene is about one wide and its lights about one
// strong, and the dimmest VPL that is worth a thought is 2^-60 of that.
#define BOUND_LOG2_MIN (-96.0)
#define BOUND_LOG2_MAX 64.0
// Each takes a 64th of what is left: 160 octaves to 1e-5.
#define ROUNDS 4
// At most, of one trial: 4 million areas.
#define VPLS_PER_DISPATCH 65536u
// Of the slicer, one for each evaluation of a VPL; for each bound.
#define UNITS_PER_AREA 0.5

_Static_assert(VPLS_PER_DISPATCH % BD_SPLAT_TRIAL_VPLS == 0, "whole work groups");
_Static_assert(BD_SPLAT_BOUNDS == 64, "what ROUNDS counts on");

struct search {
    const struct bd_pass_context *context;
    const struct bd_gather_inputs *inputs;
    const struct bd_program *program;
    struct bd_view view;
    struct bd_buf *sums;
    uint64_t wanted;
};

static void dispatch(const struct search *s, const struct bd_vpl_list *list,
                     const struct bd_splat_trial_args *args)
{
    struct bd_bindings bindings = {0};
    bindings.arrays[BD_UNIT_VPLS] = list->vpls;
    bindings.storage[0].buf = s->sums;
    bindings.storage[0].read = bindings.storage[0].write = true;
    bindings.uniforms[BD_UNIFORM_VIEW].bytes = &s->view;
    bindings.uniforms[BD_UNIFORM_VIEW].size_bytes = sizeof s->view;
    bindings.uniforms[BD_UNIFORM_ARGS].bytes = args;
    bindings.uniforms[BD_UNIFORM_ARGS].size_bytes = sizeof *args;
    uint32_t groups = (args->vpl_count + BD_SPLAT_TRIAL_VPLS - 1) / BD_SPLAT_TRIAL_VPLS;
    bd_gpu_dispatch(s->context->gpu, s->program, &bindings, groups, 1, 1);
}

static enum bd_err try_on_list(const struct search *s, const struct bd_vpl_list *list,
                               struct bd_splat_trial_args *args)
{
    const double units_per_group = UNITS_PER_AREA * BD_SPLAT_BOUNDS * BD_SPLAT_TRIAL_VPLS;
    bd_slicer_work(s->context->slicer, "splat_bound");
    for (uint32_t at = 0; at < list->count;) {
        uint32_t groups_left = bd_divided_up(list->count - at, BD_SPLAT_TRIAL_VPLS);
        uint32_t groups = bd_slicer_rows(s->context->slicer, units_per_group, groups_left);
        uint32_t most = groups * BD_SPLAT_TRIAL_VPLS, left = list->count - at;
        if (most > VPLS_PER_DISPATCH) most = VPLS_PER_DISPATCH;
        args->first_vpl = at;
        args->vpl_count = left < most ? left : most;
        dispatch(s, list, args);
        at += args->vpl_count;
        enum bd_err err = bd_slicer_checkpoint(s->context->slicer, units_per_group * groups);
        if (err) return err;
    }
    return BD_ERR_OK;
}

// Fragments of all lists' splats, for each of the bounds.
static enum bd_err try_bounds(const struct search *s, const float bounds[BD_SPLAT_BOUNDS],
                              uint64_t counts[BD_SPLAT_BOUNDS])
{
    struct bd_splat_trial_args args = {0};
    for (int i = 0; i < BD_SPLAT_BOUNDS / 4; i++)
        args.bounds[i] = (struct bd_vec4){bounds[4 * i], bounds[4 * i + 1], bounds[4 * i + 2],
                                          bounds[4 * i + 3]};
    bd_buf_clear(s->context->gpu, s->sums);
    for (uint32_t i = 0; i < s->inputs->list_count; i++) {
        enum bd_err err = try_on_list(s, s->inputs->lists[i], &args);
        if (err) return err;
    }
    uint32_t halves[2 * BD_SPLAT_BOUNDS];
    enum bd_err err = bd_buf_read(s->context->gpu, s->sums, 0, halves, sizeof halves);
    for (int i = 0; i < BD_SPLAT_BOUNDS; i++)
        counts[i] = (uint64_t)halves[2 * i + 1] << 32 | halves[2 * i];
    return err;
}

// Narrows [low, high], powers of two, to the step at whose end the splats are few enough.
static enum bd_err narrow(const struct search *s, double *low, double *high,
                          struct bd_splat_bound *out)
{
    float bounds[BD_SPLAT_BOUNDS];
    uint64_t counts[BD_SPLAT_BOUNDS];
    double step = (*high - *low) / BD_SPLAT_BOUNDS;
    for (int i = 0; i < BD_SPLAT_BOUNDS; i++) bounds[i] = (float)exp2(*low + step * (i + 1));
    enum bd_err err = try_bounds(s, bounds, counts);
    if (err) return err;
    int first = 0;
    while (first < BD_SPLAT_BOUNDS - 1 && counts[first] > s->wanted) first++;
    *out = (struct bd_splat_bound){bounds[first], counts[first]};
    *high = *low + step * (first + 1);
    *low = *high - step;
    return BD_ERR_OK;
}

static enum bd_err narrow_down(const struct search *s, struct bd_splat_bound *out)
{
    double low = BOUND_LOG2_MIN, high = BOUND_LOG2_MAX;
    for (int round = 0; round < ROUNDS; round++) {
        enum bd_err err = narrow(s, &low, &high, out);
        if (err) return err;
    }
    return BD_ERR_OK;
}

static enum bd_err count_without_bound(const struct search *s, struct bd_splat_bound *out)
{
    static const float none[BD_SPLAT_BOUNDS];
    uint64_t counts[BD_SPLAT_BOUNDS];
    enum bd_err err = try_bounds(s, none, counts);
    *out = (struct bd_splat_bound){0, counts[0]};
    return err;
}

static uint64_t all_vpls(const struct bd_gather_inputs *inputs)
{
    uint64_t count = 0;
    for (uint32_t i = 0; i < inputs->list_count; i++) count += inputs->lists[i]->count;
    return count;
}

enum bd_err bd_splat_bound_find(const struct bd_pass_context *context,
                                const struct bd_gather_inputs *inputs, double share,
                                struct bd_splat_bound *out, struct bd_err_detail *detail)
{
    BD_ASSERT(share > 0 && share <= 1);
    const struct bd_program_source source = {.compute = "pass/splat/splat_trial.comp"};
    struct bd_program *program;
    struct search s = {
        .context = context,
        .inputs = inputs,
        .view = bd_viewpoint_uniform(inputs->viewpoint, &inputs->scene->space),
    };
    double pixels = (double)s.view.size_px.x * s.view.size_px.y;
    s.wanted = (uint64_t)(share * pixels * (double)all_vpls(inputs));
    enum bd_err err = bd_program_get(context->gpu, &source, &program, detail);
    if (err) return err;
    s.program = program;
    err = bd_buf_create(context->gpu, "splat sums", 2 * BD_SPLAT_BOUNDS * sizeof(uint32_t), NULL,
                        &s.sums, detail);
    if (!err) err = share < 1 ? narrow_down(&s, out) : count_without_bound(&s, out);
    bd_buf_destroy(context->gpu, &s.sums);
    return err;
}
