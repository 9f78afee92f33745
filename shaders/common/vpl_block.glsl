// The VPL that stands for a block of texels of a light's reflective shadow map.
//
// It carries the summed flux of the whole block, so that the total is exact whatever the blocks
// (algorithms.md A1). It stands on the surface of a representative texel, above the flux-weighted
// mean of the texels that lie on that surface: a mean over a depth edge would float in the air.
//
// A block is walked by one invocation, or by a whole work group (BD_GROUP_PER_VPL) where it is
// large: one invocation is slow then, and the software device ends all loops of one after 65,535
// rounds.
//
// Before it is included: `args`, with a bd_vpl_block_args named `block`.
#include "common/light.glsl"
#include "common/normals.glsl"
#include "common/pi.glsl"
#include "shared/vpl.h"

#ifdef BD_GROUP_PER_VPL
const uint MEMBERS = 1024u;
#else
const uint MEMBERS = 1u;
#endif
layout(binding = BD_UNIT_RSM_POSITION) uniform sampler2DArray rsm_position;
layout(binding = BD_UNIT_RSM_NORMAL) uniform usampler2DArray rsm_normal;
layout(binding = BD_UNIT_RSM_ALBEDO) uniform sampler2DArray rsm_albedo;
// x = flux per unit of intensity (solid angle times cone attenuation), y = solid angle or area
layout(binding = BD_UNIT_RSM_WEIGHT) uniform sampler2DArray rsm_weight;
layout(std430, binding = BD_STORAGE_VPLS) writeonly buffer vpl_block { vec4 vpls[]; };
layout(std430, binding = BD_STORAGE_VPL_QUADS) writeonly buffer quad_block { vec4 vpl_quads[]; };

const float COS_IN_MIN = 0.05; // a texel at grazing light is not infinitely large (hazard 6)

struct texel {
    vec3 position, normal, normal_geometric, flux_out;
    float flux_in, area;
    bool valid;
};

// Of the invocation; set first thing in main. The block ends before `block_end`.
ivec2 block_begin = ivec2(0), block_end = ivec2(0);
uint face = 0u;
vec3 face_x = vec3(0.0), face_y = vec3(0.0), face_z = vec3(0.0);

bool directional() { return light.kind == BD_LIGHT_KIND_DIRECTIONAL; }

texel load_texel(ivec2 at)
{
    texel t;
    vec4 position = texelFetch(rsm_position, ivec3(at, face), 0);
    t.valid = position.w > 0.0;
    t.position = position.xyz;
    uvec2 normals = texelFetch(rsm_normal, ivec3(at, face), 0).xy;
    t.normal = unpack_normal(normals.x);
    t.normal_geometric = unpack_normal(normals.y);
    vec2 weight = texelFetch(rsm_weight, ivec3(at, args.block.has_one_weight_layer != 0u ? 0u : face), 0).xy;
    vec3 from_light = t.position - light.position.xyz;
    float r2 = directional() ? 1.0 : dot(from_light, from_light);
    vec3 incoming = directional() ? light.direction.xyz : from_light * inversesqrt(max(r2, 1e-30));
    float window = directional() ? 1.0 : range_window(sqrt(r2));
    vec3 flux = light.intensity.xyz * (weight.x * window);
    t.flux_in = t.valid ? max(flux.r, max(flux.g, flux.b)) : 0.0;
    t.flux_out = t.valid ? flux * texelFetch(rsm_albedo, ivec3(at, face), 0).rgb : vec3(0.0);
    t.area = weight.y * r2 / max(-dot(t.normal_geometric, incoming), COS_IN_MIN);
    return t;
}

uint block_texels()
{
    ivec2 size = block_end - block_begin;
    return uint(size.x * size.y);
}

ivec2 block_texel(uint i)
{
    uint width = uint(block_end.x - block_begin.x);
    return block_begin + ivec2(i % width, i / width);
}

#ifdef BD_GROUP_PER_VPL
uint member() { return gl_LocalInvocationIndex; }

shared vec4 slots[MEMBERS];

void put(vec4 mine)
{
    barrier(); // somebody may still read what was there
    slots[member()] = mine;
    memoryBarrierShared();
    barrier();
}

