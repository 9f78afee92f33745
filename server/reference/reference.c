#include "reference/reference.h"

#include <math.h>
#include <stdlib.h>

#include "base/assert.h"
#include "reference/camera.h"
#include "reference/path.h"
#include "reference/vec3f.h"

const struct bd_integrand bd_integrand_full = {
    .bounces_max = BD_BOUNCES_UNLIMITED,
    .indirect_visibility = true,
    .lights = BD_REFERENCE_ALL_LIGHTS,
    .indirect_lights = BD_REFERENCE_ALL_LIGHTS,
    .filter = BD_FILTER_POINT,
    .alpha = BD_ALPHA_AS_COVERAGE,
    .clamp_per_m2 = INFINITY,
    .transmission = true,
    .light_vertices = true,
};

// --- making one ---------------------------------------------------------------------------------

static double strongest_channel(const float color[3])
{
    return fmax(color[0], fmax(color[1], color[2]));
}

// A power of two near the strongest light: how bright a scene is costs no digits.
static double unit_of(const struct bd_geometry *geometry)
{
    const struct bd_scene *scene = geometry->scene;
    double strongest = bd_punctuals_strongest(geometry);
    for (uint32_t i = 0; i < scene->material_count; i++)
        strongest = fmax(strongest, strongest_channel(scene->materials[i].emissive));
    strongest = fmax(strongest, strongest_channel(scene->environment.radiance));
    if (!(strongest > 0) || !isfinite(strongest)) return 1;
    int exponent;
    frexp(strongest, &exponent);
    return ldexp(1.0, exponent - 1);
}

// What is left after the attenuation distance is the attenuation colour.
static void set_medium(struct bd_medium *medium, const struct bd_material *m, double units_per_m)
{
    if (!(m->thickness_m > 0) || !isfinite(m->attenuation_distance_m)) return;
    for (int k = 0; k < 3; k++) {
        double color = fmin(fmax(m->attenuation_color[k], 1e-6), 1);
        double distance = fmax(m->attenuation_distance_m * units_per_m, 1e-9);
        medium->per_unit[k] = (float)(-log(color) / distance);
        if (medium->per_unit[k] > 0) medium->absorbs = true;
    }
}

static enum bd_err set_media(struct bd_reference *r, struct bd_err_detail *detail)
{
    const struct bd_scene *scene = r->scene;
    r->media = calloc((size_t)scene->material_count + 1, sizeof *r->media);
    if (!r->media)
        return bd_err_set(detail, BD_ERR_NO_MEMORY, "reference", "no memory for %u materials",
                          scene->material_count);
    for (uint32_t i = 0; i < scene->material_count; i++)
        set_medium(&r->media[i], &scene->materials[i], r->geometry.units_per_m);
    return BD_ERR_OK;
}

// What follows from a snapshot whose triangles are prepared.
static enum bd_err init_light(struct bd_reference *r, struct bd_err_detail *detail)
{
    r->unit_cd_m2 = unit_of(&r->geometry);
    enum bd_err err = set_media(r, detail);
    if (!err) err = bd_reference_find_smooth(r, detail);
    if (!err) err = bd_punctuals_init(&r->punctuals, &r->geometry, r->unit_cd_m2, detail);
    if (!err) err = bd_emitters_init(&r->emitters, &r->geometry, detail);
    if (!err) err = bd_sky_init(&r->sky, &r->scene->environment, detail);
    return err;
}

static struct bd_reference *of_scene(struct bd_scene *scene)
{
    struct bd_reference *reference = calloc(1, sizeof *reference);
    BD_ASSERT(reference);
    reference->scene = bd_scene_retain(scene);
    return reference;
}

enum bd_err bd_reference_create(struct bd_scene *scene, uint32_t thread_count,
                                bd_reference_should_stop should_stop, void *user,
                                struct bd_reference **out, struct bd_err_detail *detail)
{
    struct bd_reference *reference = of_scene(scene);
    enum bd_err err =
        bd_geometry_init(&reference->geometry, scene, thread_count, should_stop, user, detail);
    if (!err) err = init_light(reference, detail);
    if (err)
        bd_reference_destroy(&reference);
    else
        *out = reference;
    return err;
}

