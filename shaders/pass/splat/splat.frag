// One VPL's light on one pixel, to be added up (algorithms.md A0.7 N3). The fourth channel counts.
#include "common/vpl_gather.glsl"

flat in uint splat_vpl;
flat in float splat_reach_squared;
layout(location = 0) out vec4 irradiance;
#ifdef BD_GLOSSY
layout(location = 1) out vec4 glossy;
#endif

// The last quarter of the ball's cross-section fades, so that a rounded position does not switch a
// VPL on or off.
const float FADE = 0.25;

void main()
{
    receiver r = gbuffer_receiver(ivec2(gl_FragCoord.xy));
    vec3 viewer = direction_to_viewer(r.relative_position);
    vec3 to_vpl = BD_LOAD(vpls, splat_vpl * BD_VPL_VEC4S).xyz - r.position;
    float left = 1.0 - dot(to_vpl, to_vpl) / splat_reach_squared;
    sums s;
    s.diffuse = s.glossy = vec3(0.0);
    if (r.lit && left > 0.0) gather_block(s, r, viewer, splat_vpl, splat_vpl + 1u);
    float weight = clamp(left / FADE, 0.0, 1.0);
    irradiance = vec4(weight * s.diffuse, 1.0);
#ifdef BD_GLOSSY
    glossy = vec4(weight * s.glossy, 1.0);
#endif
}
