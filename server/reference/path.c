#include "reference/path.h"

#include <math.h>
#include <stddef.h>

#include "reference/vec3f.h"

// Paths may end by chance from this many scattering events on.
#define EVENTS_WITHOUT_ROULETTE 3
#define SURVIVAL_MIN            0.05f
#define SURVIVAL_MAX            0.95f

void bd_path_begin(const struct bd_reference *reference, const struct bd_integrand *integrand,
                   struct bd_sampler sampler, struct bd_path *path)
{
    double units_per_m = reference->geometry.units_per_m;
    path->reference = reference;
    path->integrand = integrand;
    path->sampler = sampler;
    path->seed = bd_mix64((uint64_t)sampler.key << 32 | sampler.index);
    path->events = path->ray_index = 0;
    bd_vec3f_set(path->throughput, 1, 1, 1);
    path->scatter_pdf = 0;
    path->is_specular = path->only_mirrors = true;
    path->misses_caustics = false;
    path->solids.count = 0;
    path->lamp_radius = (float)(integrand->lamp_radius_m * units_per_m);
    path->clamp_per_unit2 = (float)(integrand->clamp_per_m2 / (units_per_m * units_per_m));
    // The rest of the light vertex is as large as all this, and often is not asked for.
    path->light_vertex.traced = path->light_vertex.found = false;
    path->light_vertex.has_sender[0] = path->light_vertex.has_sender[1] = false;
    for (int p = 0; p < BD_PART_COUNT; p++) bd_vec3f_set(path->sum[p], 0, 0, 0);
}

// --- vertices and segments ----------------------------------------------------------------------

// Surfaces behind the first reflect by their diffuse lobe alone.
void bd_path_make_sender(const struct bd_path *path, struct bd_surface *surface)
{
    if (!path->integrand->lambert_senders) return;
    if (!surface->lambert)
        bd_vec3f_scale(surface->base_color, surface->base_color, 1 - surface->metallic);
    surface->lambert = true;
    surface->transmission = 0;
}

void bd_path_vertex(const struct bd_path *path, const struct bd_intersection *at, const float wo[3],
                    const struct bd_nested *within, struct bd_vertex *out)
{
    const struct bd_integrand *integrand = path->integrand;
    bd_surface_at(path->reference->scene, &at->hit, wo, integrand->lambert, integrand->transmission,
                  &out->bsdf.surface);
    struct bd_surface *surface = &out->bsdf.surface;
    const bool bounds_solid = surface->transmission > 0 && !surface->thin;
    if (bounds_solid && within && within->count > 0)
        surface->ior = bd_nested_edge_at(path->reference, within, at, surface->entering).ior;
    bd_bsdf_look(&out->bsdf, wo);
    bd_vec3f_copy(out->wo, wo);
    bd_vec3f_copy(out->position, at->position);
    out->clearance = at->clearance;
    const struct bd_medium *medium = &path->reference->media[at->hit.primitive->material];
    out->behind = bounds_solid && medium->absorbs ? medium : NULL;
    out->solid = bounds_solid ? at->part : NULL;
}

static bool is_inside(const struct bd_vertex *vertex, const float direction[3])
{
    bool same_side = bd_vec3f_dot(vertex->bsdf.surface.normal_geometric, direction) > 0;
    return same_side != vertex->bsdf.surface.entering;
}

static void absorb(const struct bd_medium *medium, float distance, float value[3])
{
    if (!medium) return;
    for (int k = 0; k < 3; k++)
        if (medium->per_unit[k] > 0) value[k] *= expf(-medium->per_unit[k] * distance);
}

void bd_path_absorb(const struct bd_vertex *from, const float wi[3], const struct bd_vertex *to,
                    float distance, float value[3])
{
    const struct bd_medium *medium = NULL;
    if (to && to->behind && !to->bsdf.surface.entering)
        medium = to->behind;
    else if (from && from->behind && is_inside(from, wi))
        medium = from->behind;
    absorb(medium, distance, value);
}

