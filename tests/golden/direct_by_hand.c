// direct_by_hand SCENE.glb WxH OUT.f32 [HABIT]...
//
// The direct layer of a Lambertian scene, lit by its punctual lights, without chance: a ray grid in
// each pixel, one ray to each light. By itself it is what the reference's direct layer tends to.
// With habits it tells apart why the independent renderer's pictures differ from that:
//
//   pixel=W       a pixel is a box of W pixels (theirs: .01 where a picture says `point`)
//   decode_last   texels are filtered as they are coded, and sRGB is decoded afterwards
//   bend          a mapped normal is turned towards the triangle's until the eye's mirror direction
//                 clears the surface
//   soften        light is lessened where it comes from below the unmapped normal's horizon as seen
//                 from the mapped one (Estevez et al. 2019, A Microfacet-Based Shadowing Function)
//   twins         rays to lights start on the surface, which a second one may share, and skip the
//                 triangle they start from, nothing else
//
// OUT: direct, albedo, and the share of the pixel where two surfaces lie in one place; seven floats
// a pixel, rows from the top.

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "reference/geometry.h"
#include "reference/texture.h"
#include "reference/vec3f.h"
#include "tests/tools/bsdf_once.h"
#include "tests/tools/load_scene.h"

#define GRID     8  // rays along a pixel's side
#define LAYERS   16 // surfaces behind each other that let light pass
#define CHANNELS 7

struct habits {
    double pixel;
    bool decode_last, bend, soften, twins;
};

struct work {
    struct bd_scene *scene;
    struct bd_scene unmapped; // the same without normal maps
    struct bd_scene solid;    // the same without coverage: rays meet all, shares are ours
    struct bd_geometry geometry;
    const struct bd_placement *placed;
    const struct bd_camera *camera;
    uint32_t width_px, height_px;
    struct habits habits;
};

static void set3(float out[3], bd_dvec3 v)
{
    bd_vec3f_set(out, (float)v.x, (float)v.y, (float)v.z);
}

// --- surfaces -----------------------------------------------------------------------------------

static float alpha_of(const struct work *work, const struct bd_intersection *m)
{
    const struct bd_material *material = &work->scene->materials[m->hit.primitive->material];
    return material->alpha_mode == BD_ALPHA_BLEND ? bd_surface_alpha(work->scene, &m->hit) : 1;
}

static float decoded(float c)
{
    return c <= 0.04045f ? c / 12.92f : powf((c + 0.055f) / 1.055f, 2.4f);
}

// Replaces the map's decoded, then filtered texel in `color` by its filtered, then decoded one.
static void decode_last(const struct work *work, const struct bd_hit *hit, float color[3])
{
    const struct bd_primitive *p = hit->primitive;
    const struct bd_texture_ref *ref = &work->scene->materials[p->material].base_color_map;
    if (ref->texture == BD_NONE) return;
    const uint32_t *index = p->index + 3 * (size_t)hit->triangle;
    const float weight[3] = {1 - hit->u - hit->v, hit->u, hit->v};
    float uv[2] = {0, 0}, first[4], last[4];
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < 2; k++)
            uv[k] += weight[c] * p->uv[ref->uv_set][2 * (size_t)index[c] + k];
    const float *m = ref->uv_transform;
    float u = m[0] * uv[0] + m[1] * uv[1] + m[2], v = m[3] * uv[0] + m[4] * uv[1] + m[5];
    const struct bd_texture *texture = &work->scene->textures[ref->texture];
    bd_texture_at(work->scene, texture, true, u, v, first);
    bd_texture_at(work->scene, texture, false, u, v, last);
    for (int k = 0; k < 3; k++)
        if (first[k] > 0) color[k] *= decoded(last[k]) / first[k];
}

// How far the mirror direction of `wo` clears the surface for a normal turned by `angle` from `z`
// towards `x`.
static float clears(float angle, float wo_x, float wo_z)
{
    float n_x = sinf(angle), n_z = cosf(angle);
    return 2 * (n_x * wo_x + n_z * wo_z) * n_z - wo_z;
}

