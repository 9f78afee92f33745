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
#include "common/all_channels.glsl"
#include "common/array.glsl"
#include "common/brdf.glsl"
#include "common/form_factor.glsl"
#include "common/gbuffer.glsl"
#include "common/light_spread.glsl"
#include "shared/vpl.h"

BD_ARRAY(vpls, BD_UNIT_VPLS);
BD_ARRAY(vpl_quads, BD_UNIT_VPL_QUADS);

// Squared distances below this are a receiver on the VPL itself (render space is about 1 wide).
const float COINCIDENT_SQUARED = 1e-12;
// A receiver in the VPL's own plane gets nothing from it, and the patch's form factor has no value
// there; nor does a VPL in the receiver's plane give it anything, however its shading normal leans.
// So that rounding cannot lift one out of the other's plane (hazard 3): the sine must be above what
// a normal loses in the G-buffer (3e-5), the height above what a position does.
const float COPLANAR_SQUARED = 4e-8;
const float COPLANAR_HEIGHT = 1e-5;

bool is_above(float height, float r2)
{
    return height > COPLANAR_HEIGHT && height * height > COPLANAR_SQUARED * r2;
}

// Nothing behind the patch's own plane: the VPL's normal, which is smoothed or bent, would have a
// point that lies just beneath it in front, and covered by it altogether.
float patch_kernel(uint index, vec3 to_vpl, vec3 n)
{
    vec4 u = BD_LOAD(vpl_quads, index * BD_VPL_QUAD_VEC4S);
    vec3 v = BD_LOAD(vpl_quads, index * BD_VPL_QUAD_VEC4S + 1u).xyz;
    if (!is_above(-dot(normalize(cross(u.xyz, v)), to_vpl), dot(to_vpl, to_vpl))) return 0.0;
    return quad_form_factor(to_vpl, u.xyz, v, n) * u.w;
}

#ifdef BD_GLOSSY
// Per irradiance. The specular lobe cannot be integrated over a patch: its peak is held to what a
// patch can send.
vec3 beyond_diffuse(receiver r, vec3 viewer, vec3 to_vpl, float r2)
{
    vec3 l = to_vpl * inversesqrt(r2);
    float roughness = max(r.roughness, 0.25);
    vec3 all = brdf(r.base_color, r.metallic, roughness, r.f0_dielectric, r.normal, l, viewer);
    return all - r.base_color * ((1.0 - r.metallic) / PI);
}
#endif

#ifdef BD_VECTOR
// Light that grazes the receiver would make the vector long along the surface, for normals so far
// from its own that they are no longer the same surface.
const float VECTOR_COSINE_MIN = 0.2;

const float LENGTH_MIN = 1e-12; // for 0 / 0 where a VPL is at the receiver and gives nothing

// Per unit of the VPL's irradiance, but for what it has along the normal (irradiance_vector).
vec3 direction_of_unit(vec3 to_vpl, float r2, vec3 n)
{
    float height = max(dot(to_vpl, n), VECTOR_COSINE_MIN * sqrt(r2));
    return to_vpl / max(height, LENGTH_MIN);
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

#ifdef BD_VECTOR
// What all of them have along the normal is known from their irradiance: so it is left out of the
// sum's terms, and of the sum.
vec3 irradiance_vector(sums s, vec3 n)
{
    return s.directions + n * (all_channels(s.diffuse) - dot(s.directions, n));
}
#endif

bool faces(vec3 normal, vec3 to_vpl, float r2)
{
    return is_above(-dot(normal, to_vpl), r2);
}

// Irradiance of a unit of flux from a disk; 0 where either is below the other's horizon.
float disk_seen(receiver r, vec3 to_vpl, float r2, vec3 normal, float area)
{
    float receiver_dot = dot(r.normal, to_vpl);
    float side = dot(r.normal_geometric, to_vpl);
    bool seen = receiver_dot > 0.0 && is_above(side, r2) && r2 > COINCIDENT_SQUARED;
    if (!seen || !faces(normal, to_vpl, r2)) return 0.0;
    return disk_kernel(receiver_dot, -dot(normal, to_vpl), r2, area);
}

#ifdef BD_VPL_PATCH
void add_patch(inout sums s, receiver r, vec3 viewer, uint index)
{
    vec3 to_vpl = BD_LOAD(vpls, index * BD_VPL_VEC4S).xyz - r.position;
    float r2 = dot(to_vpl, to_vpl);
    // A patch reaches over the edge of what it stands for: only one whose centre is above the
    // receiver's surface counts, or the outside of a thin wall is lit from within.
    if (!is_above(dot(to_vpl, r.normal_geometric), r2)) return;
    vec3 flux = BD_LOAD(vpls, index * BD_VPL_VEC4S + 2u).rgb;
    add(s, r, viewer, to_vpl, r2, flux * patch_kernel(index, to_vpl, r.normal));
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

// False, and nothing added, for one so near that it must be integrated as a patch.
bool add_far(inout sums s, receiver r, vec3 viewer, virtual_light vpl)
{
    vec3 to_vpl = vpl.position_area.xyz - r.position, normal = vpl.normal_near.xyz;
    float r2 = dot(to_vpl, to_vpl);
    float kernel = disk_seen(r, to_vpl, r2, normal, vpl.position_area.w);
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
