// What a fragment's material says, for the raster passes. Each map costs a define: a scene
// without it compiles no code for it.
//
//   BD_BASE_COLOR_MAP BD_METALLIC_ROUGHNESS_MAP BD_NORMAL_MAP BD_EMISSIVE_MAP BD_TRANSMISSION_MAP
//   BD_VERTEX_COLOR BD_ALPHA_MASK
//
// BD_TRIANGLE_LIST: of one instance's triangles those of a list are drawn, not all. BD_POINTS: points
// are, each of a triangle of its own.
#include "common/array.glsl"
#include "common/view.glsl"
#include "shared/material.h"

BD_ARRAY(triangles, BD_UNIT_SURFACE_TRIANGLES);
#ifdef BD_TRIANGLE_LIST
BD_ARRAY(triangle_list, BD_UNIT_TRIANGLE_LIST);
#endif

layout(std140, binding = BD_UNIFORM_MATERIAL) uniform material_block
{
    bd_material_uniform material;
};

layout(location = 0) in vec3 position_vs;
layout(location = 1) in vec3 normal_rs;
layout(location = 2) in vec4 tangent_rs;
layout(location = 3) in vec4 uv01;
layout(location = 4) in vec4 vertex_color;
layout(location = 5) flat in uint instance_in_draw;

#ifdef BD_BASE_COLOR_MAP
layout(binding = BD_UNIT_BASE_COLOR) uniform sampler2D base_color_map;
#endif
#ifdef BD_METALLIC_ROUGHNESS_MAP
layout(binding = BD_UNIT_METALLIC_ROUGHNESS) uniform sampler2D metallic_roughness_map;
#endif
#ifdef BD_NORMAL_MAP
layout(binding = BD_UNIT_NORMAL) uniform sampler2D normal_map;
#endif
#ifdef BD_EMISSIVE_MAP
layout(binding = BD_UNIT_EMISSIVE) uniform sampler2D emissive_map;
#endif
#ifdef BD_TRANSMISSION_MAP
layout(binding = BD_UNIT_TRANSMISSION) uniform sampler2D transmission_map;
#endif

vec2 map_uv(vec4 rows[2])
{
    vec3 uv = vec3(rows[0].w == 0.0 ? uv01.xy : uv01.zw, 1.0);
    return vec2(dot(rows[0].xyz, uv), dot(rows[1].xyz, uv));
}

vec4 surface_base_color()
{
    vec4 c = material.base_color;
#ifdef BD_BASE_COLOR_MAP
    // The finest level, bilinear, as the reference filters: a picture is made of point samples, and with
    // mipmaps the two would differ by the blur. The price is shimmer at --aa 1 in motion.
    c *= textureLod(base_color_map, map_uv(material.base_color_uv), 0.0);
#endif
#ifdef BD_VERTEX_COLOR
    c *= vertex_color;
#endif
    return c;
}

void discard_by_alpha(float alpha)
{
#ifdef BD_ALPHA_MASK
    if (alpha < material.alpha_cutoff) discard;
#endif
}

// x = metallic, y = perceptual roughness.
vec2 surface_metallic_roughness()
{
    vec2 m = vec2(material.metallic, material.roughness);
#ifdef BD_METALLIC_ROUGHNESS_MAP
    m *= textureLod(metallic_roughness_map, map_uv(material.metallic_roughness_uv), 0.0).bg;
#endif
    return m;
}

vec3 surface_emission()
{
    vec3 e = material.emissive.xyz;
#ifdef BD_EMISSIVE_MAP
    e *= textureLod(emissive_map, map_uv(material.emissive_uv), 0.0).rgb;
#endif
    return e;
}

// Of what is not a metal, the share that light passes through.
float surface_transmission()
{
    float t = material.transmission;
#ifdef BD_TRANSMISSION_MAP
    t *= textureLod(transmission_map, map_uv(material.transmission_uv), 0.0).r;
#endif
    return t;
}

vec3 render_from_view(vec3 d)
{
    return view.axis_x.xyz * d.x + view.axis_y.xyz * d.y + view.axis_z.xyz * d.z;
}

// The triangle's place among those of its instance that were drawn from the draw's first on.
uint triangle_in_instance()
{
#ifdef BD_TRIANGLE_LIST
    uint at = material.triangle_list + uint(gl_PrimitiveID);
    return uint(BD_LOAD(triangle_list, at / 4u)[at % 4u]);
#else
    return uint(gl_PrimitiveID);
#endif
}

uint triangle_id()
{
#ifdef BD_POINTS
    return material.first_triangle + instance_in_draw;
#else
    return material.first_triangle + instance_in_draw * material.triangles_per_instance + triangle_in_instance();
#endif
}

vec3 to_viewer()
{
    return view_is_orthographic() ? view.axis_z.xyz : -render_from_view(position_vs);
}

// From the triangle's edges, which were subtracted in double precision: screen derivatives lose it
// on small and on grazing triangles. Not unit, on the side that the winding says.
vec3 triangle_normal()
{
    uint at = 3u * triangle_id();
    return cross(BD_LOAD(triangles, at + 1u).xyz, BD_LOAD(triangles, at + 2u).xyz);
}

// The triangle's own unit normal on the side of the viewer.
vec3 geometric_normal()
{
    vec3 n = triangle_normal();
    n = dot(n, n) > 0.0 ? normalize(n) : normalize(to_viewer());
    return dot(n, to_viewer()) < 0.0 ? -n : n;
}

// Whether the viewer sees the triangle's back: points have two fronts.
bool shows_back()
{
#ifdef BD_POINTS
    bool mirrored = (material.flags & BD_MATERIAL_MIRRORED) != 0u;
    return dot(triangle_normal(), to_viewer()) < 0.0 != mirrored;
#else
    return !gl_FrontFacing;
#endif
}

// Shading normal on the side of `geometric` (why: struct bd_primitive, server/scene/model/scene.h).
//
// A normal map's frame is used as it is interpolated, neither made unit nor orthogonal, with the
// bitangent from the cross product: so MikkTSpace bakes it, and so it must be unbaked.
vec3 shading_normal(vec3 geometric)
{
    vec3 n = normal_rs;
#ifdef BD_NORMAL_MAP
    bool mirrored = (material.flags & BD_MATERIAL_MIRRORED) != 0u;
    vec3 b = cross(n, tangent_rs.xyz) * (mirrored ? -tangent_rs.w : tangent_rs.w);
    vec3 m = textureLod(normal_map, map_uv(material.normal_uv), 0.0).xyz * 2.0 - 1.0;
    m.xy *= material.normal_scale;
    vec3 bent = tangent_rs.xyz * m.x + b * m.y + n * m.z;
    if (dot(bent, bent) > 0.0) n = bent;
#endif
    if (!(dot(n, n) > 0.0)) return geometric;
    n = normalize(n);
    return dot(n, geometric) < 0.0 ? -n : n;
}
