// How light goes on that an opaque surface reflects, as a ray brings it: one way, of the diffuse
// lobe or of the specular one, chosen by what each carries.
//
// The glTF BRDF (kernel/brdf.h). The specular lobe stands on the interpolated normal, the diffuse
// one on the triangle's own, as points of surfaces do.
//
// Heitz 2018 (visible normals); Jensen 1996.
//
// Thread: any.

#ifndef BD_LIGHTS_REFLECTION_H
#define BD_LIGHTS_REFLECTION_H

#include "lights/surface_hits.h"

// A place as the BRDF wants it.
struct bd_reflecting {
    f3 base_color, normal, normal_geometric;
    float metallic, roughness, f0_dielectric;
};
struct bd_reflecting bd_reflecting_at(const struct bd_surface_hits *hits,
                                      const struct bd_surface_point *at, float u, float v);

// Under a normal that leans irradiance is as much more as light comes to it under a larger cosine.
// Held, since what grazes the triangle says too much: as the upsampling does (pass/upsample.h).
#define BD_BENT_MOST 4.0f
static inline float bd_bent(f3 normal, f3 normal_geometric, f3 way)
{
    const float below = f_max(f3_dot(normal_geometric, way), 1e-6f);
    return f_min(f_max(f3_dot(normal, way), 0) / below, BD_BENT_MOST);
}

struct bd_reflection {
    f3 direction; // unit
    f3 weight;    // of flux that goes along it, 0 to about 1 / the lobe's part
};

// Of a ray from there, unit, at a place that it met (bd_surface_hit_at) at those barycentrics.
// `lambert`: the base colour, evenly. `beside_interface`: of a surface that is a mirror in part,
// what is none (lights/interface.h). `number`: two in [0, 1) for the way, one for the lobe. False:
// it goes below the surface, and ends.
bool bd_reflect(const struct bd_surface_hits *hits, const struct bd_surface_point *at, float u,
                float v, f3 direction, bool lambert, bool beside_interface, const float number[3],
                struct bd_reflection *out);

#endif
