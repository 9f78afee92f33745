// The view uniform and the way between pixels and render space.
#include "shared/bindings.h"
#include "shared/view.h"

layout(std140, binding = BD_UNIFORM_VIEW) uniform view_block { bd_view view; };

bool view_is_orthographic() { return view.position.w != 0.0; }

// Normalised device coordinates of a place in the picture: x right, y up, both in [-1, 1].
vec2 ndc_of_place(vec2 at_px)
{
    vec2 at = at_px / vec2(view.size_px.xy);
    return vec2(2.0 * at.x - 1.0, 1.0 - 2.0 * at.y);
}

// The same of a pixel's sample.
vec2 ndc_of_pixel(ivec2 pixel) { return ndc_of_place(vec2(pixel) + view.sample_px.xy); }

// Position relative to the view's own position, from the depth along the view axis.
vec3 view_relative_position_at(vec2 at_px, float depth)
{
    vec2 slope = ndc_of_place(at_px) * vec2(view.axis_x.w, view.axis_y.w);
    vec2 lateral = view_is_orthographic() ? slope : slope * depth;
    return view.axis_x.xyz * lateral.x + view.axis_y.xyz * lateral.y - view.axis_z.xyz * depth;
}

vec3 view_relative_position(ivec2 pixel, float depth)
{
    return view_relative_position_at(vec2(pixel) + view.sample_px.xy, depth);
}

// Unit vector from a surface towards the viewer.
vec3 direction_to_viewer(vec3 relative_position)
{
    return view_is_orthographic() ? view.axis_z.xyz : -normalize(relative_position);
}
