// One face of a light's reflective shadow map (algorithms.md A0.2): what the light sees, for
// making virtual lights from. Flux is not here: it depends on the light alone, and comes with
// the texel weights of pass/rsm_weights.
#include "common/normals.glsl"
#include "common/surface.glsl"

layout(location = 0) out vec4 out_position; // render space; w = 1 where something is
layout(location = 1) out uvec2 out_normals;
layout(location = 2) out vec4 out_albedo;   // of the diffuse lobe

void main()
{
    vec4 base_color = surface_base_color();
    discard_by_alpha(base_color.a);
    vec3 ng = geometric_normal();
    // Every triangle blocks light, but the back of a single-sided one is black, and so is
    // everything unlit.
    bool back = shows_back() && (material.flags & BD_MATERIAL_DOUBLE_SIDED) == 0u;
    bool unlit = (material.flags & BD_MATERIAL_UNLIT) != 0u;
    float diffuse = back || unlit ? 0.0 : 1.0;
#ifndef BD_LAMBERT
    diffuse *= 1.0 - surface_metallic_roughness().x;
#endif
    out_position = vec4(view.position.xyz + render_from_view(position_vs), 1.0);
    out_normals = pack_normals(shading_normal(ng), ng);
    out_albedo = vec4(base_color.rgb * diffuse, 1.0);
}
