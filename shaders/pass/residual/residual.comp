// What a screen's parts give to a pixel beyond the clamp: a walk over each part of the coarsest
// level that may be near, down to what is small or far enough. It keeps no stack: of a part's place
// follows which is next.
//
// BD_PRINTED: as the paper has it.
// BD_GLOSSY: also what the whole BRDF reflects of it beyond base colour / pi times the irradiance.
#include "common/array.glsl"
#include "kernel/all_channels.h"
#include "kernel/brdf.h"
#include "kernel/residual.h"
#include "shared/bindings.h"
#include "shared/screen.h"

layout(local_size_x = 8, local_size_y = 8) in;
layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_screen_args args; };
BD_ARRAY(screen_parts, BD_UNIT_SCREEN_PARTS);
BD_ARRAY(screen_patches, BD_UNIT_SCREEN_PATCHES);
BD_ARRAY(screen_receivers, BD_UNIT_SCREEN_RECEIVERS);
layout(std430, binding = BD_STORAGE_SCREEN_BOUNDS) readonly buffer bounds_block { uvec4 bounds[]; };
layout(std430, binding = BD_STORAGE_SCREEN_LIGHT) writeonly buffer light_block { vec4 light[]; };
#ifdef BD_GLOSSY
BD_ARRAY(screen_surfaces, BD_UNIT_SCREEN_SURFACES);
layout(std430, binding = BD_STORAGE_SCREEN_LOBES) writeonly buffer lobe_block { vec4 lobes[]; };
#endif

struct receiver {
    vec3 place, normal, normal_geometric;
};

// rgb = irradiance, a = what it would be of a radiance of 1; and how many parts were looked at.
vec4 sum = vec4(0.0);
float looked = 0.0;

#ifdef BD_GLOSSY
struct surface {
    vec4 viewer_lobe, color_metallic;
    vec2 roughness_f0;
};
surface own = surface(vec4(0.0), vec4(0.0), vec2(0.0));
vec4 lobe = vec4(0.0);
#endif

// What a part at that place gives, of a radiance of 1.
void add(receiver r, vec3 to, vec3 radiance, float share)
{
    sum += vec4(radiance, 1.0) * share;
#ifdef BD_GLOSSY
    if (own.viewer_lobe.w == 0.0 || share == 0.0) return;
    vec3 l = f3_scale(to, 1.0 / sqrt(max(dot(to, to), 1e-24)));
    float over_sr = share / max(dot(r.normal, l), 1e-3);
    vec3 beyond =
        beyond_diffuse(own.color_metallic.rgb, own.color_metallic.a, roughness_over(own.roughness_f0.x, over_sr),
                       own.roughness_f0.y, r.normal, l, own.viewer_lobe.xyz);
    share *= own.viewer_lobe.w;
    lobe += vec4(radiance * beyond, strongest_channel(beyond)) * share;
#endif
}

void add_patch(receiver r, vec3 to, uint pixel, float area, vec3 radiance)
{
    vec4 u = BD_LOAD(screen_patches, pixel * BD_SCREEN_PATCH_VEC4S);
    vec3 v = BD_LOAD(screen_patches, pixel * BD_SCREEN_PATCH_VEC4S + 1u).xyz;
    uint parts = parts_of_side(area, args.clamp);
    float share = 1.0 / float(parts);
    for (uint i = 0u; i < parts * parts; i++) {
        vec3 to_part = to + u.xyz * middle_of_part(i % parts, parts) + v * middle_of_part(i / parts, parts);
        add(r, to_part, radiance, residual_patch(r.normal, r.normal_geometric, to_part, u.xyz * share, v * share, u.w,
                                                 area * share * share, args.clamp));
    }
}

