#include "reference/punctual.h"

#include <math.h>
#include <stdlib.h>

#include "reference/vec3f.h"

static const double pi = 3.14159265358979323846;

static double strongest_channel(const float color[3])
{
    return fmax(color[0], fmax(color[1], color[2]));
}

// Candela are lumen per steradian: a light of a scene twice as large needs four times as much.
static double per_unit_of(const struct bd_geometry *geometry, const struct bd_light *light)
{
    double units_per_m = geometry->units_per_m;
    return light->kind == BD_LIGHT_DIRECTIONAL ? 1 : units_per_m * units_per_m;
}

double bd_punctuals_strongest(const struct bd_geometry *geometry)
{
    const struct bd_scene *scene = geometry->scene;
    double strongest = 0;
    for (uint32_t i = 0; i < scene->placed_light_count; i++) {
        const struct bd_light *light = &scene->lights[scene->placed_lights[i].object];
        double value =
            light->intensity * strongest_channel(light->color) * per_unit_of(geometry, light);
        strongest = fmax(strongest, value);
    }
    return strongest;
}

static void set_vector(float to[3], bd_dvec3 v)
{
    bd_vec3f_set(to, (float)v.x, (float)v.y, (float)v.z);
}

static void fill(struct bd_punctual *punctual, const struct bd_geometry *geometry,
                 const struct bd_light *light, const struct bd_placement *placed, double unit_cd_m2)
{
    double per_unit = light->intensity * per_unit_of(geometry, light) / unit_cd_m2;
    double range = (double)light->range_m * geometry->units_per_m;
    double inner = cos(light->cone_inner), outer = cos(light->cone_outer);
    bool unlimited = light->kind == BD_LIGHT_DIRECTIONAL || !isfinite(range);
    *punctual = (struct bd_punctual){
        .kind = light->kind,
        .position = bd_geometry_place(geometry, placed->position),
        .range_inverse = unlimited ? 0 : (float)(1 / range),
        .cos_outer = (float)outer,
        .cos_ramp_inverse = (float)(1 / fmax(inner - outer, 1e-7)),
        // The square of a ramp in the cosine has a third of the ramp's width for an integral.
        .steradians = (float)(2 * pi * ((1 - inner) + (inner - outer) / 3)),
    };
    if (light->kind == BD_LIGHT_POINT) punctual->steradians = (float)(4 * pi);
    for (int k = 0; k < 3; k++) punctual->intensity[k] = (float)(light->color[k] * per_unit);
    set_vector(punctual->axis_x, placed->axis_x);
    set_vector(punctual->axis_y, placed->axis_y);
    set_vector(punctual->axis, bd_dvec3_scale(placed->axis_z, -1));
}

static double flux_of(const struct bd_punctuals *punctuals, const struct bd_punctual *punctual)
{
    const float *i = punctual->intensity;
    double luminance = 0.2126 * i[0] + 0.7152 * i[1] + 0.0722 * i[2];
    double area = pi * punctuals->radius * punctuals->radius;
    return luminance * (punctual->kind == BD_LIGHT_DIRECTIONAL ? area : punctual->steradians);
}

static void set_probabilities(struct bd_punctuals *punctuals)
{
    double sum = 0, cumulated = 0;
    for (uint32_t i = 0; i < punctuals->count; i++)
        sum += flux_of(punctuals, &punctuals->punctuals[i]);
    for (uint32_t i = 0; i < punctuals->count; i++) {
        struct bd_punctual *punctual = &punctuals->punctuals[i];
        double flux = flux_of(punctuals, punctual);
        cumulated += flux;
        punctual->probability = (float)(flux / sum);
        punctual->cumulated = (float)(cumulated / sum);
    }
}

