// What a pixel of the camera's picture sees, or with BD_RSM a texel of a light's map: one way to ask
// for both, for who looks at where surfaces jump and not at what they are made of.
#include "common/normals.glsl"
#include "common/view.glsl"
#ifdef BD_RSM
layout(binding = BD_UNIT_RSM_POSITION) uniform sampler2DArray rsm_position;
layout(binding = BD_UNIT_RSM_NORMAL) uniform usampler2DArray rsm_normal;
#else
#include "common/gbuffer.glsl"
#endif

// `face` is of a light's map. True where something is that light can reach.
bool seen_lit(ivec2 pixel, uint face)
{
#ifdef BD_RSM
    return texelFetch(rsm_position, ivec3(pixel, face), 0).w > 0.0;
#else
    return material_is_lit(texelFetch(gbuffer_material, pixel, 0));
#endif
}

// Along the view's or the face's axis, render units.
float seen_depth(ivec2 pixel, uint face)
{
#ifdef BD_RSM
    vec3 position = texelFetch(rsm_position, ivec3(pixel, face), 0).xyz;
    return dot(view.position.xyz - position, view.axis_z.xyz);
#else
    return texelFetch(gbuffer_depth, pixel, 0).x;
#endif
}

// The shading normal, or a camera's geometric one with BD_GEOMETRIC_NORMALS.
vec3 seen_normal(ivec2 pixel, uint face)
{
#ifdef BD_RSM
    return unpack_normal(texelFetch(rsm_normal, ivec3(pixel, face), 0).x);
#elif defined(BD_GEOMETRIC_NORMALS)
    return unpack_precise_normal(texelFetch(gbuffer_normals, pixel, 0).zw);
#else
    return unpack_precise_normal(texelFetch(gbuffer_normals, pixel, 0).xy);
#endif
}