// Adds a part; or nothing, and true, where it is to be looked at closer.
bool look(receiver r, uint level, uvec2 at)
{
    uint index = args.levels[level].z + at.y * args.levels[level].x + at.x;
    vec4 middle = BD_LOAD(screen_parts, index * BD_SCREEN_PART_VEC4S);
    vec4 normal = BD_LOAD(screen_parts, index * BD_SCREEN_PART_VEC4S + 1u);
    vec4 radiance = BD_LOAD(screen_parts, index * BD_SCREEN_PART_VEC4S + 2u);
    vec3 to = middle.xyz - r.place;
    float r2 = dot(to, to), area = middle.w;
    if (area == 0.0) return false;
    looked += 1.0;
#ifdef BD_PRINTED
    float most = most_as_printed(r.normal, to, r2, normal.xyz);
    bool is_near = false;
#else
    float most = most_of_part(r.normal, to, r2, normal.xyz, normal.w, radiance.w);
    if (!(most > args.clamp)) return false;
    bool is_near = r2 < NEAR_PIXELS * area;
#endif
    float threshold = spans_edge(normal.w, radiance.w) ? args.edge_sr : args.smooth_sr;
    if (level > 0u && most * area > threshold) return true;
    if (level == 0u && is_near)
        add_patch(r, to, index, area, radiance.rgb);
    else
        add(r, to, radiance.rgb, residual_light(r.normal, r.normal_geometric, to, r2, normal.xyz, area, args.clamp));
    return false;
}

bool is_in(uint level, uvec2 at) { return at.x < args.levels[level].x && at.y < args.levels[level].y; }

// The part behind this one and all below it, of those under one of the coarsest level; false at the
// end. Four siblings are rows of two.
bool next(inout uint level, inout uvec2 at)
{
    uint top = args.level_count - 1u;
    while (level < top) {
        bool is_right = (at.x & 1u) != 0u, is_low = (at.y & 1u) != 0u;
        if (is_right && is_low) {
            at >>= 1u;
            level++;
            continue;
        }
        at = is_right ? uvec2(at.x - 1u, at.y + 1u) : uvec2(at.x + 1u, at.y);
        if (is_in(level, at)) return true;
    }
    return false;
}

void walk(receiver r, uvec2 root)
{
    uint level = args.level_count - 1u;
    uvec2 at = root;
    bool goes_on = true;
    while (goes_on) {
        if (look(r, level, at)) {
            level--;
            at <<= 1u;
        } else {
            goes_on = next(level, at);
        }
    }
}

void main()
{
    uvec2 pixel = gl_GlobalInvocationID.xy + uvec2(0u, args.first_row);
    if (pixel.x >= args.width_px || gl_GlobalInvocationID.y >= args.row_count) return;
    uint index = pixel.y * args.width_px + pixel.x;
    vec4 place = BD_LOAD(screen_receivers, index * BD_SCREEN_RECEIVER_VEC4S);
    receiver r = receiver(place.xyz, BD_LOAD(screen_receivers, index * BD_SCREEN_RECEIVER_VEC4S + 1u).xyz,
                          BD_LOAD(screen_receivers, index * BD_SCREEN_RECEIVER_VEC4S + 2u).xyz);
    uint across = (args.width_px + BD_SCREEN_BLOCK_SIDE - 1u) / BD_SCREEN_BLOCK_SIDE;
    uvec4 bound = bounds[pixel.y / BD_SCREEN_BLOCK_SIDE * across + pixel.x / BD_SCREEN_BLOCK_SIDE];
#ifdef BD_GLOSSY
    own = surface(BD_LOAD(screen_surfaces, index * BD_SCREEN_SURFACE_VEC4S),
                  BD_LOAD(screen_surfaces, index * BD_SCREEN_SURFACE_VEC4S + 1u),
                  BD_LOAD(screen_surfaces, index * BD_SCREEN_SURFACE_VEC4S + 2u).xy);
#endif
    if (place.w > 0.0)
        for (uint y = bound.y; y < bound.w; y++)
            for (uint x = bound.x; x < bound.z; x++) walk(r, uvec2(x, y));
#ifndef BD_PRINTED
    float part = part_of_hemisphere(sum.a);
    sum.rgb *= part;
#ifdef BD_GLOSSY
    lobe.rgb *= part * part_of_lobe(lobe.a);
#endif
#endif
    light[index] = vec4(sum.rgb, looked);
#ifdef BD_GLOSSY
    lobes[index] = vec4(lobe.rgb, 0.0);
#endif
}
