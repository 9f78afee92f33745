// Vertices of the scene for every raster pass: G-buffer, shadow map and reflective shadow map.
//
// BD_POINTS: of pixels whose triangle is known, a point each, interpolated over its corners already
// (pass/scene_points.h).
//
// Depth is reversed with the far plane at infinity: z_clip = near, so that z_ndc = near / depth
// keeps its relative precision over seven orders of magnitude in 32-bit float.
#include "common/instance.glsl"
#include "common/view.glsl"

layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 tangent;
layout(location = 3) in vec2 uv0;
layout(location = 4) in vec2 uv1;
layout(location = 5) in vec4 color;
layout(location = 6) in uvec2 instance; // shared/instance.h
#ifdef BD_POINTS
layout(location = 7) in uvec2 pixel;
#endif

layout(location = 0) out vec3 position_vs;
layout(location = 1) out vec3 normal_rs;
layout(location = 2) out vec4 tangent_rs;
layout(location = 3) out vec4 uv01;
layout(location = 4) out vec4 vertex_color;
layout(location = 5) flat out uint instance_in_draw;

vec4 clip_from_view(vec3 p)
{
    // The sample's place in its pixel is a shift of the picture against the pixel grid.
    vec2 shift = (vec2(0.5) - view.sample_px.xy) * vec2(2.0, -2.0) / vec2(view.size_px.xy);
    vec2 scaled = p.xy / vec2(view.axis_x.w, view.axis_y.w);
    float near = view.axis_z.w;
    if (view_is_orthographic()) {
        float far = view.sample_px.z;
        return vec4(scaled + shift, (far + p.z) / (far - near), 1.0);
    }
    float w = -p.z;
    return vec4(scaled + shift * w, near, w);
}

// What is made unit at a triangle's corners is interpolated as it is.
vec3 unit_or_zero(vec3 v)
{
#ifdef BD_POINTS
    return v;
#endif
    float length_squared = dot(v, v);
    return length_squared > 0.0 ? v * inversesqrt(length_squared) : vec3(0.0);
}

void main()
{
#ifdef BD_POINTS
    position_vs = position;
    gl_Position = vec4(ndc_of_place(vec2(pixel) + 0.5), 0.5, 1.0);
#else
    position_vs = view_from_mesh_position(instance.x, position);
    gl_Position = clip_from_view(position_vs);
#endif
#ifdef BD_SURFACE
    normal_rs = unit_or_zero(render_from_mesh_normal(instance.x, normal));
    // A tangent is a direction on the surface: it transforms with the positions.
    vec3 t = unit_or_zero(instance_rows_mul(instance.x, 0u, vec4(tangent.xyz, 0.0)));
    tangent_rs = vec4(view.axis_x.xyz * t.x + view.axis_y.xyz * t.y + view.axis_z.xyz * t.z,
                      tangent.w);
    vertex_color = color;
#else
    normal_rs = vec3(0.0);
    tangent_rs = vec4(0.0);
    vertex_color = vec4(1.0);
#endif
    uv01 = vec4(uv0, uv1);
    instance_in_draw = instance.y;
}
