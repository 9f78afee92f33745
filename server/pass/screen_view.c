// What a screen (pass/screen.h) shows of what is about a place: where that may be seen, and whether
// all of it is.

#include <math.h>

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

// --- whether all of it is seen -------------------------------------------------------------------

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
