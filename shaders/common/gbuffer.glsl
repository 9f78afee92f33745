// Read access to the G-buffer.
#include "common/normals.glsl"
#include "common/view.glsl"

layout(binding = BD_UNIT_GBUFFER_DEPTH) uniform sampler2D gbuffer_depth;
layout(binding = BD_UNIT_GBUFFER_NORMALS) uniform usampler2D gbuffer_normals;
layout(binding = BD_UNIT_GBUFFER_ALBEDO) uniform sampler2D gbuffer_albedo;
layout(binding = BD_UNIT_GBUFFER_MATERIAL) uniform sampler2D gbuffer_material;

struct receiver {
    vec3 relative_position; // to the view
    vec3 position;          // render space
    vec3 normal, normal_geometric;
    vec3 base_color;
    float metallic, roughness, f0_dielectric;
    bool lit; // material_is_lit
};

// Whose specular lobe is worth its price where indirect light is gathered. So rough dielectrics
// reflect by base colour / pi alone: at roughness .6 the whole BRDF returns .97 to .98 of a white
// furnace (these: 1), .51 to .61 of base colour .5 (these: .5).
bool has_glossy_lobe(float metallic, float roughness) { return metallic > 0.0 || roughness < 0.6; }

// Whose light is asked for. BD_LOBES_ALONE: what a lobe reflects is all that is missing.
bool is_asked(receiver r)
{
#ifdef BD_LOBES_ALONE
    return r.lit && has_glossy_lobe(r.metallic, r.roughness);
#else
    return r.lit;
#endif
}

bool material_is_lit(vec4 material) { return surface_is_lit(material.z, material.w); }

receiver gbuffer_receiver(ivec2 pixel)
{
    receiver r;
    float depth = texelFetch(gbuffer_depth, pixel, 0).x;
    uvec4 normals = texelFetch(gbuffer_normals, pixel, 0);
    vec4 albedo = texelFetch(gbuffer_albedo, pixel, 0);
    vec4 material = texelFetch(gbuffer_material, pixel, 0);
    r.relative_position = view_relative_position(pixel, depth);
    r.position = view.position.xyz + r.relative_position;
    r.normal = unpack_precise_normal(normals.xy);
    r.normal_geometric = unpack_precise_normal(normals.zw);
    r.base_color = albedo.rgb;
    r.metallic = albedo.a;
    r.roughness = material.x;
    r.f0_dielectric = material.y;
    r.lit = material_is_lit(material);
    return r;
}
