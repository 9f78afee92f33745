// Eye paths joined with a point that a punctual light shines on. Where a small spot is what lights
// a room, scattered rays find it rarely and shadow rays from everywhere else find the punctual
// light never; a ray from the punctual light finds it always.
//
// A path that ends punctual light - y - x is found in two ways: scattering at x meets y, where the
// punctual light is sought (next_event.c); or a punctual light's ray meets y, which x seeks. Both
// have a pdf per area at y, and share by the balance heuristic (Veach 1997), which holds the sum of
// both densities against the 1/r^2 of the junction: near corners it does not blow up. One light
// vertex serves all vertices of its path.

#include <math.h>
#include <stddef.h>

#include "reference/path.h"
#include "reference/vec3f.h"

bool bd_path_has_light_vertices(const struct bd_path *path, uint32_t events)
{
    const struct bd_integrand *integrand = path->integrand;
    return integrand->light_vertices && integrand->lamp_radius_m == 0 &&
           integrand->lights & integrand->indirect_lights & BD_REFERENCE_PUNCTUAL &&
           path->reference->punctuals.count > 0 && events >= 2 &&
           events - 1 <= integrand->bounces_max;
}

// Behind panes, where the light is sought, too: what it gives there, and how often so.
static bool look_back(const struct bd_path *path, const struct bd_carried *carried,
                      struct bd_illumination *light)
{
    if (!bd_punctual_illuminates(&path->reference->punctuals, carried->punctual,
                                 carried->at.position, light))
        return false;
    bd_vec3f_filter(light->normal_illuminance, light->normal_illuminance, carried->way.passed);
    light->pdf *= carried->way.chance;
    return true;
}

// Behind what is smooth: its flux, as of a light that gives that much to an area of 1 across it.
static void trace_through(struct bd_path *path, struct bd_carried *carried,
                          struct bd_light_vertex *v)
{
    while (bd_path_is_smooth(path, carried))
        if (carried->passed >= path->integrand->bounces_max || !bd_path_pass_on(path, carried))
            return;
    v->at = carried->at;
    v->passed = carried->passed;
    if (carried->passed > 0) {
        bd_vec3f_copy(v->light.direction, carried->towards_light);
        bd_vec3f_copy(v->light.normal_illuminance, carried->flux);
        v->light.distance = 0; // what lies between has absorbed its part
        v->light.pdf = 1;
    }
    if (carried->straight && !look_back(path, carried, &v->light)) return;
    v->pdf = v->light.pdf * fabsf(bd_vec3f_dot(v->at.hit.normal_geometric, v->light.direction));
    v->found = v->pdf > 0;
}

static void trace(struct bd_path *path, struct bd_light_vertex *v)
{
    struct bd_carried carried;
    float u[2], choice[2] = {0, 0};
    bd_sampler_pair(&path->sampler, BD_PAIR_LIGHT_RAY, u);
    if (path->reference->punctuals.count > 1)
        bd_sampler_pair(&path->sampler, BD_PAIR_LIGHT_CHOICE, choice);
    v->traced = true;
    if (bd_path_leave_light(path, choice[0], u, &carried, &v->light))
        trace_through(path, &carried, v);
}

// The light vertex as a vertex that sends light towards `wo`; its own `wo` is an earlier one's.
static const struct bd_vertex *sender_towards(struct bd_path *path, const float wo[3])
{
    struct bd_light_vertex *v = &path->light_vertex;
    int side = bd_vec3f_dot(v->at.hit.normal_geometric, wo) < 0;
    struct bd_vertex *sender = &v->sender[side];
    if (v->has_sender[side]) {
        bd_bsdf_look(&sender->bsdf, wo);
        return sender;
    }
    bd_path_vertex(path, &v->at, wo, NULL, sender);
    bd_path_make_sender(path, &sender->bsdf.surface);
    v->has_sender[side] = true;
    return sender;
}

// What the junction's two ends say about the direction between them.
struct junction {
    float wi[3]; // unit, from the eye's vertex to the light vertex
    float distance;
    float value[3]; // f cos at the eye's vertex x luminance that comes from the light vertex
    float scatter_pdf;
    float cosine; // at the light vertex, geometric
};

// Points of one plane see nothing of each other, whatever the rounding of their positions says
// (hazards 3, 4).
static bool is_above(const float normal[3], const struct junction *j, float clearance)
{
    return fabsf(bd_vec3f_dot(normal, j->wi)) * j->distance > clearance;
}

