// Light that left a punctual light and that smooth surfaces alone have sent on (L S+), up to where
// it falls on something rough: as light vertices of eye paths (light_vertex.c), and joined to the
// eye, in the pixel that shows the place (bd_reference_light_path). No path from the eye finds the
// point again through what is smooth.
//
// What is carried is flux: through a solid's surface it keeps its amount, where radiance would grow
// by the index squared.

#include <math.h>
#include <stddef.h>
#include <stdlib.h>

#include "reference/camera.h"
#include "reference/path.h"
#include "reference/vec3f.h"

// --- what is smooth -----------------------------------------------------------------------------

// Whether a texel of the map has no roughness: nothing else makes a place smooth.
static bool has_smooth_texel(const struct bd_scene *scene, const struct bd_texture_ref *map)
{
    const struct bd_texture *texture = &scene->textures[map->texture];
    const struct bd_picture *picture =
        texture->picture == BD_NONE ? NULL : scene->pictures[texture->picture];
    if (!picture || !picture->rgba) return false;
    bool any = false;
    const size_t texels = (size_t)picture->width_px * picture->height_px;
    for (size_t i = 0; i < texels && !any; i++) any = picture->rgba[4 * i + 1] == 0;
    return any;
}

static bool is_smooth(const struct bd_scene *scene, const struct bd_material *material)
{
    if (material->unlit) return false;
    if (material->roughness == 0) return true;
    const struct bd_texture_ref *map = &material->metallic_roughness_map;
    return map->texture != BD_NONE && has_smooth_texel(scene, map);
}

enum bd_err bd_reference_find_smooth(struct bd_reference *reference, struct bd_err_detail *detail)
{
    const struct bd_scene *scene = reference->scene;
    reference->smooth = calloc((size_t)scene->material_count + 1, sizeof *reference->smooth);
    if (!reference->smooth)
        return bd_err_set(detail, BD_ERR_NO_MEMORY, "reference", "no memory for %u materials",
                          scene->material_count);
    for (uint32_t i = 0; i < scene->material_count; i++) {
        reference->smooth[i] = is_smooth(scene, &scene->materials[i]);
        reference->has_smooth |= reference->smooth[i];
        reference->has_panes |= reference->smooth[i] && scene->materials[i].transmission > 0 &&
                                !(scene->materials[i].thickness_m > 0);
    }
    return BD_ERR_OK;
}

static bool may_be_smooth(const struct bd_path *path, const struct bd_carried *carried)
{
    return path->reference->smooth[carried->at.hit.primitive->material];
}

// --- from the light -----------------------------------------------------------------------------

bool bd_path_leave_light(struct bd_path *path, const float choice, const float u[2],
                         struct bd_carried *out, struct bd_illumination *light)
{
    const struct bd_punctuals *punctuals = &path->reference->punctuals;
    struct bd_ray ray = {
        .far = INFINITY,
        .alpha = path->integrand->alpha,
        .coverage_seed = bd_path_ray_seed(path),
    };
    const struct bd_punctual *punctual =
        bd_punctuals_sample_ray(punctuals, choice, u, ray.origin, ray.direction);
    if (!bd_path_intersect(path, &ray, &out->at)) return false;
    if (!bd_punctual_illuminates(punctuals, punctual, out->at.position, light)) return false;
    bd_vec3f_copy(out->towards_light, light->direction);
    out->passed = 0;
    out->solids.count = 0;
    out->punctual = punctual;
    out->straight = bd_path_looks_straight(path);
    out->way = bd_straight_free;
    if (!(light->pdf > 0)) return false;
    bd_vec3f_scale(out->flux, light->normal_illuminance, 1 / light->pdf);
    return true;
}

static float of_hash(struct bd_path *path)
{
    return (float)(bd_sampler_hash(&path->sampler, path->ray_index++) >> 8) * 0x1p-24f;
}

// Radiance's factor taken back.
static float index_squared(const struct bd_surface *surface, const struct bd_bsdf_sample *sample)
{
    if (!sample->transmitted || surface->thin) return 1;
    return surface->entering ? surface->ior * surface->ior : 1 / (surface->ior * surface->ior);
}

// Clear glass and white mirrors take nothing: what they hold goes round until chance ends it
// (Russian roulette).
#define PASSED_WITHOUT_ROULETTE 32u
#define SURVIVAL                0.75f

static bool survives(struct bd_path *path, struct bd_carried *carried)
{
    if (carried->passed < PASSED_WITHOUT_ROULETTE) return true;
    bd_vec3f_scale(carried->flux, carried->flux, 1 / SURVIVAL);
    return of_hash(path) < SURVIVAL;
}

