// One VPL for each block of a regular grid over a light's reflective shadow map.
//
// A VPL carries the summed flux of its whole block, so that the total is exact whatever the grid
// (algorithms.md A1). It stands on the surface of a representative texel, above the flux-weighted
// mean of the texels that lie on that surface: a mean over a depth edge would float in the air.
#include "common/light.glsl"
#include "common/normals.glsl"
#include "shared/vpl.h"
#include "shared/vpl_grid.h"

layout(local_size_x = 8, local_size_y = 8) in;
layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_vpl_grid_args args; };
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

// Of the invocation; set first thing in main.
uint face = 0u;
vec3 face_x = vec3(0.0), face_y = vec3(0.0), face_z = vec3(0.0);

bool directional() { return light.kind.x == BD_LIGHT_KIND_DIRECTIONAL; }

texel load_texel(ivec2 at)
{
    texel t;
    vec4 position = texelFetch(rsm_position, ivec3(at, face), 0);
    t.valid = position.w > 0.0;
    t.position = position.xyz;
    uvec2 normals = texelFetch(rsm_normal, ivec3(at, face), 0).xy;
    t.normal = unpack_normal(normals.x);
    t.normal_geometric = unpack_normal(normals.y);
    vec2 weight = texelFetch(rsm_weight, ivec3(at, args.grid.z != 0u ? 0u : face), 0).xy;
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

// First texel of a block's row or column; the last block ends at the map's side.
int block_begin(uint block) { return int(block * light.kind.z / args.grid.x); }

// The texel of the block nearest to the flux-weighted mean position: a point that exists.
bool find_representative(ivec2 begin, ivec2 end, inout texel representative)
{
    vec3 sum = vec3(0.0);
    float weight = 0.0;
    for (int y = begin.y; y < end.y; y++) {
        for (int x = begin.x; x < end.x; x++) {
            texel t = load_texel(ivec2(x, y));
            if (t.flux_in <= 0.0) continue;
            sum += t.position * t.flux_in;
            weight += t.flux_in;
        }
    }
    if (weight <= 0.0) return false;
    vec3 mean = sum / weight;
    float nearest = 3.4e38;
    for (int y = begin.y; y < end.y; y++) {
        for (int x = begin.x; x < end.x; x++) {
            texel t = load_texel(ivec2(x, y));
            vec3 d = t.position - mean;
            if (t.flux_in <= 0.0 || dot(d, d) >= nearest) continue;
            nearest = dot(d, d);
            representative = t;
        }
    }
    return true;
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
    vec2 extent = vec2(light.axis_x.w, -light.axis_y.w);
    vec2 lateral = (texel_at / float(light.kind.z) * 2.0 - 1.0) * extent;
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

void store(uint index, vec3 position, float area, vec3 normal, vec3 flux, vec3 u, vec3 v)
{
    float kernel_area = args.grid.y == BD_VPL_KERNEL_POINT ? 0.0 : area;
    float near = args.grid.y == BD_VPL_KERNEL_PATCH ? args.limits.x : 0.0;
    vpls[index * BD_VPL_VEC4S] = vec4(position, kernel_area);
    vpls[index * BD_VPL_VEC4S + 1u] = vec4(normal, near * near * area / 3.14159265);
    vpls[index * BD_VPL_VEC4S + 2u] = vec4(flux, 0.0);
    vpl_quads[index * BD_VPL_QUAD_VEC4S] = vec4(u, area > 0.0 ? 1.0 / area : 0.0);
    vpl_quads[index * BD_VPL_QUAD_VEC4S + 1u] = vec4(v, 0.0);
}

// Half sides of the parallelogram that the block covers on its plane, scaled to the summed area.
void patch_sides(ivec2 begin, ivec2 end, vec3 centre, vec3 normal, float area, out vec3 u,
                 out vec3 v)
{
    vec2 middle = vec2(begin + end) * 0.5;
    u = 0.5 * (on_plane(vec2(end.x, middle.y), centre, normal) -
               on_plane(vec2(begin.x, middle.y), centre, normal));
    v = 0.5 * (on_plane(vec2(middle.x, end.y), centre, normal) -
               on_plane(vec2(middle.x, begin.y), centre, normal));
    float covered = 4.0 * length(cross(u, v));
    float scale = covered > 0.0 ? sqrt(area / covered) : 0.0;
    u *= scale;
    v *= scale;
}

void main()
{
    uvec2 cell = gl_GlobalInvocationID.xy;
    face = gl_GlobalInvocationID.z;
    if (any(greaterThanEqual(cell, uvec2(args.grid.x)))) return;
    uint index = (face * args.grid.x + cell.y) * args.grid.x + cell.x;
    light_face_axes(face, face_x, face_y, face_z);
    ivec2 begin = ivec2(block_begin(cell.x), block_begin(cell.y));
    ivec2 end = ivec2(block_begin(cell.x + 1u), block_begin(cell.y + 1u));

    texel representative = load_texel(begin);
    if (!find_representative(begin, end, representative)) {
        store(index, vec3(0.0), 0.0, vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
        return;
    }
    vec3 position = vec3(0.0), flux = vec3(0.0);
    vec3 normal = vec3(0.0), normal_geometric = vec3(0.0);
    float weight = 0.0, area = 0.0;
    for (int y = begin.y; y < end.y; y++) {
        for (int x = begin.x; x < end.x; x++) {
            texel t = load_texel(ivec2(x, y));
            flux += t.flux_out;
            if (t.flux_in <= 0.0 || !on_same_surface(representative, t)) continue;
            // Relative to the representative: sums of nearby positions keep their low bits.
            position += (t.position - representative.position) * t.flux_in;
            normal += t.normal * t.flux_in;
            normal_geometric += t.normal_geometric * t.flux_in;
            weight += t.flux_in;
            area += t.area;
        }
    }
    normal = normalize(normal);
    normal_geometric = normalize(normal_geometric);
    // The mean of points on a curved surface lies behind it: only its lateral part counts. By the
    // surface's own normal: a bent one would lift the VPL off it, to light what it lies on.
    vec3 offset = position / weight;
    position = representative.position + offset - normal_geometric * dot(normal_geometric, offset);
    vec3 u, v;
    patch_sides(begin, end, position, normal_geometric, area, u, v);
    store(index, position, area, normal, flux, u, v);
}
