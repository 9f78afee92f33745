#include "reference/lamps.h"

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

double bd_lamps_strongest(const struct bd_geometry *geometry)
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

static void fill(struct bd_lamp *lamp, const struct bd_geometry *geometry,
                 const struct bd_light *light, const struct bd_placement *placed, double unit_cd_m2)
{
    double per_unit = light->intensity * per_unit_of(geometry, light) / unit_cd_m2;
    double range = (double)light->range_m * geometry->units_per_m;
    double inner = cos(light->cone_inner), outer = cos(light->cone_outer);
    bool unlimited = light->kind == BD_LIGHT_DIRECTIONAL || !isfinite(range);
    *lamp = (struct bd_lamp){
        .kind = light->kind,
        .position = bd_geometry_place(geometry, placed->position),
        .range_inverse = unlimited ? 0 : (float)(1 / range),
        .cos_outer = (float)outer,
        .cos_ramp_inverse = (float)(1 / fmax(inner - outer, 1e-7)),
        // The square of a ramp in the cosine has a third of the ramp's width for an integral.
        .steradians = (float)(2 * pi * ((1 - inner) + (inner - outer) / 3)),
    };
    if (light->kind == BD_LIGHT_POINT) lamp->steradians = (float)(4 * pi);
    for (int k = 0; k < 3; k++) lamp->intensity[k] = (float)(light->color[k] * per_unit);
    set_vector(lamp->axis_x, placed->axis_x);
    set_vector(lamp->axis_y, placed->axis_y);
    set_vector(lamp->axis, bd_dvec3_scale(placed->axis_z, -1));
}

static double flux_of(const struct bd_lamps *lamps, const struct bd_lamp *lamp)
{
    const float *i = lamp->intensity;
    double luminance = 0.2126 * i[0] + 0.7152 * i[1] + 0.0722 * i[2];
    double area = pi * lamps->radius * lamps->radius;
    return luminance * (lamp->kind == BD_LIGHT_DIRECTIONAL ? area : lamp->steradians);
}

static void set_probabilities(struct bd_lamps *lamps)
{
    double sum = 0, cumulated = 0;
    for (uint32_t i = 0; i < lamps->count; i++) sum += flux_of(lamps, &lamps->lamps[i]);
    for (uint32_t i = 0; i < lamps->count; i++) {
        struct bd_lamp *lamp = &lamps->lamps[i];
        double flux = flux_of(lamps, lamp);
        cumulated += flux;
        lamp->probability = (float)(flux / sum);
        lamp->cumulated = (float)(cumulated / sum);
    }
}

// Those that shine, of one kind: directional or with a place.
static void list(struct bd_lamps *lamps, const struct bd_geometry *geometry, double unit_cd_m2,
                 bool is_directional)
{
    const struct bd_scene *scene = geometry->scene;
    for (uint32_t i = 0; i < scene->placed_light_count; i++) {
        const struct bd_placement *placed = &scene->placed_lights[i];
        const struct bd_light *light = &scene->lights[placed->object];
        struct bd_lamp *lamp = &lamps->lamps[lamps->count];
        if ((light->kind == BD_LIGHT_DIRECTIONAL) != is_directional) continue;
        fill(lamp, geometry, light, placed, unit_cd_m2);
        if (flux_of(lamps, lamp) > 0) lamps->count++;
    }
}

// What a point in its cone gets: by intensity, not by flux.
static struct bd_tree_light light_at(const void *user, uint32_t index)
{
    const struct bd_lamps *lamps = user;
    const struct bd_lamp *lamp = &lamps->lamps[index];
    struct bd_tree_light light = {.power = bd_vec3f_luminance(lamp->intensity)};
    set_vector(light.low, lamp->position);
    set_vector(light.high, lamp->position);
    light.reach.range = lamp->range_inverse > 0 ? 1 / lamp->range_inverse : INFINITY;
    light.reach.cosine = lamp->cos_outer;
    if (lamp->kind == BD_LIGHT_SPOT) bd_vec3f_copy(light.axis, lamp->axis);
    return light;
}

enum bd_err bd_lamps_init(struct bd_lamps *lamps, const struct bd_geometry *geometry,
                          double unit_cd_m2, struct bd_fault *fault)
{
    const struct bd_scene *scene = geometry->scene;
    *lamps = (struct bd_lamps){.radius = (float)geometry->radius};
    lamps->lamps = calloc((size_t)scene->placed_light_count + 1, sizeof *lamps->lamps);
    if (!lamps->lamps)
        return bd_fault_set(fault, BD_ERR_NO_MEMORY, "reference", "no memory for %u lights",
                            scene->placed_light_count);
    list(lamps, geometry, unit_cd_m2, false);
    lamps->near_count = lamps->count;
    list(lamps, geometry, unit_cd_m2, true);
    set_probabilities(lamps);
    return bd_light_tree_init(&lamps->tree, lamps->near_count, true, light_at, lamps, fault);
}

void bd_lamps_finish(struct bd_lamps *lamps)
{
    bd_light_tree_finish(&lamps->tree);
    free(lamps->lamps);
    *lamps = (struct bd_lamps){0};
}

uint64_t bd_lamps_bytes(const struct bd_lamps *lamps)
{
    return lamps->count * sizeof *lamps->lamps +
           bd_light_tree_bytes(&lamps->tree, lamps->near_count);
}