static void step_off(const struct bd_vertex *vertex, const float direction[3], float out[3])
{
    const float *normal = vertex->bsdf.surface.normal_geometric;
    float side = bd_vec3f_dot(normal, direction) < 0 ? -1 : 1;
    bd_vec3f_add_scaled(out, vertex->position, normal, side * vertex->clearance);
}

void bd_path_ray(struct bd_path *path, const struct bd_vertex *vertex, const float direction[3],
                 float far, struct bd_ray *out)
{
    out->near = 0; // points keep off edges (reference/triangle.h): none is behind what it is before
    out->far = far;
    out->alpha = path->integrand->alpha;
    out->coverage_seed = bd_path_ray_seed(path);
    step_off(vertex, direction, out->origin);
    bd_vec3f_copy(out->direction, direction);
}

void bd_path_ray_to(struct bd_path *path, const struct bd_vertex *vertex, const float target[3],
                    struct bd_ray *out)
{
    float direction[3];
    bd_vec3f_add_scaled(direction, target, vertex->position, -1);
    bd_path_ray(path, vertex, direction, 1, out);
    bd_vec3f_add_scaled(out->direction, target, out->origin, -1);
}

bool bd_path_sees(struct bd_path *path, const struct bd_vertex *vertex, const float target[3])
{
    struct bd_ray ray;
    bd_path_ray_to(path, vertex, target, &ray);
    return !bd_geometry_is_blocked(&path->reference->geometry, &ray);
}

// --- through panes ------------------------------------------------------------------------------

// More of them are dark.
#define PANES_MAX 32

const struct bd_straight_way bd_straight_free = {{1, 1, 1}, 1};

bool bd_path_add_pane(const struct bd_path *path, const struct bd_intersection *at,
                      const float wo[3], struct bd_straight_way *way)
{
    struct bd_vertex pane;
    float passed[3], chance;
    if (!path->reference->smooth[at->hit.primitive->material]) return false;
    bd_path_vertex(path, at, wo, NULL, &pane);
    if (!bd_bsdf_straight(&pane.bsdf, passed, &chance)) return false;
    bd_vec3f_filter(way->passed, way->passed, passed);
    way->chance *= bd_bsdf_is_delta(&pane.bsdf.surface) ? chance : 0;
    return true;
}

bool bd_path_passes(const struct bd_path *path, struct bd_ray *ray, struct bd_straight_way *way)
{
    const struct bd_geometry *geometry = &path->reference->geometry;
    *way = bd_straight_free;
    if (!bd_geometry_is_blocked(geometry, ray)) return true;
    float wo[3];
    bd_vec3f_scale(wo, ray->direction, -1);
    if (!bd_path_looks_straight(path) || !bd_vec3f_normalize(wo)) return false;
    for (int i = 0; i < PANES_MAX; i++) {
        struct bd_intersection at;
        if (!bd_geometry_intersect(geometry, ray, BD_SIGHT_ALL, &at)) return true;
        if (!bd_path_add_pane(path, &at, wo, way)) return false;
        ray->near = nextafterf(at.distance, INFINITY);
    }
    return false;
}

float bd_path_survival(const struct bd_path *path, const struct bd_vertex *vertex)
{
    if (path->events < EVENTS_WITHOUT_ROULETTE) return 1;
    const struct bd_surface *s = &vertex->bsdf.surface;
    float albedo = bd_maxf(s->base_color[0], bd_maxf(s->base_color[1], s->base_color[2]));
    // A specular coat that is mostly seen at an angle reflects more than its least.
    if (!s->lambert) albedo = bd_maxf(albedo, 0.25f);
    return bd_minf(bd_maxf(albedo, SURVIVAL_MIN), SURVIVAL_MAX);
}

// --- what a ray meets ---------------------------------------------------------------------------