// Sum over the group, the same for all members; in a fixed order.
vec4 group_sum(vec4 mine)
{
    put(mine);
    for (uint width = MEMBERS / 2u; width > 0u; width /= 2u) {
        if (member() < width) slots[member()] += slots[member() + width];
        memoryBarrierShared();
        barrier();
    }
    return slots[0];
}

// The candidate (x = distance, y = index) that is nearest; of equals the first.
vec2 group_nearest(vec2 mine)
{
    put(vec4(mine, 0.0, 0.0));
    for (uint width = MEMBERS / 2u; width > 0u; width /= 2u) {
        if (member() < width) {
            vec2 a = slots[member()].xy, b = slots[member() + width].xy;
            bool second = b.x < a.x || (b.x == a.x && b.y < a.y);
            slots[member()].xy = second ? b : a;
        }
        memoryBarrierShared();
        barrier();
    }
    return slots[0].xy;
}
#else
uint member() { return 0u; }
vec4 group_sum(vec4 mine) { return mine; }
vec2 group_nearest(vec2 mine) { return mine; }
#endif

// A number in steps of 1 / 2048 of itself. Four texels around the middle of a block are equally far
// from it: rounding, which changes with the light's power, must not choose among them.
float in_steps(float number)
{
    return uintBitsToFloat(floatBitsToUint(number) & 0xfffff000u);
}

// The texel of the block nearest to the flux-weighted mean position: a point that exists.
bool find_representative(out texel representative)
{
    vec4 sum = vec4(0.0); // position times flux, flux
    for (uint i = member(); i < block_texels(); i += MEMBERS) {
        texel t = load_texel(block_texel(i));
        if (t.flux_in > 0.0) sum += vec4(t.position, 1.0) * t.flux_in;
    }
    sum = group_sum(sum);
    vec3 mean = sum.w > 0.0 ? sum.xyz / sum.w : vec3(0.0);
    vec2 nearest = vec2(3.4e38, 0.0); // squared distance, index: exact below 2^24
    for (uint i = member(); i < block_texels(); i += MEMBERS) {
        texel t = load_texel(block_texel(i));
        vec3 d = t.position - mean;
        float d2 = in_steps(dot(d, d));
        if (t.flux_in > 0.0 && d2 < nearest.x) nearest = vec2(d2, float(i));
    }
    nearest = group_nearest(nearest);
    representative = load_texel(block_texel(uint(nearest.y)));
    return sum.w > 0.0;
}

bool on_same_surface(texel a, texel b)
{
    vec3 d = b.position - a.position;
    float reach = length(d);
    return dot(a.normal, b.normal) > 0.9 && abs(dot(a.normal_geometric, d)) <= 0.1 * reach + 1e-6;
}

// Where the light's ray through a point of the face meets the patch's plane, from its centre.
vec3 on_plane(vec2 texel_at, vec3 centre, vec3 normal)
{
    vec2 extent = vec2(light.half_width, -light.half_height);
    vec2 lateral = (texel_at / float(light.face_side_px) * 2.0 - 1.0) * extent;
    vec3 across = face_x * lateral.x + face_y * lateral.y;
    vec3 start = light.position.xyz;
    vec3 ray = across - face_z;
    if (directional()) {
        start += across;
        ray = light.direction.xyz;
    }
    float toward = dot(ray, normal);
    toward = min(toward, -COS_IN_MIN * length(ray));
    return start + ray * (dot(centre - start, normal) / toward) - centre;
}

// A vector of the plane of u and v in parts of them; (0, 0) where they span none.
vec2 in_sides(vec3 offset, vec3 u, vec3 v)
{
    float uu = dot(u, u), uv = dot(u, v), vv = dot(v, v);
    float determinant = uu * vv - uv * uv;
    if (!(determinant > 1e-6 * uu * vv)) return vec2(0.0);
    float ou = dot(offset, u), ov = dot(offset, v);
    return vec2(ou * vv - ov * uv, ov * uu - ou * uv) / determinant;
}

