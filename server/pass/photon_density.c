#include "pass/photon_density.h"

#include <math.h>

#include "pass/f3_arrays.h"
#include "pass/kernels.h"
#include "pass/receivers.h"

// Of the slicer, one for each evaluation of a VPL.
#define UNITS_PER_LOOK 300.0
// Flatter surfaces are no longer in a pixel.
#define COSINE_LEAST 0.05

struct density {
    struct bd_pass_context context;
    const struct bd_photon_map *map;
    const struct bd_viewpoint *viewpoint;
    const struct bd_render_space *space;
    bd_dvec3 eye; // render space
    const struct bd_receiver_part *part;
};

// Of a disk four times as large as what a pixel shows of a surface there: a focus that lies between
// the middles of pixels is theirs, too.
static float pixel_radius(const struct density *c, f3 position, f3 normal)
{
    const struct bd_viewpoint *v = c->viewpoint;
    const bd_dvec3 p = {position.x, position.y, position.z}, n = {normal.x, normal.y, normal.z};
    const bd_dvec3 way = v->orthographic ? v->axis_z : bd_dvec3_sub(c->eye, p);
    const double depth = v->orthographic ? c->space->render_per_m : bd_dvec3_dot(way, v->axis_z);
    const double side = 2 * fmax(depth, 0) * v->half_height / v->height_px;
    const double length2 = bd_dvec3_dot(way, way), facing = fabs(bd_dvec3_dot(n, way));
    const double cosine = length2 > 0 ? fmax(facing / sqrt(length2), COSINE_LEAST) : 1;
    return (float)(2 * side / sqrt((double)F_PI * cosine));
}

static void look_group(void *user, uint32_t group)
{
    const struct density *c = user;
    const struct bd_receivers *receivers = &c->part->receivers[group];
    const struct bd_ray_starts *starts = &c->part->starts[group];
    for (uint32_t lane = 0; lane < BD_LANES; lane++) {
        if (receivers->lit[lane] == 0 || group * BD_LANES + lane >= c->part->count) continue;
        const f3 position = f3_at(&starts->position, lane);
        const f3 normal = f3_at(&starts->normal_geometric, lane);
        f3_add_at(&c->part->light[group].irradiance, lane,
                  bd_photon_map_look(c->map, position, normal, pixel_radius(c, position, normal)));
    }
}

static enum bd_err light_part(void *user, const struct bd_receiver_part *part)
{
    struct density *c = user;
    c->part = part;
    bd_slicer_work(c->context.slicer, "photon density");
    return bd_receivers_each(&c->context, part->group_count, UNITS_PER_LOOK * BD_LANES, look_group,
                             c);
}

static enum bd_err run(const struct bd_pass_context *context,
                       const struct bd_photon_density_inputs *inputs,
                       struct bd_receivers_inputs *receivers, struct bd_err_detail *detail)
{
    const struct bd_processor processor = {inputs->pool, NULL};
    struct density c = {.context = *context,
                        .map = inputs->map,
                        .viewpoint = receivers->askers.viewpoint,
                        .space = receivers->askers.space};
    c.eye = bd_render_from_world(c.space, c.viewpoint->position_m);
    c.context.processor = &processor;
    receivers->pass = inputs->pass;
    receivers->starts = true;
    receivers->light = light_part;
    receivers->user = &c;
    return bd_receivers_run(&c.context, receivers, detail);
}

static void bind_pixels(const void *user, struct bd_bindings *bindings)
{
    const struct bd_indirect *out = user;
    bd_bind_image(bindings, 0, out->irradiance, true, true);
}

enum bd_err bd_photon_density_run(const struct bd_pass_context *context,
                                  const struct bd_photon_density_inputs *inputs,
                                  const struct bd_gather_inputs *gather,
                                  struct bd_indirect *indirect, struct bd_err_detail *detail)
{
    struct bd_receivers_inputs receivers = {
        .askers = bd_gather_askers(gather), .adds = true, .bind = bind_pixels, .out = indirect};
    return run(context, inputs, &receivers, detail);
}

static void bind_fragments(const void *user, struct bd_bindings *bindings)
{
    const struct bd_multires_light *out = user;
    bd_bind_image(bindings, 0, out->fine, true, true);
    if (out->coarse) bd_bind_image(bindings, 1, out->coarse, true, true);
}

enum bd_err bd_photon_density_add(const struct bd_pass_context *context,
                                  const struct bd_photon_density_inputs *inputs,
                                  const struct bd_gather_fragments_inputs *gather,
                                  struct bd_multires_light *light, struct bd_err_detail *detail)
{
    struct bd_receivers_inputs receivers = {
        .askers = bd_fragment_askers(gather), .adds = true, .bind = bind_fragments, .out = light};
    return run(context, inputs, &receivers, detail);
}

enum bd_err bd_photon_density_of_fragments(const struct bd_pass_context *context,
                                           const struct bd_photon_density_inputs *inputs,
                                           const struct bd_gather_fragments_inputs *gather,
                                           struct bd_multires_light **out,
                                           struct bd_err_detail *detail)
{
    *out = gather->into;
    enum bd_err err = BD_ERR_OK;
    if (!gather->into)
        err = bd_multires_light_create(context->gpu, &gather->fragments->layout,
                                       BD_LIGHT_VECTORS_NONE, out, detail);
    if (err) return err;
    struct bd_receivers_inputs receivers = {
        .askers = bd_fragment_askers(gather), .bind = bd_multires_light_bind, .out = *out};
    err = run(context, inputs, &receivers, detail);
    if (err && !gather->into) bd_multires_light_destroy(context->gpu, out);
    return err;
}