// The back of a single-sided surface. Where another lies in the same plane, front to the ray, that
// one is what the ray meets: modellers double surfaces so, and it is chance which of the two is
// found first.
static void prefer_front(const struct bd_reference *reference, const struct bd_ray *ray,
                         struct bd_intersection *at)
{
    if (!bd_intersection_is_behind(at, ray->direction)) return;
    const float tolerance = 0x1p-20f;
    struct bd_ray slice = *ray;
    slice.near = bd_maxf(at->distance * (1 - tolerance) - at->clearance, ray->near);
    slice.far = at->distance * (1 + tolerance) + at->clearance;
    struct bd_intersection front;
    if (bd_geometry_intersect(&reference->geometry, &slice, BD_SIGHT_FRONTS_ONLY, &front))
        *at = front;
}

bool bd_path_intersect(const struct bd_path *path, const struct bd_ray *ray,
                       struct bd_intersection *at)
{
    const struct bd_reference *reference = path->reference;
    if (!bd_geometry_intersect(&reference->geometry, ray, BD_SIGHT_ALL, at)) return false;
    prefer_front(reference, ray, at);
    return true;
}

// What fills the last part of the way to a surface that bounds no solid.
static const struct bd_medium *medium_before(const struct bd_path *path,
                                             const struct bd_vertex *from, const struct bd_ray *ray,
                                             const struct bd_nested *solids,
                                             const struct bd_intersection *at)
{
    if (solids->count > 1) return bd_nested_medium_at(path->reference, solids, at->position);
    return from && from->behind && is_inside(from, ray->direction) ? from->behind : NULL;
}

bool bd_path_meet(const struct bd_path *path, const struct bd_vertex *from, struct bd_ray *ray,
                  struct bd_nested *solids, float value[3], struct bd_intersection *at)
{
    const bool refracts = path->integrand->transmission && !path->integrand->lambert &&
                          !path->integrand->lambert_senders;
    for (float gone = 0;; gone = at->distance) {
        if (!bd_path_intersect(path, ray, at)) return false;
        if (!refracts || !bd_material_is_solid(at->part->material)) {
            absorb(medium_before(path, from, ray, solids, at), at->distance - gone, value);
            return true;
        }
        const bool entering = bd_vec3f_dot(at->hit.normal_geometric, ray->direction) <= 0;
        const struct bd_nested_edge edge = bd_nested_edge_at(path->reference, solids, at, entering);
        absorb(entering ? edge.outside : edge.inside, at->distance - gone, value);
        if (!edge.is_none) return true;
        bd_nested_cross(solids, at->part, entering);
        ray->near = nextafterf(at->distance, INFINITY);
    }
}

static void add_sky(struct bd_path *path, const float direction[3])
{
    const struct bd_reference *reference = path->reference;
    bool lit = bd_path_lights(path, path->events) & BD_REFERENCE_ENVIRONMENT;
    if (!reference->sky.shines || (path->events > 0 && !lit)) return;
    float radiance[3];
    bd_sky_radiance(&reference->sky, direction, radiance);
    float weight = (float)(bd_path_sky_weight(path, direction) / reference->unit_cd_m2);
    bd_vec3f_scale(radiance, radiance, weight);
    bd_path_add(path, path->events, radiance);
}

static void add_emission(struct bd_path *path, const struct bd_vertex *from,
                         const struct bd_intersection *at, const struct bd_vertex *vertex)
{
    bool lit = bd_path_lights(path, path->events) & BD_REFERENCE_EMISSIVE;
    if (path->events > 0 && (!lit || vertex->bsdf.surface.unlit)) return;
    const float *emission = vertex->bsdf.surface.emission;
    if (emission[0] == 0 && emission[1] == 0 && emission[2] == 0) return;
    float direction[3], radiance[3];
    bd_vec3f_scale(direction, vertex->wo, -1);
    float weight = bd_path_emitter_weight(path, from, at, direction);
    bd_vec3f_scale(radiance, emission, (float)(weight / path->reference->unit_cd_m2));
    bd_path_add(path, path->events, radiance);
}

// --- scattering ---------------------------------------------------------------------------------

// What is known of the last vertex when the next is met.
struct step {
    const struct bd_vertex *from;
    struct bd_ray ray;
    float cosine;     // to the shading normal
    bool is_absorbed; // what solids take on the way is taken
};