// Those that shine, of one kind: directional or with a place.
static void list(struct bd_punctuals *punctuals, const struct bd_geometry *geometry,
                 double unit_cd_m2, bool is_directional)
{
    const struct bd_scene *scene = geometry->scene;
    for (uint32_t i = 0; i < scene->placed_light_count; i++) {
        const struct bd_placement *placed = &scene->placed_lights[i];
        const struct bd_light *light = &scene->lights[placed->object];
        struct bd_punctual *punctual = &punctuals->punctuals[punctuals->count];
        if ((light->kind == BD_LIGHT_DIRECTIONAL) != is_directional) continue;
        fill(punctual, geometry, light, placed, unit_cd_m2);
        if (flux_of(punctuals, punctual) > 0) punctuals->count++;
    }
}

// What a point in its cone gets: by intensity, not by flux.
static struct bd_tree_light light_at(const void *user, uint32_t index)
{
    const struct bd_punctuals *punctuals = user;
    const struct bd_punctual *punctual = &punctuals->punctuals[index];
    struct bd_tree_light light = {.power = bd_vec3f_luminance(punctual->intensity)};
    set_vector(light.low, punctual->position);
    set_vector(light.high, punctual->position);
    light.reach.range = punctual->range_inverse > 0 ? 1 / punctual->range_inverse : INFINITY;
    light.reach.cosine = punctual->cos_outer;
    if (punctual->kind == BD_LIGHT_SPOT) bd_vec3f_copy(light.axis, punctual->axis);
    return light;
}

enum bd_err bd_punctuals_init(struct bd_punctuals *punctuals, const struct bd_geometry *geometry,
                              double unit_cd_m2, struct bd_err_detail *detail)
{
    const struct bd_scene *scene = geometry->scene;
    *punctuals = (struct bd_punctuals){.radius = (float)geometry->radius};
    punctuals->punctuals =
        calloc((size_t)scene->placed_light_count + 1, sizeof *punctuals->punctuals);
    if (!punctuals->punctuals)
        return bd_err_set(detail, BD_ERR_NO_MEMORY, "reference", "no memory for %u lights",
                          scene->placed_light_count);
    list(punctuals, geometry, unit_cd_m2, false);
    punctuals->near_count = punctuals->count;
    list(punctuals, geometry, unit_cd_m2, true);
    set_probabilities(punctuals);
    return bd_light_tree_init(&punctuals->tree, punctuals->near_count, true, light_at, punctuals,
                              detail);
}

void bd_punctuals_finish(struct bd_punctuals *punctuals)
{
    bd_light_tree_finish(&punctuals->tree);
    free(punctuals->punctuals);
    *punctuals = (struct bd_punctuals){0};
}

uint64_t bd_punctuals_bytes(const struct bd_punctuals *punctuals)
{
    return punctuals->count * sizeof *punctuals->punctuals +
           bd_light_tree_bytes(&punctuals->tree, punctuals->near_count);
}

// --- what a point gets --------------------------------------------------------------------------

// The square of a ramp in the cosine between the cone's outer and inner angle.
static float cone_falloff(const struct bd_punctual *punctual, const float from_punctual[3])
{
    if (punctual->kind != BD_LIGHT_SPOT) return 1;
    float ramp = (bd_vec3f_dot(from_punctual, punctual->axis) - punctual->cos_outer) *
                 punctual->cos_ramp_inverse;
    ramp = bd_minf(bd_maxf(ramp, 0), 1);
    return ramp * ramp;
}

// The window that the extension recommends: reaches 0 at the range.
static float range_window(const struct bd_punctual *punctual, float distance)
{
    float x = distance * punctual->range_inverse;
    return bd_minf(bd_maxf(1 - x * x * x * x, 0), 1);
}

static bool from_afar(const struct bd_punctuals *punctuals, const struct bd_punctual *punctual,
                      struct bd_illumination *out)
{
    bd_vec3f_scale(out->direction, punctual->axis, -1);
    bd_vec3f_copy(out->normal_illuminance, punctual->intensity);
    out->distance = INFINITY;
    out->pdf = punctual->probability / (BD_PI_F * punctuals->radius * punctuals->radius);
    return true;
}