// --- what a point gets --------------------------------------------------------------------------

// The square of a ramp in the cosine between the cone's outer and inner angle.
static float cone_falloff(const struct bd_lamp *lamp, const float from_lamp[3])
{
    if (lamp->kind != BD_LIGHT_SPOT) return 1;
    float ramp = (bd_vec3f_dot(from_lamp, lamp->axis) - lamp->cos_outer) * lamp->cos_ramp_inverse;
    ramp = bd_minf(bd_maxf(ramp, 0), 1);
    return ramp * ramp;
}

// The window that the extension recommends: reaches 0 at the range.
static float range_window(const struct bd_lamp *lamp, float distance)
{
    float x = distance * lamp->range_inverse;
    return bd_minf(bd_maxf(1 - x * x * x * x, 0), 1);
}

static bool from_afar(const struct bd_lamps *lamps, const struct bd_lamp *lamp,
                      struct bd_illumination *out)
{
    bd_vec3f_scale(out->direction, lamp->axis, -1);
    bd_vec3f_copy(out->normal_illuminance, lamp->intensity);
    out->distance = INFINITY;
    out->pdf = lamp->probability / (BD_PI_F * lamps->radius * lamps->radius);
    return true;
}

// Told by squares, before any root: most of a scene is outside of a narrow cone.
static bool is_outside_cone(const struct bd_lamp *lamp, bd_dvec3 to_lamp)
{
    if (lamp->kind != BD_LIGHT_SPOT || lamp->cos_outer <= 0) return false;
    double along =
        -(to_lamp.x * lamp->axis[0] + to_lamp.y * lamp->axis[1] + to_lamp.z * lamp->axis[2]);
    double least = (double)lamp->cos_outer * lamp->cos_outer * bd_dvec3_dot(to_lamp, to_lamp);
    return along <= 0 || along * along < least;
}

bool bd_lamp_illuminates(const struct bd_lamps *lamps, const struct bd_lamp *lamp,
                         const float position[3], struct bd_illumination *out)
{
    if (lamp->kind == BD_LIGHT_DIRECTIONAL) return from_afar(lamps, lamp, out);
    bd_dvec3 span = bd_dvec3_sub(lamp->position, (bd_dvec3){position[0], position[1], position[2]});
    if (is_outside_cone(lamp, span)) return false;
    double distance = bd_dvec3_length(span);
    if (!(distance > 1e-12)) return false;
    set_vector(out->direction, bd_dvec3_scale(span, 1 / distance));
    out->distance = (float)distance;
    float from_lamp[3];
    bd_vec3f_scale(from_lamp, out->direction, -1);
    float cone = cone_falloff(lamp, from_lamp);
    float per_area = cone / (float)(distance * distance);
    float factor = per_area * range_window(lamp, out->distance);
    if (!(factor > 0)) return false;
    bd_vec3f_scale(out->normal_illuminance, lamp->intensity, factor);
    out->pdf = lamp->probability * per_area / lamp->steradians;
    return true;
}

// --- rays ---------------------------------------------------------------------------------------

const struct bd_lamp *bd_lamps_choose(const struct bd_lamps *lamps, float choice)
{
    uint32_t low = 0, high = lamps->count - 1;
    while (low < high) {
        uint32_t middle = (low + high) / 2;
        if (lamps->lamps[middle].cumulated > choice)
            high = middle;
        else
            low = middle + 1;
    }
    return &lamps->lamps[low];
}

// The cosine to the axis, in proportion to the falloff: the flat part inside the inner angle, the
// squared ramp outside of it, which is the largest of three uniform numbers along the ramp.
static float spot_cosine(const struct bd_lamp *lamp, float u)
{
    float ramp_width = bd_minf(1 / lamp->cos_ramp_inverse, 1 - lamp->cos_outer);
    float flat_width = 1 - lamp->cos_outer - ramp_width;
    float flat_share = flat_width / (flat_width + ramp_width / 3);
    if (u < flat_share) return 1 - flat_width * (u / flat_share);
    float along = (u - flat_share) / (1 - flat_share);
    return lamp->cos_outer + ramp_width * cbrtf(along);
}

static void combine(const struct bd_lamp *lamp, float x, float y, float z, float out[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = lamp->axis_x[k] * x + lamp->axis_y[k] * y + lamp->axis[k] * z;
}

const struct bd_lamp *bd_lamps_sample_ray(const struct bd_lamps *lamps, float choice,
                                          const float u[2], float origin[3], float direction[3])
{
    const struct bd_lamp *lamp = bd_lamps_choose(lamps, choice);
    float phi = 2 * BD_PI_F * u[1];
    if (lamp->kind == BD_LIGHT_DIRECTIONAL) {
        float r = lamps->radius * sqrtf(u[0]);
        combine(lamp, r * cosf(phi), r * sinf(phi), -lamps->radius * 1.01f, origin);
        bd_vec3f_copy(direction, lamp->axis);
        return lamp;
    }
    float cosine = lamp->kind == BD_LIGHT_SPOT ? spot_cosine(lamp, u[0]) : 1 - 2 * u[0];
    float sine = sqrtf(bd_maxf(1 - cosine * cosine, 0));
    combine(lamp, sine * cosf(phi), sine * sinf(phi), cosine, direction);
    bd_vec3f_normalize(direction);
    set_vector(origin, lamp->position);
    return lamp;
}
