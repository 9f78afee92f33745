#include "upload/light_setup.h"

#include <math.h>

#define SINGLE_FACE_ANGLE_MAX (M_PI / 3)
// Part of the scene's diagonal nearer than which a light's maps see nothing. Depth is reversed
// and infinite: a small value costs no precision.
#define NEAR_PER_DIAGONAL 1e-6
// Of an outer cone that every direction lies in, by more than 1.
#define ANY_COSINE (-3.0)

double bd_light_effective_solid_angle_sr(const struct bd_light *light)
{
    if (light->kind == BD_LIGHT_POINT) return 4 * M_PI;
    double cos_inner = cos(light->cone_inner), cos_outer = cos(light->cone_outer);
    return 2 * M_PI * ((1 - cos_inner) + (cos_inner - cos_outer) / 3);
}

static double luminance(const float color[3])
{
    return 0.2126 * color[0] + 0.7152 * color[1] + 0.0722 * color[2];
}

// An orthographic frame that holds the scene's bounds, seen along the light. The margin keeps what
// lies on the bounds off the outermost texels' outer edges.
static void set_up_directional(struct bd_light_setup *setup, const struct bd_scene *scene)
{
    const struct bd_features *f = &scene->features;
    const bd_dvec3 *axes[3] = {&setup->placement.axis_x, &setup->placement.axis_y,
                               &setup->placement.axis_z};
    const bd_dvec3 extent = bd_dvec3_sub(f->bounds_max, f->bounds_min);
    double half[3];
    for (int a = 0; a < 3; a++) {
        half[a] = 0.5 * (fabs(axes[a]->x) * extent.x + fabs(axes[a]->y) * extent.y +
                         fabs(axes[a]->z) * extent.z);
        half[a] = 1.001 * fmax(half[a], 1e-4 * f->diagonal_m);
    }
    bd_dvec3 centre_m = bd_dvec3_scale(bd_dvec3_add(f->bounds_min, f->bounds_max), 0.5);
    setup->placement.position =
        bd_dvec3_add(centre_m, bd_dvec3_scale(setup->placement.axis_z, half[2]));
    setup->half_width = half[0];
    setup->half_height = half[1];
    setup->depth_m = 2 * half[2];
    setup->flux_lm = setup->light->intensity * luminance(setup->light->color) * 4 * half[0] *
                     half[1];
}

struct bd_light_setup bd_light_setup_of(const struct bd_scene *scene, uint32_t placed_light)
{
    struct bd_light_setup setup = {.placement = scene->placed_lights[placed_light]};
    setup.light = &scene->lights[setup.placement.object];
    setup.depth_m = scene->features.diagonal_m;
    setup.face_count = 1;
    switch (setup.light->kind) {
    case BD_LIGHT_DIRECTIONAL:
        set_up_directional(&setup, scene);
        return setup;
    case BD_LIGHT_SPOT:
        if (setup.light->cone_outer <= SINGLE_FACE_ANGLE_MAX) {
            // A hair wider than the cone: its edge must not fall outside by rounding.
            setup.half_width = setup.half_height = tan(setup.light->cone_outer) * 1.0005;
            break;
        }
        // Fall through: a wider cone needs the faces of a point light.
        __attribute__((fallthrough));
    case BD_LIGHT_POINT:
        setup.face_count = BD_LIGHT_FACES_MAX;
        setup.half_width = setup.half_height = 1;
        break;
    }
    setup.flux_lm = setup.light->intensity * luminance(setup.light->color) *
                    bd_light_effective_solid_angle_sr(setup.light);
    return setup;
}

