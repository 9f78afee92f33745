// The camera's G-buffer. Single-sided back faces are culled before they come here.
#include "common/normals.glsl"
#include "common/surface.glsl"

layout(location = 0) out float out_depth;
layout(location = 1) out uvec4 out_normals;
layout(location = 2) out vec4 out_albedo;   // base colour, metallic
layout(location = 3) out vec4 out_material; // roughness, F0 of a dielectric, unlit, covered
layout(location = 4) out uint out_triangle; // id + 1
#ifdef BD_EMISSION
layout(location = 5) out vec4 out_emission;
#endif

void main()
{
    vec4 base_color = surface_base_color();
    discard_by_alpha(base_color.a);
    vec3 ng = geometric_normal();
    bool unlit = (material.flags & BD_MATERIAL_UNLIT) != 0u;
    vec2 metallic_roughness = surface_metallic_roughness();
    out_depth = -position_vs.z;
    out_normals = pack_normals_precisely(shading_normal(ng), ng);
    float opaque = 1.0 - (1.0 - metallic_roughness.x) * surface_transmission();
    out_albedo = vec4(base_color.rgb * opaque, metallic_roughness.x);
    out_material = vec4(metallic_roughness.y, material.f0_dielectric, unlit ? 1.0 : 0.0, 1.0);
    out_triangle = triangle_id() + 1u;
#ifdef BD_EMISSION
    out_emission = vec4(unlit ? base_color.rgb * material.emissive.xyz : surface_emission(), 1.0);
#endif
}
