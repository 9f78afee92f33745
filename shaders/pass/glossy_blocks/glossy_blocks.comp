// Which blocks hold glossy receivers, and whether those are one surface of one material: what the
// lobe of a VPL over the block depends on beside the places in it. From the finest level up.
//
// A number of a surface is kept in 8 bits. BD_PIXELS: level 1, from the G-buffer.
#include "common/blocks.glsl"
#include "common/gbuffer.glsl"
#include "shared/glossy_blocks.h"

layout(local_size_x = 8, local_size_y = 8) in;
layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_glossy_blocks_args args; };
layout(binding = BD_UNIT_BLOCK_FLAGS) uniform usampler2D shared_flags;
layout(binding = BD_IMAGE_GLOSSY_FLAGS, r32ui) uniform uimage2D flags;
layout(binding = BD_IMAGE_SURFACE_LEAST, rgba32ui) uniform uimage2D least;
layout(binding = BD_IMAGE_SURFACE_MOST, rgba32ui) uniform uimage2D most;

struct surface {
    vec4 normal_f0; // in [0, 1]
    vec4 color_roughness;
    float metallic;
};

struct child {
    uint flag;
    surface least, most;
};

surface surface_of(uvec4 p)
{
    return surface(unpackUnorm4x8(p.x), unpackUnorm4x8(p.y), unpackUnorm4x8(p.z).x);
}

uvec4 code_of(surface s)
{
    return uvec4(packUnorm4x8(s.normal_f0), packUnorm4x8(s.color_roughness),
                 packUnorm4x8(vec4(s.metallic, 0.0, 0.0, 0.0)), 0u);
}

#ifdef BD_PIXELS
child look(uint level, ivec2 pixel)
{
    receiver r = gbuffer_receiver(pixel);
    child c;
    c.flag = r.lit && has_glossy_lobe(r.metallic, r.roughness) ? BD_BLOCK_SMOOTH : BD_BLOCK_EMPTY;
    c.least = c.most = surface(vec4(0.5 * r.normal + 0.5, r.f0_dielectric),
                               vec4(r.base_color, r.roughness), r.metallic);
    return c;
}
#else
child look(uint level, ivec2 block)
{
    ivec2 at = in_stack(level, block);
    child c;
    c.flag = BD_BLOCK_KIND(imageLoad(flags, at).x);
    c.least = surface_of(imageLoad(least, at));
    c.most = surface_of(imageLoad(most, at));
    return c;
}
#endif

surface lower(surface a, surface b)
{
    return surface(min(a.normal_f0, b.normal_f0), min(a.color_roughness, b.color_roughness),
                   min(a.metallic, b.metallic));
}

surface higher(surface a, surface b)
{
    return surface(max(a.normal_f0, b.normal_f0), max(a.color_roughness, b.color_roughness),
                   max(a.metallic, b.metallic));
}

bool is_one(surface low, surface high)
{
    vec4 normal_f0 = high.normal_f0 - low.normal_f0;
    vec4 color_roughness = high.color_roughness - low.color_roughness;
    return all(lessThanEqual(2.0 * normal_f0.xyz, vec3(args.normal_threshold))) &&
           all(lessThanEqual(color_roughness, vec4(args.material_threshold))) &&
           max(normal_f0.w, high.metallic - low.metallic) <= args.material_threshold;
}

void main()
{
    uint level = args.level;
    ivec2 block = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, args.first_row);
    bool inside = level > 0u && gl_GlobalInvocationID.y < args.row_count &&
                  all(lessThan(block, blocks_of_level(level)));
    if (!inside) return;
    // The first child always exists; what lies beyond the picture is like it.
    child all_of = look(level - 1u, 2 * block);
    bool smooth_ones = all_of.flag == BD_BLOCK_SMOOTH, jump = all_of.flag == BD_BLOCK_DISCONTINUOUS;
    bool others = all_of.flag == BD_BLOCK_EMPTY;
    uint children = others ? 0u : BD_BLOCK_WITH_CHILD(0);
    for (int i = 1; i < 4; i++) {
        ivec2 at = 2 * block + ivec2(i & 1, i >> 1);
        if (any(greaterThanEqual(at, blocks_of_level(level - 1u)))) continue;
        child c = look(level - 1u, at);
        if (c.flag != BD_BLOCK_EMPTY) children |= BD_BLOCK_WITH_CHILD(i);
        all_of.least = lower(all_of.least, c.least);
        all_of.most = higher(all_of.most, c.most);
        smooth_ones = smooth_ones || c.flag == BD_BLOCK_SMOOTH;
        others = others || c.flag == BD_BLOCK_EMPTY;
        jump = jump || c.flag == BD_BLOCK_DISCONTINUOUS;
    }
    ivec2 at = in_stack(level, block);
    uint flag = BD_BLOCK_EMPTY;
    if (smooth_ones || jump) {
        bool whole = !jump && !others && is_one(all_of.least, all_of.most) &&
                     BD_BLOCK_KIND(texelFetch(shared_flags, at, 0).x) == BD_BLOCK_SMOOTH;
        flag = whole ? BD_BLOCK_SMOOTH : BD_BLOCK_DISCONTINUOUS;
    }
    imageStore(flags, at, uvec4(flag | children));
    imageStore(least, at, code_of(all_of.least));
    imageStore(most, at, code_of(all_of.most));
}