static void orient_face(struct bd_viewpoint *v, uint32_t face)
{
    const bd_dvec3 x = v->axis_x, y = v->axis_y, z = v->axis_z;
    const bd_dvec3 nx = bd_dvec3_scale(x, -1), ny = bd_dvec3_scale(y, -1);
    const bd_dvec3 nz = bd_dvec3_scale(z, -1);
    // The same table as light_face_axes in shaders/common/light.glsl.
    switch (face) {
    case 0: v->axis_x = z, v->axis_z = nx; break;
    case 1: v->axis_x = nz, v->axis_z = x; break;
    case 2: v->axis_y = z, v->axis_z = ny; break;
    case 3: v->axis_y = nz, v->axis_z = y; break;
    case 4: v->axis_x = nx, v->axis_z = nz; break;
    default: break;
    }
}

struct bd_viewpoint bd_light_setup_viewpoint(const struct bd_light_setup *setup, uint32_t face,
                                             uint32_t side_px)
{
    bool directional = setup->light->kind == BD_LIGHT_DIRECTIONAL;
    struct bd_viewpoint v = {
        .position_m = setup->placement.position,
        .axis_x = setup->placement.axis_x,
        .axis_y = setup->placement.axis_y,
        .axis_z = setup->placement.axis_z,
        .orthographic = directional,
        .half_width = setup->half_width,
        .half_height = setup->half_height,
        .near_m = directional ? 0 : setup->depth_m * NEAR_PER_DIAGONAL,
        .far_m = setup->depth_m,
        .width_px = side_px,
        .height_px = side_px,
        .sample_x_px = 0.5,
        .sample_y_px = 0.5,
    };
    if (setup->face_count > 1) orient_face(&v, face);
    return v;
}

static struct bd_vec4 vec4_from(bd_dvec3 v)
{
    return (struct bd_vec4){(float)v.x, (float)v.y, (float)v.z, 0};
}

struct bd_light_uniform bd_light_setup_uniform(const struct bd_light_setup *setup,
                                               const struct bd_render_space *space,
                                               uint32_t side_px)
{
    const struct bd_light *light = setup->light;
    const struct bd_placement *at = &setup->placement;
    bool directional = light->kind == BD_LIGHT_DIRECTIONAL;
    double intensity = directional ? light->intensity / space->unit_cd_m2
                                   : bd_render_intensity(space, light->intensity);
    double range = (double)light->range_m * space->render_per_m;
    const bool spot = light->kind == BD_LIGHT_SPOT;
    const double cos_outer = spot ? cos(light->cone_outer) : ANY_COSINE;
    const double cos_inner = spot ? cos(light->cone_inner) : ANY_COSINE + 1;
    double extent = directional ? space->render_per_m : 1;
    bool unlimited = directional || !isfinite(range);
    return (struct bd_light_uniform){
        .position = vec4_from(bd_render_from_world(space, at->position)),
        .direction = vec4_from(bd_dvec3_scale(at->axis_z, -1)),
        .intensity = {(float)(light->color[0] * intensity), (float)(light->color[1] * intensity),
                      (float)(light->color[2] * intensity), 0},
        .axis_x = vec4_from(at->axis_x),
        .axis_y = vec4_from(at->axis_y),
        .axis_z = vec4_from(at->axis_z),
        .inverse_range = unlimited ? 0 : (float)(1 / range),
        .distance = (float)(setup->depth_m * space->render_per_m),
        .half_width = (float)(setup->half_width * extent),
        .half_height = (float)(setup->half_height * extent),
        .cos_outer = (float)cos_outer,
        .per_cosine = (float)(1 / fmax(cos_inner - cos_outer, 1e-7)),
        .kind = (uint32_t)light->kind,
        .face_count = setup->face_count,
        .face_side_px = side_px,
    };
}

_Static_assert(BD_LIGHT_DIRECTIONAL == BD_LIGHT_KIND_DIRECTIONAL, "C and GLSL agree");
_Static_assert(BD_LIGHT_POINT == BD_LIGHT_KIND_POINT, "C and GLSL agree");
_Static_assert(BD_LIGHT_SPOT == BD_LIGHT_KIND_SPOT, "C and GLSL agree");
