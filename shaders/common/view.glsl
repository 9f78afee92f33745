// The view uniform and the way between pixels and render space.
#include "kernel/pixel.h"
#include "shared/bindings.h"
#include "shared/view.h"

layout(std140, binding = BD_UNIFORM_VIEW) uniform view_block { bd_view view; };

bool view_is_orthographic() { return view.position.w != 0.0; }

// Normalised device coordinates of a place in the picture: x right, y up, both in [-1, 1].
vec2 ndc_of_place(vec2 at_px)
{
    return vec2(ndc_to_right(at_px.x, float(view.size_px.x)),
                ndc_up(at_px.y, float(view.size_px.y)));
}

// The same of a pixel's sample.
vec2 ndc_of_pixel(ivec2 pixel) { return ndc_of_place(vec2(pixel) + view.sample_px.xy); }

// Position relative to the view's own position, from the depth along the view axis.
vec3 view_relative_position_at(vec2 at_px, float depth)
{
    vec2 slope = ndc_of_place(at_px) * vec2(view.axis_x.w, view.axis_y.w);
    return place_in_view(view.axis_x.xyz, view.axis_y.xyz, view.axis_z.xyz, slope.x, slope.y,
                         view_is_orthographic() ? 1.0 : depth, depth);
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