// Told by squares, before any root: most of a scene is outside of a narrow cone.
static bool is_outside_cone(const struct bd_punctual *punctual, bd_dvec3 to_punctual)
{
    if (punctual->kind != BD_LIGHT_SPOT || punctual->cos_outer <= 0) return false;
    double along = -(to_punctual.x * punctual->axis[0] + to_punctual.y * punctual->axis[1] +
                     to_punctual.z * punctual->axis[2]);
    double least =
        (double)punctual->cos_outer * punctual->cos_outer * bd_dvec3_dot(to_punctual, to_punctual);
    return along <= 0 || along * along < least;
}

bool bd_punctual_illuminates(const struct bd_punctuals *punctuals,
                             const struct bd_punctual *punctual, const float position[3],
                             struct bd_illumination *out)
{
    if (punctual->kind == BD_LIGHT_DIRECTIONAL) return from_afar(punctuals, punctual, out);
    bd_dvec3 span =
        bd_dvec3_sub(punctual->position, (bd_dvec3){position[0], position[1], position[2]});
    if (is_outside_cone(punctual, span)) return false;
    double distance = bd_dvec3_length(span);
    if (!(distance > 1e-12)) return false;
    set_vector(out->direction, bd_dvec3_scale(span, 1 / distance));
    out->distance = (float)distance;
    float from_punctual[3];
    bd_vec3f_scale(from_punctual, out->direction, -1);
    float cone = cone_falloff(punctual, from_punctual);
    float per_area = cone / (float)(distance * distance);
    float factor = per_area * range_window(punctual, out->distance);
    if (!(factor > 0)) return false;
    bd_vec3f_scale(out->normal_illuminance, punctual->intensity, factor);
    out->pdf = punctual->probability * per_area / punctual->steradians;
    return true;
}

// --- rays ---------------------------------------------------------------------------------------

const struct bd_punctual *bd_punctuals_choose(const struct bd_punctuals *punctuals, float choice)
{
    uint32_t low = 0, high = punctuals->count - 1;
    while (low < high) {
        uint32_t middle = (low + high) / 2;
        if (punctuals->punctuals[middle].cumulated > choice)
            high = middle;
        else
            low = middle + 1;
    }
    return &punctuals->punctuals[low];
}

// The cosine to the axis, in proportion to the falloff: the flat part inside the inner angle, the
// squared ramp outside of it, which is the largest of three uniform numbers along the ramp.
static float spot_cosine(const struct bd_punctual *punctual, float u)
{
    float ramp_width = bd_minf(1 / punctual->cos_ramp_inverse, 1 - punctual->cos_outer);
    float flat_width = 1 - punctual->cos_outer - ramp_width;
    float flat_share = flat_width / (flat_width + ramp_width / 3);
    if (u < flat_share) return 1 - flat_width * (u / flat_share);
    float along = (u - flat_share) / (1 - flat_share);
    return punctual->cos_outer + ramp_width * cbrtf(along);
}

static void combine(const struct bd_punctual *punctual, float x, float y, float z, float out[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = punctual->axis_x[k] * x + punctual->axis_y[k] * y + punctual->axis[k] * z;
}

const struct bd_punctual *bd_punctuals_sample_ray(const struct bd_punctuals *punctuals,
                                                  float choice, const float u[2], float origin[3],
                                                  float direction[3])
{
    const struct bd_punctual *punctual = bd_punctuals_choose(punctuals, choice);
    float phi = 2 * BD_PI_F * u[1];
    if (punctual->kind == BD_LIGHT_DIRECTIONAL) {
        float r = punctuals->radius * sqrtf(u[0]);
        combine(punctual, r * cosf(phi), r * sinf(phi), -punctuals->radius * 1.01f, origin);
        bd_vec3f_copy(direction, punctual->axis);
        return punctual;
    }
    float cosine = punctual->kind == BD_LIGHT_SPOT ? spot_cosine(punctual, u[0]) : 1 - 2 * u[0];
    float sine = sqrtf(bd_maxf(1 - cosine * cosine, 0));
    combine(punctual, sine * cosf(phi), sine * sinf(phi), cosine, direction);
    bd_vec3f_normalize(direction);
    set_vector(origin, punctual->position);
    return punctual;
}