// The least turn towards the geometric normal, by bisection.
static void bend(const float geometric[3], const float wo[3], float n[3])
{
    float wo_z = bd_vec3f_dot(wo, geometric), x[3], least = fminf(0.9f * wo_z, 0.01f);
    float cosine = fminf(fmaxf(bd_vec3f_dot(n, geometric), -1), 1), low = 0, high = acosf(cosine);
    bd_vec3f_add_scaled(x, n, geometric, -cosine);
    if (!bd_vec3f_normalize(x)) return;
    float wo_x = bd_vec3f_dot(wo, x);
    if (clears(high, wo_x, wo_z) >= least) return;
    for (int i = 0; i < 40; i++) {
        float middle = 0.5f * (low + high);
        if (clears(middle, wo_x, wo_z) >= least)
            low = middle;
        else
            high = middle;
    }
    for (int k = 0; k < 3; k++) n[k] = sinf(low) * x[k] + cosf(low) * geometric[k];
}

static float softened(const float unmapped[3], const float n[3], const float wi[3])
{
    float across = bd_vec3f_dot(unmapped, n);
    if (across > 1 - 1e-7f) return 1;
    float g = bd_vec3f_dot(unmapped, wi) / (bd_vec3f_dot(n, wi) * across);
    if (g >= 1 || g < 0) return g >= 1;
    return g + g * g - g * g * g;
}

// A surface as met by a ray.
struct found {
    struct bd_surface surface;
    float unmapped[3]; // normal without the map
    float position[3];
};

static void find(const struct work *work, const struct bd_ray *ray, const struct bd_intersection *m,
                 struct found *out)
{
    const struct habits *habits = &work->habits;
    struct bd_surface unmapped;
    float wo[3];
    bd_vec3f_scale(wo, ray->direction, -1);
    bd_surface_at(work->scene, &m->hit, wo, true, false, &out->surface);
    bd_surface_at(&work->unmapped, &m->hit, wo, true, false, &unmapped);
    bd_vec3f_copy(out->unmapped, unmapped.normal);
    struct bd_surface *s = &out->surface;
    if (habits->decode_last) decode_last(work, &m->hit, s->base_color);
    if (habits->bend && m->part->material->normal_map.texture != BD_NONE)
        bend(s->normal_geometric, wo, s->normal);
    if (habits->twins)
        bd_vec3f_add_scaled(out->position, ray->origin, ray->direction, m->distance);
    else
        bd_vec3f_add_scaled(out->position, m->position, s->normal_geometric, m->clearance);
}

// Whether a second triangle lies where the ray met one: looking back from just behind.
static bool has_twin(const struct work *work, const struct bd_ray *ray,
                     const struct bd_intersection *m)
{
    struct bd_ray back = {.near = 0, .far = 8 * m->clearance, .alpha = BD_ALPHA_AS_MASK};
    struct bd_intersection other;
    bd_vec3f_add_scaled(back.origin, m->position, ray->direction, 4 * m->clearance);
    bd_vec3f_scale(back.direction, ray->direction, -1);
    if (!bd_geometry_intersect(&work->geometry, &back, BD_SIGHT_ALL, &other)) return false;
    return other.hit.primitive != m->hit.primitive || other.hit.triangle != m->hit.triangle;
}

// --- light --------------------------------------------------------------------------------------

// The share of light that gets through between a point and a light.
static double passed(const struct work *work, const float from[3], const float span[3],
                     const struct bd_hit *own)
{
    struct bd_ray ray = {.far = 1, .alpha = BD_ALPHA_AS_MASK};
    bd_vec3f_copy(ray.origin, from);
    bd_vec3f_copy(ray.direction, span);
    double share = 1;
    struct bd_intersection m;
    for (int i = 0; i < LAYERS && bd_geometry_intersect(&work->geometry, &ray, BD_SIGHT_ALL, &m);
         i++) {
        bool is_own = m.hit.primitive == own->primitive && m.hit.triangle == own->triangle;
        share *= work->habits.twins && is_own ? 1 : 1 - alpha_of(work, &m);
        if (share == 0) return 0;
        ray.near = nextafterf(m.distance, INFINITY);
    }
    return share;
}