bool bd_path_pass_on(struct bd_path *path, struct bd_carried *carried)
{
    if (!may_be_smooth(path, carried) || !survives(path, carried)) return false;
    struct bd_vertex vertex;
    bd_path_vertex(path, &carried->at, carried->towards_light, &carried->solids, &vertex);
    bd_path_make_sender(path, &vertex.bsdf.surface);
    const float u[3] = {of_hash(path), of_hash(path), of_hash(path)};
    struct bd_bsdf_sample sample;
    if (!bd_bsdf_sample(&vertex.bsdf, u, &sample) || !sample.delta) return false;
    carried->straight &=
        sample.transmitted &&
        bd_path_add_pane(path, &carried->at, carried->towards_light, &carried->way);
    struct bd_ray ray;
    bd_path_ray(path, &vertex, sample.wi, INFINITY, &ray);
    if (sample.transmitted && vertex.solid)
        bd_nested_cross(&carried->solids, vertex.solid, vertex.bsdf.surface.entering);
    if (!bd_path_meet(path, &vertex, &ray, &carried->solids, carried->flux, &carried->at))
        return false;
    bd_vec3f_filter(carried->flux, carried->flux, sample.weight);
    bd_vec3f_scale(carried->flux, carried->flux, index_squared(&vertex.bsdf.surface, &sample));
    bd_vec3f_scale(carried->towards_light, sample.wi, -1);
    carried->passed += !carried->straight;
    return carried->flux[0] > 0 || carried->flux[1] > 0 || carried->flux[2] > 0;
}

// Whether nothing but what is smooth is there: only then is it no place to join.
bool bd_path_is_smooth(const struct bd_path *path, const struct bd_carried *carried)
{
    if (!may_be_smooth(path, carried)) return false;
    struct bd_vertex vertex;
    bd_path_vertex(path, &carried->at, carried->towards_light, &carried->solids, &vertex);
    bd_path_make_sender(path, &vertex.bsdf.surface);
    return bd_bsdf_is_delta(&vertex.bsdf.surface);
}

// --- to the eye ---------------------------------------------------------------------------------

struct landing {
    const struct bd_lens *lens;
    bd_reference_land land;
    void *user;
    double unit_cd_m2;
};

static bool is_seen(struct bd_path *path, const struct bd_vertex *vertex,
                    const struct bd_seen *sight)
{
    float target[3];
    bd_vec3f_add_scaled(target, vertex->position, sight->to_eye, sight->reach);
    return bd_path_sees(path, vertex, target);
}

static void join_eye(struct bd_path *path, const struct bd_carried *carried,
                     const struct landing *landing)
{
    struct bd_seen sight;
    if (!bd_lens_sees(landing->lens, carried->at.position, &sight)) return;
    const float *normal = carried->at.hit.normal_geometric;
    const float cosine = bd_vec3f_dot(normal, sight.to_eye);
    const float arrives = fabsf(bd_vec3f_dot(normal, carried->towards_light));
    if (cosine <= 0 && !carried->at.part->material->double_sided) return;
    struct bd_vertex vertex;
    bd_path_vertex(path, &carried->at, sight.to_eye, NULL, &vertex);
    float value[3];
    bd_bsdf_eval(&vertex.bsdf, carried->towards_light, value, NULL);
    bd_vec3f_filter(value, value, carried->flux);
    if (!(value[0] > 0 || value[1] > 0 || value[2] > 0) || !(arrives > 0)) return;
    if (!is_seen(path, &vertex, &sight)) return;
    const double factor = sight.px2_per_area * fabsf(cosine) / arrives * landing->unit_cd_m2;
    const double cd_m2[3] = {value[0] * factor, value[1] * factor, value[2] * factor};
    landing->land(landing->user, (uint32_t)sight.x_px, (uint32_t)sight.y_px, cd_m2);
}

bool bd_reference_has_light_paths(const struct bd_reference *reference,
                                  const struct bd_integrand *integrand)
{
    const struct bd_integrand own = bd_reference_without_rig(reference, integrand);
    return reference->has_smooth && reference->punctuals.count > 0 && integrand->light_vertices &&
           own.lights & own.indirect_lights & BD_REFERENCE_PUNCTUAL && integrand->bounces_max > 0 &&
           integrand->indirect_visibility && !integrand->lambert && !integrand->lambert_senders &&
           integrand->lamp_radius_m == 0;
}

void bd_reference_light_path(const struct bd_reference *reference,
                             const struct bd_integrand *integrand,
                             const struct bd_reference_view *view, uint64_t seed, uint32_t half,
                             uint32_t index, uint64_t number, bd_reference_land land, void *user)
{
    const uint32_t x = (uint32_t)(number % view->width_px), y = (uint32_t)(number / view->width_px);
    const struct bd_sampler sampler = bd_sampler_at(bd_mix64(seed), x, y, half, index);
    const struct bd_lens lens = bd_lens_of(&reference->geometry, view);
    const struct landing landing = {&lens, land, user, reference->unit_cd_m2};
    struct bd_path path;
    struct bd_carried carried;
    struct bd_illumination light;
    float u[2], choice[2];
    bd_path_begin(reference, integrand, sampler, &path);
    bd_sampler_pair(&path.sampler, BD_PAIR_LIGHT_RAY, u);
    bd_sampler_pair(&path.sampler, BD_PAIR_LIGHT_CHOICE, choice);
    if (!bd_path_leave_light(&path, choice[0], u, &carried, &light)) return;
    while (carried.passed < integrand->bounces_max && bd_path_pass_on(&path, &carried))
        if (!carried.straight) join_eye(&path, &carried, &landing);
}
