// How much a VPL would give a receiver if nothing stood between them, for choosing in proportion to
// it, and running sums of that over groups of VPLs in the order of the list.
#include "common/segments.glsl"

layout(std430, binding = BD_STORAGE_PREFIX) buffer prefix_block { float prefix[]; };

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

// All channels together.
float strength(receiver r, vec3 viewer, virtual_light vpl)
{
    vec3 to_vpl = vpl.position_area.xyz - r.position, normal = vpl.normal_near.xyz;
    float r2 = dot(to_vpl, to_vpl);
#ifdef BD_VPL_PATCH
    float near2 = vpl.normal_near.w;
#else
    float near2 = min(vpl.normal_near.w, 0.0);
#endif
    float kernel = strength_of_unit(r.normal, r.normal_geometric, to_vpl, r2, normal,
                                    vpl.position_area.w, near2);
    float light = kernel * all_channels(vpl.flux);
#ifdef BD_GLOSSY
    if (light > 0.0) light *= reflected(r, viewer, to_vpl, r2);
#endif
    return light;
}

#ifdef BD_GROUPED
BD_ARRAY(vpl_groups, BD_UNIT_VPL_GROUPS);

// A group of the list, as one VPL (shared/vpl.h).
struct vpl_group {
    vec3 to; // from the receiver
    float r2, area, normal_spread, radius, flux;
    vec3 normal;
    bool is_near; // its VPLs are to be looked at
};

vpl_group group_of(receiver r, uint group)
{
    vec4 place = BD_LOAD(vpl_groups, group * BD_VPL_GROUP_VEC4S);
    vec4 normal = BD_LOAD(vpl_groups, group * BD_VPL_GROUP_VEC4S + 1u);
    vec4 reach = BD_LOAD(vpl_groups, group * BD_VPL_GROUP_VEC4S + 2u);
    vec3 to = place.xyz - r.position;
    float r2 = dot(to, to);
    return vpl_group(to, r2, place.w, normal.w, reach.x, reach.z, normal.xyz, r2 < reach.y);
}

float strength(receiver r, vpl_group group)
{
    return group.flux * strength_of_group(r.normal, r.normal_geometric, group.to, group.r2, group.normal,
                                          group.normal_spread, group.radius, group.area);
}
#endif

// Where the sum over the groups up to `group` is kept.
uint place_of_prefix(uint group, uint place) { return group * asker_count() + place; }
