#include "pass/nearest.h"

#include "base/clock.h"
#include "pass/ray_walks.h"

static enum bd_err ask_processor(const struct bd_pass_context *context,
                                 const struct bd_visibility_inputs *inputs,
                                 const struct bd_ray *rays, size_t count, struct bd_ray_hit *hits,
                                 struct bd_ray_counts *traced)
{
    enum bd_err err = BD_ERR_OK;
    bd_slicer_work(context->slicer, "nearest");
    for (size_t at = 0, part; !err && at < count; at += part) {
        part = bd_rays_of_slice(context->slicer, count - at);
        const uint64_t start_ns = bd_clock_ns();
        bd_rays_nearest(inputs->occluders->rays, inputs->pool, inputs->alpha, rays + at, part,
                        hits + at);
        traced->count += part;
        traced->ms += bd_ms_since(start_ns);
        err = bd_slicer_checkpoint(context->slicer, (double)part);
    }
    return err;
}

// --- the device ---------------------------------------------------------------------------------

#define AT_ONCE (BD_SEGMENTS_BYTES_MAX / sizeof(struct bd_ray))

static enum bd_err ask_part(const struct bd_pass_context *context,
                            const struct bd_ray_walks_inputs *walk, struct bd_ray_walks *walks,
                            const struct bd_ray *rays, struct bd_ray_hit *hits,
                            struct bd_ray_counts *traced, struct bd_err_detail *detail)
{
    bd_buf_upload(context->gpu, walk->asked, 0, rays, walk->count * sizeof *rays);
    enum bd_err err = bd_ray_walks_run(context, walk, walks, traced, detail);
    if (!err) err = bd_buf_read(context->gpu, walk->answers, 0, hits, walk->count * sizeof *hits);
    return err;
}

static enum bd_err ask_device(const struct bd_pass_context *context,
                              const struct bd_visibility_inputs *inputs, const struct bd_ray *rays,
                              size_t count, struct bd_ray_hit *hits, struct bd_ray_counts *traced,
                              struct bd_err_detail *detail)
{
    struct bd_gpu *gpu = context->gpu;
    struct bd_ray_walks walks = {0};
    struct bd_ray_walks_inputs walk = {.question = BD_RAY_QUESTION_NEAREST,
                                       .occluders = inputs->occluders,
                                       .alpha = inputs->alpha,
                                       .count_max = count < AT_ONCE ? count : AT_ONCE};
    enum bd_err err =
        bd_buf_create_unset(gpu, "rays", walk.count_max * sizeof *rays, &walk.asked, detail);
    if (!err)
        err =
            bd_buf_create_unset(gpu, "hits", walk.count_max * sizeof *hits, &walk.answers, detail);
    for (size_t at = 0; !err && at < count; at += walk.count) {
        walk.count = count - at < AT_ONCE ? count - at : AT_ONCE;
        err = ask_part(context, &walk, &walks, rays + at, hits + at, traced, detail);
    }
    bd_ray_walks_finish(gpu, &walks);
    bd_buf_destroy(gpu, &walk.asked);
    bd_buf_destroy(gpu, &walk.answers);
    return err;
}

enum bd_err bd_nearest_ask(const struct bd_pass_context *context,
                           const struct bd_visibility_inputs *inputs, const struct bd_ray *rays,
                           size_t count, struct bd_ray_hit *hits, struct bd_ray_counts *traced,
                           struct bd_err_detail *detail)
{
    if (count == 0) return BD_ERR_OK;
    if (inputs->images)
        return bd_env_rays_nearest(context, inputs->images, inputs->pool, rays, count, hits,
                                   traced);
    return inputs->occluders->rays ? ask_processor(context, inputs, rays, count, hits, traced)
                                   : ask_device(context, inputs, rays, count, hits, traced, detail);
}