// KHR_lights_punctual, at normal incidence, in lx; `span` in reference units.
static double illuminance(const struct work *work, const struct bd_placement *placed, bd_dvec3 span)
{
    const struct bd_light *light = &work->scene->lights[placed->object];
    if (light->kind == BD_LIGHT_DIRECTIONAL) return light->intensity;
    double distance_m = bd_dvec3_length(span) / work->geometry.units_per_m, attenuation = 1;
    if (light->kind == BD_LIGHT_SPOT) {
        double cosine = bd_dvec3_dot(span, placed->axis_z) / bd_dvec3_length(span);
        double inner = cos(light->cone_inner), outer = cos(light->cone_outer);
        attenuation = fmin(fmax((cosine - outer) / fmax(inner - outer, 1e-7), 0), 1);
    }
    double window = fmin(fmax(1 - pow(distance_m / light->range_m, 4), 0), 1);
    return light->intensity * attenuation * attenuation * window / (distance_m * distance_m);
}

static void add_light(const struct work *work, const struct bd_placement *placed,
                      const struct found *found, const struct bd_hit *own, double share, float *to)
{
    const struct bd_light *light = &work->scene->lights[placed->object];
    const float *p = found->position;
    bd_dvec3 at = bd_geometry_place(&work->geometry, placed->position);
    bd_dvec3 span = bd_dvec3_sub(at, (bd_dvec3){p[0], p[1], p[2]});
    if (light->kind == BD_LIGHT_DIRECTIONAL) span = bd_dvec3_scale(placed->axis_z, 4);
    float wi[3], to_light[3], f_cos[3], density;
    set3(wi, bd_dvec3_normalize(span, placed->axis_z));
    set3(to_light, span);
    eval_once(&found->surface, wi, wi, f_cos, &density);
    double lx = illuminance(work, placed, span) * share;
    if (density == 0 || lx == 0) return;
    if (work->habits.soften) lx *= softened(found->unmapped, found->surface.normal, wi);
    lx *= passed(work, p, to_light, own);
    for (int k = 0; k < 3; k++) to[k] += (float)(f_cos[k] * lx) * light->color[k];
}

// --- the picture --------------------------------------------------------------------------------

static struct bd_ray camera_ray(const struct work *work, double x_px, double y_px)
{
    double half = tan(work->camera->yfov / 2), height = work->height_px;
    double x = (2 * x_px - work->width_px) / height * half, y = (1 - 2 * y_px / height) * half;
    bd_dvec3 forward = bd_dvec3_scale(work->placed->axis_z, -1);
    bd_dvec3 d = bd_dvec3_add(forward, bd_dvec3_add(bd_dvec3_scale(work->placed->axis_x, x),
                                                    bd_dvec3_scale(work->placed->axis_y, y)));
    struct bd_ray ray = {.far = INFINITY, .alpha = BD_ALPHA_AS_MASK};
    set3(ray.origin, bd_geometry_place(&work->geometry, work->placed->position));
    set3(ray.direction, bd_dvec3_normalize(d, forward));
    return ray;
}

static void add_ray(const struct work *work, double x_px, double y_px, double share, float *to)
{
    struct bd_ray ray = camera_ray(work, x_px, y_px);
    struct bd_intersection m;
    for (int i = 0; i < LAYERS && share > 0; i++) {
        if (!bd_geometry_intersect(&work->geometry, &ray, BD_SIGHT_ALL, &m)) return;
        struct found found;
        find(work, &ray, &m, &found);
        double here = share * alpha_of(work, &m);
        for (uint32_t l = 0; l < work->scene->placed_light_count; l++)
            add_light(work, &work->scene->placed_lights[l], &found, &m.hit, here, to);
        for (int k = 0; k < 3; k++) to[3 + k] += (float)here * found.surface.base_color[k];
        if (has_twin(work, &ray, &m)) to[6] += (float)here;
        share -= here;
        ray.near = nextafterf(m.distance, INFINITY);
    }
}

