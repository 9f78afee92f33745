// A surface's BRDF in 1/sr, without the cosine: glTF's (kernel/brdf.h), or with BD_LAMBERT
// base colour / pi.
#include "common/pi.glsl"
#include "kernel/brdf.h"

// n, l, v unit; 0 below the horizon is the caller's.
vec3 brdf(vec3 base_color, float metallic, float roughness, float f0_dielectric, vec3 n, vec3 l,
          vec3 v)
{
#ifdef BD_LAMBERT
    return lambert_brdf(base_color);
#else
    return gltf_brdf(base_color, metallic, roughness, f0_dielectric, n, l, v);
#endif
}