enum bd_err bd_reference_create_like(struct bd_scene *scene, const struct bd_reference *like,
                                     struct bd_reference **out, struct bd_err_detail *detail)
{
    struct bd_reference *reference = of_scene(scene);
    enum bd_err err = bd_geometry_init_like(&reference->geometry, scene, &like->geometry)
                          ? init_light(reference, detail)
                          : BD_ERR_NOT_FOUND;
    if (err)
        bd_reference_destroy(&reference);
    else
        *out = reference;
    return err;
}

void bd_reference_destroy(struct bd_reference **reference)
{
    struct bd_reference *r = *reference;
    if (!r) return;
    bd_sky_finish(&r->sky);
    bd_emitters_finish(&r->emitters);
    bd_punctuals_finish(&r->punctuals);
    bd_geometry_finish(&r->geometry);
    free(r->media);
    free(r->smooth);
    bd_scene_release(&r->scene);
    free(r);
    *reference = NULL;
}

struct bd_reference_memory bd_reference_memory(const struct bd_reference *reference)
{
    const struct bd_sky_map *map =
        reference->sky.columns ? reference->scene->environment.map : NULL;
    uint64_t sky_texels = map ? (uint64_t)map->width_px * map->height_px : 0;
    return (struct bd_reference_memory){
        .own_bytes = sizeof *reference + bd_geometry_own_bytes(&reference->geometry) +
                     bd_punctuals_bytes(&reference->punctuals) +
                     bd_emitters_bytes(&reference->emitters) +
                     sky_texels * sizeof *reference->sky.columns,
        .shape_bytes = bd_shape_memory_bytes(reference->geometry.shape),
        .shape = reference->geometry.shape,
    };
}

// --- sums ---------------------------------------------------------------------------------------

static bool is_usable(const struct bd_path *path)
{
    for (int p = 0; p < BD_PART_COUNT; p++)
        for (int k = 0; k < 3; k++)
            if (!isfinite(path->sum[p][k]) || path->sum[p][k] < 0) return false;
    return true;
}

// `unit`: what the path's sums are multiples of.
static void add_sample(struct bd_reference_pixel *pixel, uint32_t half, const struct bd_path *path,
                       double unit)
{
    pixel->sample_count[half]++;
    pixel->missing_count += path->misses_caustics;
    if (!is_usable(path)) {
        pixel->nonfinite_count++;
        return;
    }
    for (int k = 0; k < 3; k++) {
        double beauty = 0;
        for (int p = 0; p < BD_PART_COUNT; p++) {
            double value = path->sum[p][k] * unit;
            pixel->sum[half][p][k] += value;
            pixel->square_sum[p][k] += value * value;
            beauty += value;
        }
        pixel->beauty_square_sum[k] += beauty * beauty;
    }
}

static void add_first(struct bd_reference_pixel *pixel, const struct bd_surface *surface,
                      double depth_m)
{
    pixel->coverage += 1;
    pixel->depth_m += depth_m;
    for (int k = 0; k < 3; k++) {
        pixel->albedo[k] += surface->base_color[k];
        pixel->normal[k] += surface->normal[k];
    }
}

// --- pictures -----------------------------------------------------------------------------------

struct shot {
    const struct bd_reference *reference;
    const struct bd_integrand *integrand;
    struct bd_lens lens;
    double x_px, y_px;
};

