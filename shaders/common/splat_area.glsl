// Where in the picture a VPL's splat lies: the pixels' rectangle around the ball in which the bound
// P / (pi r^2) on what the VPL sends is above a given irradiance (algorithms.md A0.7 N3).
#include "common/array.glsl"
#include "common/pi.glsl"
#include "common/view.glsl"
#include "shared/vpl.h"

BD_ARRAY(vpls, BD_UNIT_VPLS);

const float BEYOND = 1e30;

// Square of the ball's radius; everywhere where the bound is 0.
float reach_squared(uint vpl, float bound)
{
    vec3 flux = BD_LOAD(vpls, vpl * BD_VPL_VEC4S + 2u).rgb;
    float power = max(flux.r, max(flux.g, flux.b));
    return min(power / max(PI * bound, 1.0 / BEYOND), BEYOND);
}

// Least and largest lateral / depth of a ball's points before the viewer, by the tangents to the
// circle that is its shadow on the plane of the two directions. Where a tangent does not come
// before the viewer, the ball reaches beyond all pixels on that side.
vec2 slopes_of_ball(float lateral, float depth, float squared)
{
    float distance_squared = lateral * lateral + depth * depth;
    if (squared >= distance_squared) return vec2(-BEYOND, BEYOND);
    float sine = sqrt(squared / distance_squared);
    float cosine = sqrt((distance_squared - squared) / distance_squared);
    vec2 low = vec2(lateral * cosine - depth * sine, depth * cosine + lateral * sine);
    vec2 high = vec2(lateral * cosine + depth * sine, depth * cosine - lateral * sine);
    return vec2(low.y > 0.0 ? low.x / low.y : -BEYOND, high.y > 0.0 ? high.x / high.y : BEYOND);
}

// In units of the picture's half side: of a ball that reaches before the near plane.
vec2 extent_of_ball(float lateral, float depth, float squared, float half_side)
{
    float radius = sqrt(squared);
    vec2 range = view_is_orthographic() ? vec2(lateral - radius, lateral + radius)
                                        : slopes_of_ball(lateral, depth, squared);
    return range / half_side;
}

// First pixel whose sample lies in the range of picture coordinates, and the first behind them.
ivec2 pixels_in(vec2 range, float sample_at, uint size)
{
    vec2 at = clamp(range - sample_at, vec2(-1.0), vec2(float(size)));
    int first = max(int(ceil(at.x)), 0), end = min(int(floor(at.y)) + 1, int(size));
    return ivec2(first, max(first, end));
}

// xy = first pixel, zw = the first behind them.
ivec4 splat_area(uint vpl, float bound)
{
    vec3 centre = BD_LOAD(vpls, vpl * BD_VPL_VEC4S).xyz - view.position.xyz;
    float squared = reach_squared(vpl, bound);
    float depth = -dot(view.axis_z.xyz, centre);
    if (squared == 0.0 || depth + sqrt(squared) <= view.axis_z.w) return ivec4(0);
    vec2 x = extent_of_ball(dot(view.axis_x.xyz, centre), depth, squared, view.axis_x.w);
    vec2 y = extent_of_ball(dot(view.axis_y.xyz, centre), depth, squared, view.axis_y.w);
    vec2 half_size = 0.5 * vec2(view.size_px.xy);
    ivec2 columns = pixels_in((1.0 + x) * half_size.x, view.sample_px.x, view.size_px.x);
    ivec2 rows = pixels_in((1.0 - y.yx) * half_size.y, view.sample_px.y, view.size_px.y);
    return ivec4(columns.x, rows.x, columns.y, rows.y);
}
