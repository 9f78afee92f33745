// What a screen (pass/screen.h) shows of places: where they may be seen, and whether they are.

#include <math.h>

#include "pass/f3_arrays.h"
#include "pass/screen.h"

// Across a receiver's neighbourhood: parts of the level at which it is looked at.
#define PARTS_ACROSS 8u

// --- where something may be seen ----------------------------------------------------------------

// Slopes at which tangents of a circle go past it, seen from the origin: `across` and `depth` of
// its middle. All of them where it reaches behind the viewer.
static void tangents_of(double across, double depth, double radius, double slope[2])
{
    const double far2 = depth * depth - radius * radius;
    slope[0] = -INFINITY;
    slope[1] = INFINITY;
    if (depth <= radius || far2 <= 1e-9 * depth * depth) return;
    const double root = radius * sqrt(across * across + far2);
    slope[0] = (across * depth - root) / far2;
    slope[1] = (across * depth + root) / far2;
}

// Pixels of a side before which it begins and ends.
static void pixels_of(const double slope[2], double half, uint32_t side_px, uint32_t out[2])
{
    const double first = (slope[0] / half + 1) / 2 * side_px - 1;
    const double last = (slope[1] / half + 1) / 2 * side_px + 1;
    out[0] = (uint32_t)fmin(fmax(floor(first), 0), side_px);
    out[1] = (uint32_t)fmin(fmax(ceil(last), 0), side_px);
}

// Exact bounds of the sphere about a pixel in the picture: left, right, top, bottom.
static void look_around(const struct bd_screen *s, f3 position, double r, uint32_t bounds[4])
{
    const struct bd_viewpoint *v = &s->viewpoint;
    const bd_dvec3 to = {position.x - s->eye.x, position.y - s->eye.y,
                         position.z - s->eye.z};
    const double right = bd_dvec3_dot(to, v->axis_x), down = -bd_dvec3_dot(to, v->axis_y);
    const double depth = -bd_dvec3_dot(to, v->axis_z);
    double across[2] = {right - r, right + r}, along[2] = {down - r, down + r};
    if (!v->orthographic) tangents_of(right, depth, r, across);
    if (!v->orthographic) tangents_of(down, depth, r, along);
    pixels_of(across, v->half_width * s->per_m, s->width_px, bounds);
    pixels_of(along, v->half_height * s->per_m, s->height_px, bounds + 2);
}

// The printed radius, which is too small near the viewer and off the axis.
static void look_around_as_printed(const struct bd_screen *s, f3 position, double r, uint32_t bounds[4])
{
    const struct bd_viewpoint *v = &s->viewpoint;
    const bd_dvec3 to = {position.x - s->eye.x, position.y - s->eye.y,
                         position.z - s->eye.z};
    const double depth = v->orthographic ? 1 : -bd_dvec3_dot(to, v->axis_z);
    const double length = v->orthographic ? 1 : sqrt(bd_dvec3_dot(to, to));
    const double radius = r / length;
    const double right = bd_dvec3_dot(to, v->axis_x) / depth;
    const double down = -bd_dvec3_dot(to, v->axis_y) / depth;
    pixels_of((double[]){right - radius, right + radius}, v->half_width * s->per_m,
              s->width_px, bounds);
    pixels_of((double[]){down - radius, down + radius}, v->half_height * s->per_m,
              s->height_px, bounds + 2);
}

void bd_screen_bounds(const struct bd_screen *s, f3 position, float radius, uint32_t bounds[4])
{
    if (s->printed)
        look_around_as_printed(s, position, radius, bounds);
    else
        look_around(s, position, radius, bounds);
}

// --- what is there ------------------------------------------------------------------------------

// Of a pixel's patch: rounding, and how far a curved surface leaves its plane, of a pixel's size.
#define WIDER     1.02f
#define OFF_PLANE 0.1f

// How much of a place is a pixel's, whose plane and patch hold it.
static float held_by(const struct bd_screen *s, int64_t x, int64_t y, f3 position, f3 normal)
{
    if (x < 0 || y < 0 || x >= s->width_px || y >= s->height_px) return 0;
    const size_t pixel = (size_t)y * s->width_px + (size_t)x;
    const struct bd_screen_part *part = &s->parts[pixel];
    const struct bd_screen_patch *patch = &s->patches[pixel];
    const f3 u = f3_from(&patch->u_part), v = f3_from(&patch->v);
    const f3 own_normal = f3_from(&part->normal_radius);
    const f3 off = f3_sub(position, f3_from(&part->middle_area));
    if (part->middle_area.w == 0 || f3_dot(normal, own_normal) < 0.5f) return 0;
    if (f_abs(f3_dot(off, own_normal)) > OFF_PLANE * part->normal_radius.w) return 0;
    const f3 across = f3_cross(v, own_normal), along = f3_cross(u, own_normal);
    const float right = f3_dot(off, across), up = f3_dot(off, along);
    const bool inside = f_abs(right) <= WIDER * f_abs(f3_dot(u, across)) &&
                        f_abs(up) <= WIDER * f_abs(f3_dot(v, along));
    return inside ? patch->u_part.w : 0;
}

float bd_screen_holds(const struct bd_screen *s, f3 position, f3 normal)
{
    const struct bd_viewpoint *v = &s->viewpoint;
    const bd_dvec3 to = {position.x - s->eye.x, position.y - s->eye.y, position.z - s->eye.z};
    const double depth = v->orthographic ? s->per_m : -bd_dvec3_dot(to, v->axis_z);
    if (depth <= 0) return 0;
    const double right = bd_dvec3_dot(to, v->axis_x) / (depth * v->half_width);
    const double down = -bd_dvec3_dot(to, v->axis_y) / (depth * v->half_height);
    if (!(fabs(right) <= 1 && fabs(down) <= 1)) return 0;
    const int64_t x = (int64_t)floor((right + 1) / 2 * s->width_px + .5 - v->sample_x_px);
    const int64_t y = (int64_t)floor((down + 1) / 2 * s->height_px + .5 - v->sample_y_px);
    // At a crease a pixel beside it holds the place.
    const int64_t beside[5][2] = {{0, 0}, {1, 0}, {-1, 0}, {0, 1}, {0, -1}};
    float most = 0;
    for (int i = 0; i < 5 && most == 0; i++)
        most = held_by(s, x + beside[i][0], y + beside[i][1], position, normal);
    return most;
}

// At the level at which that is a few parts.
static bool is_any_torn(const struct bd_screen *s, const uint32_t bounds[4])
{
    const uint32_t wide = bounds[1] - bounds[0], high = bounds[3] - bounds[2];
    uint32_t level = 0;
    while (level + 1 < s->level_count && (wide > high ? wide : high) >> level > PARTS_ACROSS) level++;
    const struct bd_uvec4 *l = &s->levels[level];
    for (uint32_t y = bounds[2] >> level; y <= (bounds[3] - 1) >> level; y++)
        for (uint32_t x = bounds[0] >> level; x <= (bounds[1] - 1) >> level; x++)
            if (s->torn[l->z + (size_t)y * l->x + x]) return true;
    return false;
}

bool bd_screen_holds_about(const struct bd_screen *s, f3 position, float radius)
{
    uint32_t bounds[4];
    look_around(s, position, radius, bounds);
    return bounds[0] > 0 && bounds[1] < s->width_px && bounds[2] > 0 && bounds[3] < s->height_px &&
           bounds[0] < bounds[1] && bounds[2] < bounds[3] && !is_any_torn(s, bounds);
}
