// How much a VPL would give a receiver if nothing stood between them, for choosing in proportion to
// it, and running sums of that over groups of VPLs in the order of the list.
#include "common/segments.glsl"

layout(std430, binding = BD_STORAGE_PREFIX) buffer prefix_block { float prefix[]; };

// The disk's light, all channels together; exact where VPLs are far. A near one is integrated as a
// patch where it is chosen, and has light even where its centre is below a horizon: there cosines
// count as these at least, so that whatever gives light can be chosen.
const float NEAR_COSINE_MIN = 0.1;

#ifdef BD_GLOSSY
// What the whole BRDF makes of its light, or so much of the diffuse lobe at least: irradiance is
// asked for, too.
const float DIFFUSE_SHARE_MIN = 0.2;

float reflected(receiver r, vec3 viewer, vec3 to_vpl, float r2)
{
    float diffuse = all_channels(r.base_color) / PI;
    vec3 both = r.base_color * ((1.0 - r.metallic) / PI) + beyond_diffuse(r, viewer, to_vpl, r2);
    return max(all_channels(both), DIFFUSE_SHARE_MIN * max(diffuse, 0.01));
}
#endif

float strength(receiver r, vec3 viewer, virtual_light vpl)
{
    vec3 to_vpl = vpl.position_area.xyz - r.position, normal = vpl.normal_near.xyz;
    float r2 = dot(to_vpl, to_vpl);
    float kernel = disk_seen(r, to_vpl, r2, normal, vpl.position_area.w);
#ifdef BD_VPL_PATCH
    bool near = r2 < vpl.normal_near.w && faces(normal, to_vpl, r2) &&
                is_above(dot(to_vpl, r.normal_geometric), r2);
    float least = NEAR_COSINE_MIN * sqrt(r2);
    float receiver_dot = max(dot(r.normal, to_vpl), least);
    float vpl_dot = max(-dot(normal, to_vpl), least);
    float of_near = disk_kernel(receiver_dot, vpl_dot, r2, vpl.position_area.w);
    kernel = near ? of_near : kernel;
#endif
    float light = kernel * all_channels(vpl.flux);
#ifdef BD_GLOSSY
    if (light > 0.0) light *= reflected(r, viewer, to_vpl, r2);
#endif
    return light;
}

// Where the sum over the groups up to `group` is kept.
uint place_of_prefix(uint group, uint place) { return group * asker_count() + place; }