static void render(const struct work *work, float *pixels)
{
    for (uint32_t y = 0; y < work->height_px; y++) {
        for (uint32_t x = 0; x < work->width_px; x++, pixels += CHANNELS) {
            for (int s = 0; s < GRID * GRID; s++) {
                double dx = (s % GRID + 0.5) / GRID - 0.5,
                       dy = ((double)(s / GRID) + 0.5) / GRID - 0.5;
                add_ray(work, x + 0.5 + dx * work->habits.pixel, y + 0.5 + dy * work->habits.pixel,
                        1.0 / (GRID * GRID), pixels);
            }
        }
    }
}

static bool read_habit(const char *text, struct habits *habits)
{
    if (sscanf(text, "pixel=%lf", &habits->pixel) == 1) return true;
    const struct {
        const char *name;
        bool *flag;
    } known[] = {{"decode_last", &habits->decode_last},
                 {"bend", &habits->bend},
                 {"soften", &habits->soften},
                 {"twins", &habits->twins}};
    for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
        if (strcmp(text, known[i].name) != 0) continue;
        *known[i].flag = true;
        return true;
    }
    return false;
}

// Copies of the snapshot that share all but their materials.
static void copy_scenes(struct work *work)
{
    const struct bd_scene *scene = work->scene;
    work->unmapped = work->solid = *scene;
    work->unmapped.materials = calloc(scene->material_count, sizeof *scene->materials);
    work->solid.materials = calloc(scene->material_count, sizeof *scene->materials);
    if (!work->unmapped.materials || !work->solid.materials) abort();
    for (uint32_t m = 0; m < scene->material_count; m++) {
        work->unmapped.materials[m] = work->solid.materials[m] = scene->materials[m];
        work->unmapped.materials[m].normal_map.texture = BD_NONE;
        if (scene->materials[m].alpha_mode == BD_ALPHA_BLEND)
            work->solid.materials[m].alpha_mode = BD_ALPHA_OPAQUE;
    }
}

static enum bd_err run(struct work *work, const char *path, struct bd_err_detail *detail)
{
    const struct bd_scene *scene = work->scene;
    size_t count = (size_t)work->width_px * work->height_px * CHANNELS;
    float *pixels = calloc(count, sizeof *pixels);
    if (!pixels) abort();
    copy_scenes(work);
    work->placed = &scene->placed_cameras[bd_scene_find_camera(scene, "Camera")];
    work->camera = &scene->cameras[work->placed->object];
    enum bd_err err = bd_geometry_init(&work->geometry, &work->solid, 1, NULL, NULL, detail);
    if (!err) render(work, pixels);
    bd_geometry_finish(&work->geometry);
    FILE *file = err ? NULL : fopen(path, "wb");
    if (!err && (!file || fwrite(pixels, sizeof *pixels, count, file) != count))
        err = bd_err_set(detail, BD_ERR_IO, path, "cannot be written");
    if (file) fclose(file);
    free(work->unmapped.materials);
    free(work->solid.materials);
    free(pixels);
    return err;
}

int main(int argc, char **argv)
{
    struct work work = {0};
    bool ok = argc >= 4 && sscanf(argv[2], "%ux%u", &work.width_px, &work.height_px) == 2;
    for (int i = 4; ok && i < argc; i++) ok = read_habit(argv[i], &work.habits);
    if (!ok) {
        fprintf(stderr, "usage: direct_by_hand SCENE WxH OUT.f32 [HABIT]...\n");
        return 2;
    }
    struct bd_err_detail detail = {0};
    enum bd_err err = load_scene(argv[1], &work.scene, &detail);
    if (!err) err = run(&work, argv[3], &detail);
    bd_scene_release(&work.scene);
    if (err) fprintf(stderr, "direct_by_hand: %s: %s\n", detail.field, detail.message);
    return bd_err_exit_code(err);
}