// `offset`: of the position from the representative texel's.
void store(uint index, vec3 position, float area, vec3 normal, vec3 flux, vec3 u, vec3 v,
           vec3 offset)
{
    float kernel_area = args.block.kernel == BD_VPL_KERNEL_POINT ? 0.0 : area;
    float near = args.block.kernel == BD_VPL_KERNEL_PATCH ? args.block.near_field : 0.0;
    vpls[index * BD_VPL_VEC4S] = vec4(position, kernel_area);
    // A long patch is no disk until its length is small against the distance, too.
    float reach_squared = max(area / PI, max(dot(u, u), dot(v, v)));
    vpls[index * BD_VPL_VEC4S + 1u] = vec4(normal, near * near * reach_squared);
    vec2 sides = in_sides(offset, u, v);
    vpls[index * BD_VPL_VEC4S + 2u] = vec4(flux, sides.x);
    vpl_quads[index * BD_VPL_QUAD_VEC4S] = vec4(u, area > 0.0 ? 1.0 / area : 0.0);
    vpl_quads[index * BD_VPL_QUAD_VEC4S + 1u] = vec4(v, sides.y);
}

// Half sides of the parallelogram that the block covers on its plane, scaled to the summed area;
// their cross product is on the side of the normal.
void patch_sides(vec3 centre, vec3 normal, float area, out vec3 u, out vec3 v)
{
    vec2 begin = vec2(block_begin), end = vec2(block_end), middle = 0.5 * (begin + end);
    u = 0.5 * (on_plane(vec2(end.x, middle.y), centre, normal) -
               on_plane(vec2(begin.x, middle.y), centre, normal));
    v = 0.5 * (on_plane(vec2(middle.x, end.y), centre, normal) -
               on_plane(vec2(middle.x, begin.y), centre, normal));
    float covered = 4.0 * length(cross(u, v));
    float scale = covered > 0.0 ? sqrt(area / covered) : 0.0;
    u *= scale;
    v *= dot(cross(u, v), normal) < 0.0 ? -scale : scale;
}

// What the block's texels sum up to. Flux is that of all, the rest of those on the surface.
struct block_sums {
    vec3 flux;
    vec3 offset; // flux-weighted mean, from the representative
    vec3 normal, normal_geometric;
    float area;
};

block_sums sum_block(texel representative)
{
    vec4 flux_area = vec4(0.0), offset = vec4(0.0); // offset times flux, flux
    vec3 normal = vec3(0.0), normal_geometric = vec3(0.0);
    for (uint i = member(); i < block_texels(); i += MEMBERS) {
        texel t = load_texel(block_texel(i));
        flux_area.xyz += t.flux_out;
        if (t.flux_in <= 0.0 || !on_same_surface(representative, t)) continue;
        // Relative to the representative: sums of nearby positions keep their low bits.
        offset += vec4(t.position - representative.position, 1.0) * t.flux_in;
        normal += t.normal * t.flux_in;
        normal_geometric += t.normal_geometric * t.flux_in;
        flux_area.w += t.area;
    }
    flux_area = group_sum(flux_area);
    offset = group_sum(offset);
    normal = group_sum(vec4(normal, 0.0)).xyz;
    normal_geometric = group_sum(vec4(normal_geometric, 0.0)).xyz;
    return block_sums(flux_area.xyz, offset.xyz / offset.w, normalize(normal),
                      normalize(normal_geometric), flux_area.w);
}

// The VPL of the texels [begin, end) of the face of `args`, to place `index` of the list.
void make_vpl(ivec2 begin, ivec2 end, uint index)
{
    block_begin = begin;
    block_end = end;
    face = args.block.face;
    light_face_axes(face, face_x, face_y, face_z);
    texel representative;
    if (!find_representative(representative)) {
        store(index, vec3(0.0), 0.0, vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
        return;
    }
    block_sums sums = sum_block(representative);
    // The mean of points on a curved surface lies behind it: only its lateral part counts. By the
    // surface's own normal: a bent one would lift the VPL off it, to light what it lies on.
    vec3 n = sums.normal_geometric;
    vec3 position = representative.position + sums.offset - n * dot(n, sums.offset);
    vec3 u, v;
    patch_sides(position, n, sums.area, u, v);
    store(index, position, sums.area, sums.normal, sums.flux, u, v,
          position - representative.position);
}
