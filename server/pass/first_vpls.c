#include "pass/first_vpls.h"

#include <stdlib.h>
#include <string.h>

#include "kernel/all_channels.h"
#include "kernel/brdf.h"
#include "kernel/light.h"
#include "lights/reflection.h"
#include "lights/sent.h"
#include "lights/sequence.h"
#include "lights/surface_hits.h"
#include "pass/emitter_photons.h"
#include "pass/nearest.h"
#include "pass/onward.h"
#include "pass/punctual_photons.h"
#include "pass/receivers.h"

// Of the slicer, one for each evaluation of a VPL.
#define UNITS_PER_PHOTON 300.0
// So many set out in about a millisecond.
#define PHOTONS_TO_PAUSE 8192u
// Numbers that nobody else of a frame draws by its seed.
#define OF_PUNCTUALS 0x766c616du
#define OF_EMITTERS  0x76656d69u
#define OF_GLASS     0x76676c73u

struct photons {
    const struct bd_pass_context *context;
    const struct bd_first_vpls_inputs *inputs;
    struct bd_surface_hits hits;
    uint32_t count;
    struct bd_ray *rays;
    struct bd_ray_hit *met;
    f3 *flux;             // of each
    float *inverse_range; // of its punctual light
    struct bd_way *ways;  // with glass; else NULL, as are numbers
    uint32_t *numbers;
    struct bd_vec4 (*lights)[BD_VPL_VEC4S];
    struct bd_vec4 (*quads)[BD_VPL_QUAD_VEC4S];
};

// Others have their turn now and then.
static enum bd_err set_out(struct photons *p, struct bd_ray ray, f3 flux, float inverse_range)
{
    p->rays[p->count] = ray;
    p->flux[p->count] = flux;
    p->inverse_range[p->count++] = inverse_range;
    return p->count % PHOTONS_TO_PAUSE == 0 ? bd_slicer_pause(p->context->slicer) : BD_ERR_OK;
}

// What a punctual light has of the photons, for each unit of it: half by its flux, half as all
// punctual lights. Which of them light what is seen nobody knows here, and a weak one may be the
// only one.
static double weight_of(const struct bd_light_uniform *punctual, double all, uint32_t shining)
{
    const double flux = strongest_channel(bd_punctual_flux(punctual));
    return flux > 0 ? 0.5 * flux / all + 0.5 / shining : 0;
}

// In even steps through the weights of all.
static enum bd_err set_out_from_punctuals(struct photons *p)
{
    const struct bd_first_vpls_inputs *in = p->inputs;
    const struct bd_sequence sequence = bd_sequence_of(bd_askers_seed(in->seed), OF_PUNCTUALS);
    double all = 0, passed = 0;
    uint32_t shining = 0, next = 0;
    for (uint32_t i = 0; i < in->punctual_count; i++) {
        const double flux = strongest_channel(bd_punctual_flux(&in->punctuals[i]));
        all += flux;
        shining += flux > 0;
    }
    const double step = 1.0 / in->of_punctuals;
    enum bd_err err = BD_ERR_OK;
    for (uint32_t i = 0; !err && all > 0 && i < in->punctual_count; i++) {
        const double weight = weight_of(&in->punctuals[i], all, shining);
        const f3 carried =
            f3_scale(bd_punctual_flux(&in->punctuals[i]), weight > 0 ? (float)(step / weight) : 0);
        const bool last = i + 1 == in->punctual_count;
        passed += weight;
        for (; !err && next < in->of_punctuals && (last || (next + 0.5) * step < passed); next++) {
            float number[2];
            bd_sequence_pair(&sequence, next, number);
            err = set_out(p, bd_punctual_ray(&in->punctuals[i], number), carried,
                          in->punctuals[i].inverse_range);
        }
    }
    return err;
}

static enum bd_err set_out_from_emitters(struct photons *p)
{
    const struct bd_first_vpls_inputs *in = p->inputs;
    struct bd_emitter_photons photons = bd_emitter_photons_of(
        in->emitters, in->of_emitters, in->from_cd_m2, bd_askers_seed(in->seed), OF_EMITTERS);
    struct bd_ray ray;
    f3 flux, normal;
    enum bd_err err = BD_ERR_OK;
    while (!err && bd_emitter_photons_next(&photons, &ray, &flux, &normal))
        err = set_out(p, ray, flux, 0);
    return err;
}

// --- where they land ----------------------------------------------------------------------------

static struct bd_vec4 vec4_of(f3 v)
{
    return (struct bd_vec4){v.x, v.y, v.z, 0};
}

// What the coat gets is what does not go on as at glass or a mirror (lights/interface.h).
static void coat(const struct photons *p, uint32_t i, const struct bd_surface_point *at, f3 way,
                 f3 sent, f3 flux)
{
    const float cosine = f3_dot(at->normal, way);
    const struct bd_reflecting s = bd_reflecting_at(&p->hits, at, p->met[i].u, p->met[i].v);
    const struct bd_sent_lobe lobe = bd_sent_lobe_from(s.roughness, cosine);
    const f3 all = bd_sent_by_all(s.base_color, s.metallic, s.roughness, s.f0_dielectric, cosine);
    const float stays = f_min(all_channels(sent) / f_max(all_channels(all), 1e-6f), 1);
    if (s.metallic == 1) return;
    p->lights[i][2].w = s.f0_dielectric * (lobe.white - lobe.grazing) + lobe.grazing;
    p->quads[i][0] = vec4_of(way);
    p->quads[i][0].w = -patch_roughness(s.roughness);
    p->quads[i][1] = vec4_of(f3_scale(flux, stays * (1 - s.metallic)));
    p->quads[i][1].w = s.f0_dielectric;
}