static void trace_sample(const struct shot *shot, struct bd_sampler sampler, uint32_t half,
                         struct bd_reference_pixel *pixel)
{
    const struct bd_geometry *geometry = &shot->reference->geometry;
    struct bd_path path;
    bd_path_begin(shot->reference, shot->integrand, sampler, &path);
    struct bd_ray ray = {0};
    struct bd_vertex first;
    float offset[2] = {(float)(0.5 + BD_TIE_RIGHT * shot->lens.width_px),
                       (float)(0.5 - BD_TIE_UP * shot->lens.height_px)};
    float distance;
    double start, depth_per_distance;
    if (shot->integrand->filter == BD_FILTER_BOX) bd_sampler_pair(&sampler, BD_PAIR_CAMERA, offset);
    bd_lens_ray(&shot->lens, geometry, shot->x_px + offset[0], shot->y_px + offset[1], &ray, &start,
                &depth_per_distance);
    if (bd_path_from_camera(&path, &ray, &first, &distance))
        add_first(pixel, &first.bsdf.surface,
                  (start + distance * depth_per_distance) / geometry->units_per_m);
    add_sample(pixel, half, &path, shot->reference->unit_cd_m2);
}

// The scene's own lights: a default rig stands in for what would shine and lights nothing.
struct bd_integrand bd_reference_without_rig(const struct bd_reference *reference,
                                             const struct bd_integrand *integrand)
{
    struct bd_integrand own = *integrand;
    if (bd_scene_lights_yield(reference->scene, (own.lights & BD_REFERENCE_EMISSIVE) != 0,
                              (own.lights & BD_REFERENCE_ENVIRONMENT) != 0))
        own.lights &= ~(uint32_t)BD_REFERENCE_PUNCTUAL;
    return own;
}

void bd_reference_trace(const struct bd_reference *reference, const struct bd_integrand *integrand,
                        const struct bd_reference_view *view, uint64_t seed, uint32_t x_px,
                        uint32_t y_px, uint32_t first, uint32_t count,
                        struct bd_reference_pixel *pixel)
{
    BD_ASSERT_CMP(view->camera, <, reference->scene->placed_camera_count);
    const struct bd_integrand own = bd_reference_without_rig(reference, integrand);
    const struct shot shot = {reference, &own, bd_lens_of(&reference->geometry, view), x_px, y_px};
    uint64_t refused_before = bd_geometry_refused_ray_count();
    for (uint32_t half = 0; half < 2; half++)
        for (uint32_t i = first; i < first + count; i++)
            trace_sample(&shot, bd_sampler_at(seed, x_px, y_px, half, i), half, pixel);
    pixel->refused_ray_count += bd_geometry_refused_ray_count() - refused_before;
}

// --- points -------------------------------------------------------------------------------------

// A white Lambertian receiver that is not in the scene: it shows what it receives, over pi.
static struct bd_vertex receiver_at(const struct bd_geometry *geometry, const double point[3],
                                    const double normal[3])
{
    bd_dvec3 at = bd_geometry_place(geometry, (bd_dvec3){point[0], point[1], point[2]});
    struct bd_vertex v = {
        .bsdf.surface = {.base_color = {1, 1, 1}, .ior = 1.5f, .lambert = true, .entering = true},
        .position = {(float)at.x, (float)at.y, (float)at.z},
        .clearance = 0x1p-20f,
    };
    struct bd_surface *s = &v.bsdf.surface;
    for (int k = 0; k < 3; k++) v.wo[k] = s->normal[k] = s->normal_geometric[k] = (float)normal[k];
    return v;
}

void bd_reference_irradiance(const struct bd_reference *reference,
                             const struct bd_integrand *integrand, const double point[3],
                             const double normal[3], uint64_t seed, uint32_t first, uint32_t count,
                             struct bd_reference_pixel *sums)
{
    const double pi = 3.14159265358979323846;
    const struct bd_vertex receiver = receiver_at(&reference->geometry, point, normal);
    const struct bd_integrand own = bd_reference_without_rig(reference, integrand);
    for (uint32_t half = 0; half < 2; half++)
        for (uint32_t i = first; i < first + count; i++) {
            struct bd_path path;
            bd_path_begin(reference, &own, bd_sampler_at(seed, 0, 0, half, i), &path);
            bd_path_from_vertex(&path, &receiver);
            add_sample(sums, half, &path, reference->unit_cd_m2 * pi);
        }
}

uint64_t bd_reference_ray_count(void)
{
    return bd_geometry_ray_count();
}