// Light meets the light vertex on the side from which the eye's vertex sees it, or passes through.
static bool is_lit_side(const struct bd_light_vertex *v, const struct junction *j)
{
    const struct bd_material *material = v->at.part->material;
    if (material->transmission > 0) return true;
    const float *normal = v->at.hit.normal_geometric;
    float to_eye = -bd_vec3f_dot(normal, j->wi);
    if (to_eye < 0 && !material->double_sided) return false;
    return to_eye * bd_vec3f_dot(normal, v->light.direction) > 0;
}

// What can be said of the junction before anything is evaluated. False: no light passes it.
static bool aim(struct bd_path *path, const struct bd_vertex *vertex, struct junction *j)
{
    const struct bd_light_vertex *v = &path->light_vertex;
    bd_vec3f_add_scaled(j->wi, v->at.position, vertex->position, -1);
    j->distance = sqrtf(bd_vec3f_dot(j->wi, j->wi));
    if (!(j->distance > 0)) return false;
    bd_vec3f_scale(j->wi, j->wi, 1 / j->distance);
    if (!is_above(vertex->bsdf.surface.normal_geometric, j, vertex->clearance) ||
        !is_above(v->at.hit.normal_geometric, j, v->at.clearance))
        return false;
    return is_lit_side(v, j) && bd_bsdf_is_reached(&vertex->bsdf.surface, j->wi);
}

static bool evaluate(struct bd_path *path, const struct bd_vertex *vertex, struct junction *j)
{
    const struct bd_light_vertex *v = &path->light_vertex;
    bd_bsdf_eval(&vertex->bsdf, j->wi, j->value, &j->scatter_pdf);
    if (!(j->value[0] > 0 || j->value[1] > 0 || j->value[2] > 0)) return false;
    float wo[3], reflected[3];
    bd_vec3f_scale(wo, j->wi, -1);
    const struct bd_vertex *sender = sender_towards(path, wo);
    bd_bsdf_eval(&sender->bsdf, v->light.direction, reflected, NULL);
    bd_vec3f_filter(reflected, reflected, v->light.normal_illuminance);
    bd_path_absorb(sender, v->light.direction, NULL, v->light.distance, reflected);
    bd_vec3f_filter(j->value, j->value, reflected);
    bd_path_absorb(vertex, j->wi, sender, j->distance, j->value);
    j->cosine = fabsf(bd_vec3f_dot(sender->bsdf.surface.normal_geometric, wo));
    return j->value[0] > 0 || j->value[1] > 0 || j->value[2] > 0;
}

static bool is_open(struct bd_path *path, const struct bd_vertex *vertex, const struct junction *j)
{
    if (!path->integrand->indirect_visibility) return true;
    const struct bd_intersection *at = &path->light_vertex.at;
    float target[3], side = bd_vec3f_dot(at->hit.normal_geometric, j->wi) > 0 ? -1 : 1;
    bd_vec3f_add_scaled(target, at->position, at->hit.normal_geometric, side * at->clearance);
    return bd_path_sees(path, vertex, target);
}

void bd_path_add_light_vertex(struct bd_path *path, const struct bd_vertex *vertex)
{
    struct bd_light_vertex *v = &path->light_vertex;
    struct junction j;
    if (!bd_path_has_light_vertices(path, path->events + 2)) return;
    if (bd_bsdf_is_delta(&vertex->bsdf.surface)) return;
    if (!v->traced) trace(path, v);
    if (!v->found || !bd_path_has_light_vertices(path, path->events + 2 + v->passed)) return;
    if (!aim(path, vertex, &j) || !is_open(path, vertex, &j)) return;
    if (!evaluate(path, vertex, &j)) return;
    float per_area = j.cosine / (j.distance * j.distance);
    float found_pdf = v->passed > 0 ? 0 : j.scatter_pdf * bd_path_survival(path, vertex) * per_area;
    float receiver_cosine = bd_vec3f_dot(vertex->bsdf.surface.normal, j.wi);
    float factor = per_area / (v->pdf + found_pdf) *
                   bd_path_clamp(path, receiver_cosine, j.cosine, j.distance);
    bd_vec3f_scale(j.value, j.value, factor);
    bd_path_add(path, path->events + 2 + v->passed, j.value);
}