// Chooses a direction and the chance of going on. False: the path ends.
static bool scatter(struct bd_path *path, const struct bd_vertex *vertex, struct step *step)
{
    float u[4] = {0, 0, 0, 0}, survival = bd_path_survival(path, vertex);
    bd_sampler_pair(&path->sampler, bd_path_pair(path, BD_PAIR_DIRECTION), u);
    if (survival < 1 || !vertex->bsdf.surface.lambert)
        bd_sampler_pair(&path->sampler, bd_path_pair(path, BD_PAIR_LOBE_AND_SURVIVAL), u + 2);
    if (u[3] >= survival) return false;
    struct bd_bsdf_sample sample;
    if (!bd_bsdf_sample(&vertex->bsdf, u, &sample)) return false;
    float weight[3];
    bd_vec3f_scale(weight, sample.weight, 1 / survival);
    bd_vec3f_filter(path->throughput, path->throughput, weight);
    path->scatter_pdf = sample.pdf * survival;
    path->is_specular = sample.delta;
    path->only_mirrors &= sample.delta;
    if (sample.transmitted && vertex->solid)
        bd_nested_cross(&path->solids, vertex->solid, vertex->bsdf.surface.entering);
    path->events++;
    step->from = vertex;
    step->is_absorbed = false;
    bd_path_ray(path, vertex, sample.wi, INFINITY, &step->ray);
    step->cosine = bd_vec3f_dot(vertex->bsdf.surface.normal, sample.wi);
    return path->throughput[0] > 0 || path->throughput[1] > 0 || path->throughput[2] > 0;
}

// The pdf per area with which scattering found this vertex; 0 if nothing else could have.
static float found_pdf(const struct bd_path *path, const struct bd_vertex *vertex, float distance)
{
    if (path->is_specular) return 0;
    float cosine = fabsf(bd_vec3f_dot(vertex->bsdf.surface.normal_geometric, vertex->wo));
    return path->scatter_pdf * cosine / (distance * distance);
}

// Arrives at what the ray met: from here on the throughput is that of light scattered here.
static void arrive(struct bd_path *path, const struct step *step, const struct bd_intersection *at,
                   bool is_first, struct bd_vertex *vertex)
{
    float wo[3];
    bd_vec3f_scale(wo, step->ray.direction, -1);
    bd_path_vertex(path, at, wo, &path->solids, vertex);
    if (!step->is_absorbed)
        bd_path_absorb(step->from, step->ray.direction, vertex, at->distance, path->throughput);
    if (is_first) add_emission(path, step->from, at, vertex);
    bd_path_make_sender(path, &vertex->bsdf.surface);
    if (path->is_specular) return;
    float cosine = bd_vec3f_dot(vertex->bsdf.surface.normal_geometric, wo);
    float factor = bd_path_clamp(path, step->cosine, cosine, at->distance);
    bd_vec3f_scale(path->throughput, path->throughput, factor);
}

// Light that smooth surfaces alone have sent on is joined to the camera, or to vertices that a path
// finds otherwise.
static void note_missed(struct bd_path *path, const struct bd_vertex *vertex)
{
    path->misses_caustics |= path->is_specular && !bd_bsdf_is_delta(&vertex->bsdf.surface) &&
                             bd_reference_has_light_paths(path->reference, path->integrand);
}

static void add_lights(struct bd_path *path, const struct bd_vertex *vertex, float found)
{
    bd_path_add_punctuals(path, vertex, found);
    bd_path_add_areas(path, vertex);
}

// Whether a ray that leaves after the last scattering event can still find light.
static bool is_ray_of_use(const struct bd_path *path)
{
    const struct bd_reference *reference = path->reference;
    uint32_t lights = bd_path_lights(path, path->events + 1);
    if (path->events < path->integrand->bounces_max || path->lamp_radius > 0) return true;
    return (lights & BD_REFERENCE_EMISSIVE && reference->emitters.count > 0) ||
           (lights & BD_REFERENCE_ENVIRONMENT && reference->sky.shines);
}

