#include "lights/triangle_view.h"

#include <math.h>

// Below, corners' directions in 32 bits say too little of the angles between them, and a patch's
// cosine and distance change too little over it to matter.
#define SOLID_MIN_SR 0.02f
// Of the point's largest coordinate: who lies in the plane of a triangle, to within rounding, is
// not lit by it.
#define IN_PLANE 4e-6f

static float largest_coordinate(f3 a)
{
    const f3 size = f3_abs(a);
    return fmaxf(size.x, fmaxf(size.y, size.z));
}

struct bd_triangle_view bd_triangle_view_of(const struct bd_area_light *light, bool two_sided,
                                            f3 point, f3 normal)
{
    struct bd_triangle_view view = {.solid_sr = 0};
    f3 span[3];
    float length[3], above = 0;
    const float height = f3_dot(light->normal, f3_sub(point, light->corner[0]));
    const float least = IN_PLANE * largest_coordinate(point);
    if ((two_sided ? fabsf(height) : height) <= least) return view;
    for (int c = 0; c < 3; c++) {
        span[c] = f3_sub(light->corner[c], point);
        length[c] = f3_length(span[c]);
        if (!(length[c] > 0)) return view;
        view.to[c] = f3_scale(span[c], 1 / length[c]);
        above += fmaxf(f3_dot(normal, view.to[c]), 0);
    }
    view.above = above / 3;
    if (!(view.above > 0)) return view;
    // Its volume from its height: of corners' directions alone it cancels far away.
    const float volume = 2 * light->area * fabsf(height) / (length[0] * length[1] * length[2]);
    const float sum = 1 + f3_dot(view.to[0], view.to[1]) + f3_dot(view.to[1], view.to[2]) +
                      f3_dot(view.to[2], view.to[0]);
    view.solid_sr = 2 * atan2f(volume, sum);
    return view;
}

static double clamped(double x)
{
    return x < -1 ? -1 : x > 1 ? 1 : x;
}

static bd_dvec3 dvec3_of(f3 a)
{
    return (bd_dvec3){a.x, a.y, a.z};
}

// a s + b t.
static bd_dvec3 mix(bd_dvec3 a, double s, bd_dvec3 b, double t)
{
    return bd_dvec3_add(bd_dvec3_scale(a, s), bd_dvec3_scale(b, t));
}

static bd_dvec3 unit(bd_dvec3 a)
{
    const double length2 = bd_dvec3_dot(a, a);
    return length2 > 0 ? bd_dvec3_scale(a, 1 / sqrt(length2)) : a;
}

// The dihedral angle at `at` between the planes to b and to c.
static double corner_angle(bd_dvec3 at, bd_dvec3 b, bd_dvec3 c)
{
    const bd_dvec3 p = bd_dvec3_cross(at, b), q = bd_dvec3_cross(at, c);
    const bd_dvec3 across = bd_dvec3_cross(p, q);
    return atan2(sqrt(bd_dvec3_dot(across, across)), bd_dvec3_dot(p, q));
}

struct bd_triangle_aim bd_triangle_aim_of(const struct bd_triangle_view *view)
{
    if (view->solid_sr < SOLID_MIN_SR) return (struct bd_triangle_aim){.area = 0};
    const bd_dvec3 a = unit(dvec3_of(view->to[0])), b = unit(dvec3_of(view->to[1]));
    const bd_dvec3 c = unit(dvec3_of(view->to[2]));
    const double alpha = corner_angle(a, b, c);
    return (struct bd_triangle_aim){
        .a = a,
        .b = b,
        .off_a = unit(mix(c, 1, a, -bd_dvec3_dot(c, a))),
        .alpha = alpha,
        .cos_alpha = cos(alpha),
        .sin_alpha = sin(alpha),
        .cos_c = bd_dvec3_dot(a, b),
        .area = alpha + corner_angle(b, c, a) + corner_angle(c, a, b) - 3.14159265358979323846,
    };
}

// Arvo's: cuts off a part of the area along the edge from a to c, then goes along the cut from b.
static f3 choose_direction(const struct bd_triangle_aim *aim, const float number[2])
{
    const double angle = number[0] * aim->area - aim->alpha;
    const double s = sin(angle), t = cos(angle);
    const double u = t - aim->cos_alpha, v = s + aim->sin_alpha * aim->cos_c;
    const double below = (v * s + u * t) * aim->sin_alpha;
    const double q = below != 0 ? clamped(((v * t - u * s) * aim->cos_alpha - v) / below) : 1;
    const bd_dvec3 cut = mix(aim->a, q, aim->off_a, sqrt(1 - q * q));
    const double z = 1 - number[1] * (1 - bd_dvec3_dot(cut, aim->b));
    const bd_dvec3 off_b = unit(mix(cut, 1, aim->b, -bd_dvec3_dot(cut, aim->b)));
    const bd_dvec3 d = mix(aim->b, z, off_b, sqrt(fmax(1 - z * z, 0)));
    return f3_of((float)d.x, (float)d.y, (float)d.z);
}

// Where the line in a direction goes through the part's plane, as barycentrics of the part, which
// rounding may put outside.
static bool intersect(const struct bd_area_light *light, f3 point, f3 direction, float out[2])
{
    const f3 edge1 = f3_sub(light->corner[1], light->corner[0]);
    const f3 edge2 = f3_sub(light->corner[2], light->corner[0]);
    const f3 p = f3_cross(direction, edge2), from = f3_sub(point, light->corner[0]);
    const float determinant = f3_dot(edge1, p);
    if (determinant == 0) return false;
    const float s = f3_dot(from, p) / determinant;
    const float t = f3_dot(direction, f3_cross(from, edge1)) / determinant;
    out[0] = fminf(fmaxf(s, 0), 1);
    out[1] = fminf(fmaxf(t, 0), 1 - out[0]);
    return out[0] == out[0] && out[1] == out[1];
}

bool bd_triangle_view_choose(const struct bd_triangle_view *view, const struct bd_triangle_aim *aim,
                             const struct bd_area_light *light, f3 point, const float number[2],
                             struct bd_triangle_point *out)
{
    const float root = sqrtf(number[0]);
    float s[2] = {root * (1 - number[1]), root * number[1]};
    if (view->solid_sr >= SOLID_MIN_SR &&
        !intersect(light, point, choose_direction(aim, number), s))
        return false;
    const f3 *corner = light->corner;
    out->u = light->u[0] + s[0] * (light->u[1] - light->u[0]) + s[1] * (light->u[2] - light->u[0]);
    out->v = light->v[0] + s[0] * (light->v[1] - light->v[0]) + s[1] * (light->v[2] - light->v[0]);
    out->position = f3_add(corner[0], f3_add(f3_scale(f3_sub(corner[1], corner[0]), s[0]),
                                             f3_scale(f3_sub(corner[2], corner[0]), s[1])));
    const f3 span = f3_sub(out->position, point);
    const float distance = f3_length(span);
    if (!(distance > 0)) return false;
    out->pdf = bd_triangle_view_pdf(view, light, f3_scale(span, 1 / distance), distance);
    return out->pdf > 0 && isfinite(out->pdf);
}

float bd_triangle_view_pdf(const struct bd_triangle_view *view, const struct bd_area_light *light,
                           f3 direction, float distance)
{
    if (view->solid_sr >= SOLID_MIN_SR) return 1 / view->solid_sr;
    const float cosine = fabsf(f3_dot(light->normal, direction));
    return cosine > 0 ? distance * distance / (light->area * cosine) : 0;
}
