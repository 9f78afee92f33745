#include "pass/photon_density.h"

#include <math.h>
#include <stdlib.h>

#include "kernel/all_channels.h"
#include "kernel/brdf.h"
#include "kernel/sent.h"
#include "lights/directions.h"
#include "lights/reflection.h"
#include "pass/disk_cuts.h"
#include "pass/f3_arrays.h"
#include "pass/kernels.h"
#include "pass/nearest.h"
#include "pass/receivers.h"

// Of the slicer, one for each evaluation of a VPL.
#define UNITS_PER_DISK 300.0
#define UNITS_PER_LOOK 600.0
// Flatter surfaces are no longer in a pixel.
#define COSINE_LEAST 0.05

// Receivers at once, that rays are asked for.
#define AT_ONCE 8192u

struct density {
    struct bd_pass_context context;
    const struct bd_photon_density_inputs *inputs;
    const struct bd_viewpoint *viewpoint;
    const struct bd_render_space *space;
    bd_dvec3 eye; // render space
    const struct bd_receiver_part *part;
    // Of a part's receivers, and of those that have photons near what stands on their disks.
    struct bd_photon_disk *disks;
    uint32_t *triangles;
    struct bd_disk_cuts cuts;
    struct bd_surface_hits hits;
    bool of_rough;    // lobes of rough dielectrics are told, too
    bool of_mean;     // or what is reflected of them in the mean over those who look
    bool lobes_alone; // irradiance is not
    struct bd_err_detail *detail;
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

static bool has_lobe(const struct density *c, uint32_t i)
{
    const struct bd_glossy_receivers *surfaces = c->part->surfaces;
    return c->part->glossy && (c->of_rough || surfaces[i / BD_LANES].has_lobe[i % BD_LANES] > 0);
}

static void find_disks(void *user, uint32_t group)
{
    const struct density *c = user;
    const struct bd_receivers *receivers = &c->part->receivers[group];
    const struct bd_ray_starts *starts = &c->part->starts[group];
    for (uint32_t lane = 0; lane < BD_LANES; lane++) {
        const uint32_t i = group * BD_LANES + lane;
        c->disks[i] = (struct bd_photon_disk){.radius = 0};
        c->triangles[i] = starts->triangle[lane];
        if (receivers->lit[lane] == 0 || i >= c->part->count) continue;
        if (c->lobes_alone && !has_lobe(c, i)) continue;
        const f3 position = f3_at(&starts->position, lane);
        const f3 normal = f3_at(&starts->normal_geometric, lane);
        c->disks[i] =
            bd_photon_disk_of(c->inputs->map, position, normal, pixel_radius(c, position, normal));
    }
}

// --- their light --------------------------------------------------------------------------------

// An irradiance seen under another normal, by the cosines of the irradiance vector.
static f3 bent(f3 irradiance, f3 vector, f3 normal)
{
    const float all = all_channels(irradiance);
    if (!(all > 0)) return irradiance;
    return f3_scale(irradiance, f_min(f_max(f3_dot(vector, normal) / all, 0), BD_BENT_MOST));
}

static void tell_light(const struct density *c, uint32_t i, const struct bd_disk_cut *cuts)
{
    const uint32_t group = i / BD_LANES, lane = i % BD_LANES;
    struct bd_receiver_light *light = &c->part->light[group];
    const f3 normal = f3_at(&c->part->receivers[group].normal, lane);
    f3 vector;
    const f3 irradiance = bd_photon_map_tell(c->inputs->map, &c->disks[i], cuts, &vector);
    f3_add_at(&light->irradiance, lane, bent(irradiance, vector, normal));
    f3_add_at(&light->vector, lane, vector);
}

// A pixel whose lobe reflects.
struct reflecting {
    f3 normal_geometric, normal, viewer, base_color;
    float metallic, roughness, f0_dielectric;
    f3 returned; // of a unit of irradiance: what the picture has of it otherwise
    f3 irradiance, glossy;
    f3 reflected; // of all of them
};

// As shaders/pass/composite has it.
static f3 returned_by(const struct density *c, const struct reflecting *r, bool has_lobe)
{
    const float cosine = f_max(f3_dot(r->normal, r->viewer), 0);
    const f3 limited = diffuse_limited(r->base_color, r->roughness, cosine);
    if (has_lobe) return f3_scale(r->base_color, 1 - r->metallic);
    return c->of_rough ? sent_by_diffuse(limited, r->f0_dielectric, cosine)
                       : sent_by_rough(limited, r->roughness, r->f0_dielectric, cosine);
}

static struct reflecting reflecting_at(const struct density *c, uint32_t i)
{
    const uint32_t group = i / BD_LANES, lane = i % BD_LANES;
    const struct bd_glossy_receivers *surfaces = &c->part->surfaces[group];
    struct reflecting r = {
        .normal_geometric = c->disks[i].normal,
        .normal = f3_at(&c->part->receivers[group].normal, lane),
        .viewer = f3_at(&surfaces->viewer, lane),
        .base_color = f3_at(&surfaces->base_color, lane),
        .metallic = surfaces->metallic[lane],
        .roughness = surfaces->roughness[lane],
        .f0_dielectric = surfaces->f0_dielectric[lane],
    };
    r.returned = f3_scale(returned_by(c, &r, surfaces->has_lobe[lane] > 0), 1 / F_PI);
    r.roughness = patch_roughness(r.roughness);
    return r;
}

static void reflect(void *user, const struct bd_photon_told *told)
{
    struct reflecting *r = user;
    const float bend = bd_bent(r->normal, r->normal_geometric, told->way);
    const f3 irradiance = f3_scale(told->irradiance, bend);
    r->irradiance = f3_add(r->irradiance, irradiance);
    if (!(bend > 0)) return;
    const f3 all = gltf_brdf(r->base_color, r->metallic, r->roughness, r->f0_dielectric, r->normal,
                             told->way, r->viewer);
    r->reflected = f3_add(r->reflected, f3_mul(irradiance, all));
    // What rays from lobes find is no photon's (pass/gloss.h).
    if (told->is_by_brushed || (told->is_met && r->roughness <= BD_MIRROR_ROUGHNESS)) return;
    r->glossy = f3_add(r->glossy, f3_mul(irradiance, f3_sub(all, r->returned)));
}

static void tell_lobe(const struct density *c, uint32_t i, const struct bd_disk_cut *cuts)
{
    const uint32_t group = i / BD_LANES, lane = i % BD_LANES;
    struct reflecting r = reflecting_at(c, i);
    bd_photon_map_each(c->inputs->map, &c->disks[i], cuts, reflect, &r);
    f3_put_at(&c->part->glossy[group], lane, r.glossy);
    if (!c->lobes_alone) f3_add_at(&c->part->light[group].irradiance, lane, r.irradiance);
}

// So much irradiance as makes the mean what is reflected here.
static void tell_mean(const struct density *c, uint32_t i, const struct bd_disk_cut *cuts)
{
    struct reflecting r = reflecting_at(c, i);
    bd_photon_map_each(c->inputs->map, &c->disks[i], cuts, reflect, &r);
    const f3 mean = f3_max(r.returned, 1e-6f);
    const f3 irradiance =
        f3_of(r.reflected.x / mean.x, r.reflected.y / mean.y, r.reflected.z / mean.z);
    f3_add_at(&c->part->light[i / BD_LANES].irradiance, i % BD_LANES, irradiance);
}

static void tell_group(void *user, uint32_t group)
{
    const struct density *c = user;
    for (uint32_t i = group * BD_LANES; i < (group + 1) * BD_LANES; i++) {
        if (!(c->disks[i].radius > 0)) continue;
        const struct bd_disk_cut *cuts = bd_disk_cuts_of(&c->cuts, i);
        if (has_lobe(c, i))
            tell_lobe(c, i, cuts);
        else if (c->of_mean)
            tell_mean(c, i, cuts);
        else if (!c->lobes_alone)
            tell_light(c, i, cuts);
    }
}

static enum bd_err make_room(struct density *c)
{
    const size_t receivers = (size_t)c->part->group_count * BD_LANES;
    if (c->disks) return BD_ERR_OK; // the first part is the largest
    c->disks = malloc(receivers * sizeof *c->disks);
    c->triangles = malloc(receivers * sizeof *c->triangles);
    if (c->disks && c->triangles) return BD_ERR_OK;
    return bd_err_set(c->detail, BD_ERR_NO_MEMORY, "photons", "no memory for disks of photons");
}

static enum bd_err light_part(void *user, const struct bd_receiver_part *part)
{
    struct density *c = user;
    c->part = part;
    enum bd_err err = make_room(c);
    bd_slicer_work(c->context.slicer, "photon disks");
    if (!err)
        err = bd_receivers_each(&c->context, part->group_count, UNITS_PER_DISK * BD_LANES,
                                find_disks, c);
    if (!err)
        err = bd_disk_cuts_find(&c->context, &c->cuts, c->disks, c->triangles,
                                part->group_count * BD_LANES, c->detail);
    bd_slicer_work(c->context.slicer, "photon density");
    return err ? err
               : bd_receivers_each(&c->context, part->group_count, UNITS_PER_LOOK * BD_LANES,
                                   tell_group, c);
}

static enum bd_err run(struct density *c, struct bd_receivers_inputs *receivers,
                       struct bd_ray_counts *traced)
{
    const struct bd_processor processor = {c->inputs->pool, NULL};
    c->viewpoint = receivers->askers.viewpoint;
    c->space = receivers->askers.space;
    c->eye = bd_render_from_world(c->space, c->viewpoint->position_m);
    c->context.processor = &processor;
    c->cuts.visibility = c->inputs->visibility;
    c->cuts.surfaces = &c->hits;
    bd_surface_hits_init(&c->hits, c->inputs->snapshot);
    receivers->pass = c->inputs->pass;
    receivers->starts = true;
    receivers->receivers_max = AT_ONCE;
    receivers->light = light_part;
    receivers->user = c;
    const enum bd_err err = bd_receivers_run(&c->context, receivers, c->detail);
    bd_ray_counts_add(traced, c->cuts.traced);
    bd_surface_hits_finish(&c->hits);
    free(c->disks);
    free(c->triangles);
    bd_disk_cuts_finish(&c->cuts);
    return err;
}

// Where there are no other lobes, those of rough dielectrics are all.
static struct bd_tex *lobes_of(const struct bd_indirect *indirect)
{
    return indirect->glossy ? indirect->glossy : indirect->rough;
}

static void bind_pixels(const void *user, struct bd_bindings *bindings)
{
    const struct bd_indirect *out = user;
    bd_bind_image(bindings, 0, out->irradiance, true, true);
    if (lobes_of(out)) bd_bind_image(bindings, 1, lobes_of(out), true, true);
    if (out->glossy && out->rough) bd_bind_image(bindings, 3, out->rough, true, true);
}

static enum bd_err run_at_pixels(const struct bd_pass_context *context,
                                 const struct bd_photon_density_inputs *inputs,
                                 const struct bd_gather_inputs *gather, bool lobes_alone,
                                 struct bd_indirect *indirect, struct bd_err_detail *detail)
{
    struct density c = {.context = *context,
                        .inputs = inputs,
                        .of_rough = indirect->rough && !lobes_alone,
                        .of_mean = !inputs->lambert && !indirect->rough && !lobes_alone,
                        .lobes_alone = lobes_alone,
                        .detail = detail};
    struct bd_receivers_inputs receivers = {.askers = bd_gather_askers(gather),
                                            .surfaces = !inputs->lambert,
                                            .glossy = lobes_of(indirect) != NULL,
                                            .rough_apart =
                                                !lobes_alone && indirect->glossy && indirect->rough,
                                            .adds = true,
                                            .bind = bind_pixels,
                                            .out = indirect};
    return run(&c, &receivers, &indirect->rays);
}

enum bd_err bd_photon_density_run(const struct bd_pass_context *context,
                                  const struct bd_photon_density_inputs *inputs,
                                  const struct bd_gather_inputs *gather,
                                  struct bd_indirect *indirect, struct bd_err_detail *detail)
{
    return run_at_pixels(context, inputs, gather, false, indirect, detail);
}

enum bd_err bd_photon_density_run_lobes(const struct bd_pass_context *context,
                                        const struct bd_photon_density_inputs *inputs,
                                        const struct bd_gather_inputs *gather,
                                        struct bd_indirect *indirect, struct bd_err_detail *detail)
{
    return run_at_pixels(context, inputs, gather, true, indirect, detail);
}

static void bind_fragments(const void *user, struct bd_bindings *bindings)
{
    const struct bd_multires_light *out = user;
    bd_bind_image(bindings, 0, out->fine, true, true);
    if (out->coarse) bd_bind_image(bindings, 1, out->coarse, true, true);
    if (out->fine_vector) bd_bind_image(bindings, 2, out->fine_vector, true, true);
    if (out->coarse_vector) bd_bind_image(bindings, 3, out->coarse_vector, true, true);
}

enum bd_err bd_photon_density_add(const struct bd_pass_context *context,
                                  const struct bd_photon_density_inputs *inputs,
                                  const struct bd_gather_fragments_inputs *gather,
                                  struct bd_multires_light *light, struct bd_err_detail *detail)
{
    struct density c = {.context = *context, .inputs = inputs, .detail = detail};
    struct bd_receivers_inputs receivers = {
        .askers = bd_fragment_askers(gather), .adds = true, .bind = bind_fragments, .out = light};
    return run(&c, &receivers, &light->rays);
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
                                       bd_fragment_vectors(gather), out, detail);
    if (err) return err;
    struct density c = {.context = *context, .inputs = inputs, .detail = detail};
    struct bd_receivers_inputs receivers = {
        .askers = bd_fragment_askers(gather), .bind = bd_multires_light_bind, .out = *out};
    err = run(&c, &receivers, &(*out)->rays);
    if (err && !gather->into) bd_multires_light_destroy(context->gpu, out);
    return err;
}