static void land(const struct photons *p, uint32_t i)
{
    const struct bd_ray_hit *hit = &p->met[i];
    const float *d = p->rays[i].direction;
    struct bd_surface_point at;
    if (hit->triangle == BD_NO_TRIANGLE ||
        !bd_surface_hit_at(&p->hits, hit->triangle, hit->u, hit->v, f3_of(d[0], d[1], d[2]), &at))
        return;
    const f3 way = f3_of(-d[0], -d[1], -d[2]);
    const float cosine = f3_dot(at.normal, way);
    // What goes on through glass ends at the rest of it by chance.
    const f3 diffuse = (p->ways ? bd_surface_hit_diffuse : bd_surface_hit_sent)(
        &p->hits, hit->triangle, hit->u, hit->v, p->inputs->sends, cosine);
    const float window = window_of_range(hit->distance, p->inverse_range[i]);
    p->lights[i][0] = vec4_of(at.position);
    p->lights[i][1] = vec4_of(at.normal);
    const f3 flux = f3_scale(p->flux[i], window);
    p->lights[i][2] = vec4_of(f3_mul(diffuse, flux));
    if (p->inputs->sends != BD_SENDS_LAMBERT) coat(p, i, &at, way, diffuse, flux);
}

static void land_group(void *user, uint32_t group)
{
    const struct photons *p = user;
    for (uint32_t i = group * BD_LANES; i < (group + 1) * BD_LANES && i < p->count; i++) land(p, i);
}

// A light's range is that of its first leg.
static enum bd_err go_on(struct photons *p, struct bd_ray_counts *traced,
                         struct bd_err_detail *detail)
{
    for (uint32_t i = 0; i < p->count; i++) {
        p->ways[i] = bd_way_begins;
        p->numbers[i] = i;
        p->flux[i] = f3_scale(p->flux[i], window_of_range(p->met[i].distance, p->inverse_range[i]));
        p->inverse_range[i] = 0;
    }
    const enum bd_err err = bd_onward_run(p->context, &p->hits, p->inputs->visibility,
                                          BD_CARRIES_FLUX, p->inputs->seed ^ OF_GLASS, p->numbers,
                                          p->rays, p->met, p->ways, p->count, NULL, traced, detail);
    for (uint32_t i = 0; !err && i < p->count; i++) {
        const bool is_lost = p->inputs->straight_alone && !p->ways[i].straight;
        p->flux[i] = is_lost ? f3_of(0, 0, 0) : f3_mul(p->flux[i], p->ways[i].weight);
    }
    return err;
}

static enum bd_err fly(struct photons *p, struct bd_err_detail *detail)
{
    struct bd_ray_counts traced = {0};
    bd_slicer_work(p->context->slicer, "first photons");
    enum bd_err err = set_out_from_punctuals(p);
    if (!err) err = set_out_from_emitters(p);
    if (!err)
        err = bd_nearest_ask(p->context, p->inputs->visibility, p->rays, p->count, p->met, &traced,
                             detail);
    if (!err && p->ways) err = go_on(p, &traced, detail);
    bd_slicer_work(p->context->slicer, "first vpls");
    if (!err)
        err = bd_receivers_each(p->context, (p->count + BD_LANES - 1) / BD_LANES,
                                UNITS_PER_PHOTON * BD_LANES, land_group, p);
    return err;
}

enum bd_err bd_first_vpls_run(const struct bd_pass_context *context,
                              const struct bd_first_vpls_inputs *inputs,
                              struct bd_vec4 (*lights)[BD_VPL_VEC4S],
                              struct bd_vec4 (*quads)[BD_VPL_QUAD_VEC4S],
                              struct bd_err_detail *detail)
{
    const size_t room = (size_t)inputs->of_punctuals + inputs->of_emitters;
    struct photons p = {.context = context,
                        .inputs = inputs,
                        .rays = malloc((room + 1) * sizeof *p.rays),
                        .met = malloc((room + 1) * sizeof *p.met),
                        .flux = malloc((room + 1) * sizeof *p.flux),
                        .inverse_range = malloc((room + 1) * sizeof *p.inverse_range),
                        .lights = lights,
                        .quads = quads};
    enum bd_err err = BD_ERR_OK;
    memset(lights, 0, room * sizeof *lights);
    memset(quads, 0, room * sizeof *quads);
    bd_surface_hits_init(&p.hits, inputs->snapshot);
    if (inputs->glass) {
        p.ways = malloc((room + 1) * sizeof *p.ways);
        p.numbers = malloc((room + 1) * sizeof *p.numbers);
    }
    const bool has_glass = (p.ways && p.numbers) || !inputs->glass;
    if (!p.rays || !p.met || !p.flux || !p.inverse_range || !has_glass)
        err = bd_err_set(detail, BD_ERR_NO_MEMORY, "vpls", "no memory for %zu photons", room);
    if (!err && room > 0) err = fly(&p, detail);
    bd_surface_hits_finish(&p.hits);
    free(p.rays);
    free(p.met);
    free(p.flux);
    free(p.inverse_range);
    free(p.ways);
    free(p.numbers);
    return err;
}
