// VPLs summed at a receiver, in the order of the list, without visibility. For whoever gathers:
// a pixel, or a point that stands for a block of them.
//
// BD_VPL_PATCH: VPLs nearer than their own limit are integrated as the parallelograms that they are
// (algorithms.md A2.2); else the disk kernel, which is the bare one where the stored area is 0.
// BD_GLOSSY: also what the whole BRDF reflects towards the viewer beyond base colour / pi times the
// irradiance, which cannot be demodulated. Negative where the diffuse lobe loses more than the
// specular one gives.
// BD_VECTOR: also the irradiance vector, of all channels together: its dot product with the
// receiver's normal is their irradiance, and near it for normals near that one.
// BD_VISIBLE: of a block's VPLs those in `hidden` count for nothing.
// BD_SPREAD: also how far off light that is interpolated over the receiver's block may be.
#include "common/array.glsl"
#include "common/brdf.glsl"
#include "common/gbuffer.glsl"
#include "common/light_spread.glsl"
#include "kernel/coat.h"
#include "kernel/vpl_light.h"
#include "shared/vpl.h"

BD_ARRAY(vpls, BD_UNIT_VPLS);
BD_ARRAY(vpl_quads, BD_UNIT_VPL_QUADS);

#ifdef BD_GLOSSY
// Per irradiance.
vec3 beyond_diffuse(receiver r, vec3 viewer, vec3 to_vpl, float r2)
{
    return beyond_diffuse(r.base_color, r.metallic, r.roughness, r.f0_dielectric, r.normal,
                          f3_scale(to_vpl, 1.0 / sqrt(r2)), viewer);
}
#endif

struct sums {
    vec3 diffuse, glossy;
    vec3 directions; // see irradiance_vector
    light_spread spread; // with BD_SPREAD
};

sums no_light() { return sums(vec3(0.0), vec3(0.0), vec3(0.0), light_spread(0.0, 0.0, 0.0)); }

void add(inout sums s, receiver r, vec3 viewer, vec3 to_vpl, float r2, vec3 irradiance_of_vpl)
{
    s.diffuse += irradiance_of_vpl;
#ifdef BD_GLOSSY
    if (has_glossy_lobe(r.metallic, r.roughness) && irradiance_of_vpl != vec3(0.0))
        s.glossy += irradiance_of_vpl * beyond_diffuse(r, viewer, to_vpl, r2);
#endif
#ifdef BD_VECTOR
    s.directions += all_channels(irradiance_of_vpl) * direction_of_unit(to_vpl, r2, r.normal);
#endif
}

vec3 irradiance_vector(sums s, vec3 n) { return irradiance_vector(s.diffuse, s.directions, n); }

float disk_seen(receiver r, vec3 to_vpl, float r2, vec3 normal, float area, float bound)
{
    return disk_light(r.normal, r.normal_geometric, to_vpl, r2, normal, area, bound);
}

#ifdef BD_VPL_PATCH
void add_patch(inout sums s, receiver r, vec3 viewer, uint index)
{
    vec3 to_vpl = BD_LOAD(vpls, index * BD_VPL_VEC4S).xyz - r.position;
    float r2 = dot(to_vpl, to_vpl);
    vec4 u = BD_LOAD(vpl_quads, index * BD_VPL_QUAD_VEC4S);
    vec3 v = BD_LOAD(vpl_quads, index * BD_VPL_QUAD_VEC4S + 1u).xyz;
    float kernel = patch_light(r.normal, r.normal_geometric, to_vpl, r2, u.xyz, v, u.w);
    add(s, r, viewer, to_vpl, r2, BD_LOAD(vpls, index * BD_VPL_VEC4S + 2u).rgb * kernel);
}
#endif

// As it is in the array (shared/vpl.h).
struct virtual_light {
    vec4 position_area, normal_near;
    vec3 flux;
};

virtual_light vpl_at(uint index)
{
    return virtual_light(BD_LOAD(vpls, index * BD_VPL_VEC4S),
                         BD_LOAD(vpls, index * BD_VPL_VEC4S + 1u),
                         BD_LOAD(vpls, index * BD_VPL_VEC4S + 2u).rgb);
}

// As the receiver sees it.
virtual_light vpl_with_coat(receiver r, uint index)
{
    virtual_light vpl = vpl_at(index);
    vec4 way = BD_LOAD(vpl_quads, index * BD_VPL_QUAD_VEC4S);
    vec4 coat = BD_LOAD(vpl_quads, index * BD_VPL_QUAD_VEC4S + 1u);
    float even = BD_LOAD(vpls, index * BD_VPL_VEC4S + 2u).w;
    vec3 to_vpl = vpl.position_area.xyz - r.position;
    vpl.flux = flux_with_coat(vpl.flux, coat.rgb, even, way.w, coat.w, vpl.normal_near.xyz, way.xyz,
                              to_vpl, dot(to_vpl, to_vpl));
    return vpl;
}

// False, and nothing added, for one so near that it must be integrated as a patch.
bool add_far(inout sums s, receiver r, vec3 viewer, virtual_light vpl)
{
    vec3 to_vpl = vpl.position_area.xyz - r.position, normal = vpl.normal_near.xyz;
    float r2 = dot(to_vpl, to_vpl);
    float kernel = disk_seen(r, to_vpl, r2, normal, vpl.position_area.w, bound_of_near(vpl.normal_near.w));
    bool far = true;
#ifdef BD_VPL_PATCH
    far = r2 >= vpl.normal_near.w || !faces(normal, to_vpl, r2);
    if (!far) kernel = 0.0;
#endif
    add(s, r, viewer, to_vpl, r2, vpl.flux * kernel);
#ifdef BD_SPREAD
    add_spread(s.spread, r.normal_geometric, to_vpl, r2, vec4(normal, vpl.position_area.w),
               all_channels(vpl.flux));
#endif
    return far;
}

#ifdef BD_VISIBLE
uint hidden = 0u; // a bit for each VPL of the block that is gathered next
#endif

// A block of at most 32 VPLs. Those near enough to be integrated as patches are marked in a bit
// mask and done after the others, because a software device runs both sides of every branch:
// in the inner loop the patch's formula would cost six times the rest.
void gather_block(inout sums s, receiver r, vec3 viewer, uint begin, uint end)
{
    uint near = 0u;
    for (uint index = begin; index < end; index++) {
        virtual_light vpl = vpl_at(index);
#ifdef BD_VISIBLE
        if ((hidden >> (index - begin) & 1u) != 0u) vpl.flux = vec3(0.0);
#endif
        if (!add_far(s, r, viewer, vpl)) near |= 1u << (index - begin);
    }
#ifdef BD_VISIBLE
    near &= ~hidden;
#endif
#ifdef BD_VPL_PATCH
    while (near != 0u) {
        add_patch(s, r, viewer, begin + uint(findLSB(near)));
        near &= near - 1u;
    }
#endif
}