static bool may_scatter(const struct bd_path *path)
{
    return path->events <= path->integrand->bounces_max;
}

// --- the way on ---------------------------------------------------------------------------------

// The next vertex; its direct light is added. False: there is none.
static bool walk(struct bd_path *path, struct step *step, struct bd_vertex *vertex)
{
    struct bd_intersection at;
    const bool met =
        bd_path_meet(path, step->from, &step->ray, &path->solids, path->throughput, &at);
    step->is_absorbed = true;
    // Who looks for lights ends at edges that are none.
    if (step->ray.near > 0) path->is_specular = true;
    bd_path_add_lamps(path, step->from, step->ray.direction, met ? at.distance : INFINITY);
    if (!met) {
        add_sky(path, step->ray.direction);
        return false;
    }
    arrive(path, step, &at, true, vertex);
    if (!may_scatter(path)) return false;
    note_missed(path, vertex);
    add_lights(path, vertex, found_pdf(path, vertex, at.distance));
    return true;
}

// The same where surfaces do not hide each other: every one along the ray sends its light, and
// the path goes on from one of them, chosen uniformly, that stands for all.
static bool walk_through(struct bd_path *path, const struct step *step, struct bd_vertex *chosen)
{
    struct step here = *step;
    struct bd_intersection at;
    float before[3], throughput_chosen[3] = {0, 0, 0};
    uint32_t count = 0;
    bd_vec3f_copy(before, path->throughput);
    bool met = bd_path_intersect(path, &here.ray, &at);
    if (!met) add_sky(path, here.ray.direction);
    for (; met; met = bd_geometry_intersect(&path->reference->geometry, &here.ray,
                                            BD_SIGHT_FRONTS_ONLY, &at)) {
        struct bd_vertex vertex;
        bd_vec3f_copy(path->throughput, before);
        arrive(path, &here, &at, count == 0, &vertex);
        here.ray.near = nextafterf(at.distance, INFINITY);
        if (!may_scatter(path)) return false;
        add_lights(path, &vertex, found_pdf(path, &vertex, at.distance));
        count++;
        uint32_t draw = bd_sampler_hash(&path->sampler, path->ray_index++);
        if ((uint64_t)draw * count >> 32 != 0) continue; // one in `count` takes the place
        *chosen = vertex;
        bd_vec3f_copy(throughput_chosen, path->throughput);
    }
    bd_vec3f_scale(path->throughput, throughput_chosen, (float)count);
    return count > 0;
}

void bd_path_from_vertex(struct bd_path *path, const struct bd_vertex *vertex)
{
    struct bd_vertex vertices[2];
    uint32_t next = 0;
    add_lights(path, vertex, 0);
    for (;;) {
        struct step step;
        bd_path_add_light_vertex(path, vertex);
        if (!is_ray_of_use(path) || !scatter(path, vertex, &step)) return;
        struct bd_vertex *to = &vertices[next];
        next = 1 - next;
        bool more = path->integrand->indirect_visibility ? walk(path, &step, to)
                                                         : walk_through(path, &step, to);
        if (!more) return;
        vertex = to;
    }
}

bool bd_path_from_camera(struct bd_path *path, struct bd_ray *ray, struct bd_vertex *first,
                         float *distance)
{
    struct bd_intersection at;
    ray->alpha = path->integrand->alpha;
    ray->coverage_seed = bd_path_ray_seed(path);
    if (!bd_geometry_intersect(&path->reference->geometry, ray, BD_SIGHT_FRONTS_ONLY, &at)) {
        add_sky(path, ray->direction);
        return false;
    }
    float wo[3];
    bd_vec3f_scale(wo, ray->direction, -1);
    bd_path_vertex(path, &at, wo, &path->solids, first);
    bd_path_absorb(NULL, ray->direction, first, at.distance, path->throughput);
    add_emission(path, NULL, &at, first);
    *distance = at.distance;
    bd_path_from_vertex(path, first);
    return true;
}
