// Level 1: what 2 x 2 pixels measure, and their own test.
//
// Slopes and chords are between neighbours, whichever block they are in: a jump between two blocks
// belongs to both.
#include "common/seen_surface.glsl"
#include "pass/discontinuity/measures.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = BD_IMAGE_OWN_TESTS, r32ui) writeonly uniform uimage2D own;

bool in_picture(ivec2 pixel)
{
    return all(greaterThanEqual(pixel, ivec2(0))) && 
           multires_has(args.multires.levels[0], uvec2(pixel));
}

#if BD_DEPTH_TEST == BD_TEST_JUMP || BD_NORMAL_TEST == BD_TEST_JUMP
const ivec2 NEIGHBOURS[4] = ivec2[4](ivec2(1, 0), ivec2(-1, 0), ivec2(0, 1), ivec2(0, -1));

// Jumps to the four neighbours. The derivative along an axis is the larger of the two one-sided ones.
void add_jumps(inout measures m, ivec2 pixel)
{
    float depth = seen_depth(pixel, args.slice.w), chord = 0.0;
    vec3 normal = seen_normal(pixel, args.slice.w);
    vec2 rise = vec2(0.0);
    for (int i = 0; i < 4; i++) {
        ivec2 other = pixel + NEIGHBOURS[i];
        if (!in_picture(other) || !seen_lit(other, args.slice.w)) continue;
#if BD_DEPTH_TEST == BD_TEST_JUMP
        rise = max(rise, abs(seen_depth(other, args.slice.w) - depth) * abs(vec2(NEIGHBOURS[i])));
#endif
#if BD_NORMAL_TEST == BD_TEST_JUMP
        // The chord itself: 2 sin(acos(dot) / 2) is 0 below 3e-4 rad in 32 bits.
        chord = max(chord, distance(seen_normal(other, args.slice.w), normal));
#endif
    }
#if BD_DEPTH_TEST == BD_TEST_JUMP
    m.depth = max(m.depth, length(rise) / (args.limits.z > 0.0 ? args.limits.z : depth));
#endif
#if BD_NORMAL_TEST == BD_TEST_JUMP
    m.normal = max(m.normal, chord);
#endif
}
#endif

void add_pixel(inout measures m, ivec2 pixel)
{
#if BD_DEPTH_TEST == BD_TEST_RANGE
    float depth = seen_depth(pixel, args.slice.w);
    m.depth = max(m.depth, vec2(depth, -depth));
#endif
#if BD_NORMAL_TEST == BD_TEST_RANGE
    vec3 normal = seen_normal(pixel, args.slice.w);
    m.normal = max(m.normal, normal);
    m.normal_least = max(m.normal_least, -normal);
#endif
#if BD_DEPTH_TEST == BD_TEST_JUMP || BD_NORMAL_TEST == BD_TEST_JUMP
    add_jumps(m, pixel);
#endif
}

void main()
{
    uvec2 block = gl_GlobalInvocationID.xy + uvec2(0u, args.slice.x);
    if (gl_GlobalInvocationID.y >= args.slice.y || !multires_has(args.multires.levels[1], block))
        return;
    measures m = MEASURES_OF_NOTHING;
    uint bits = 0u;
    for (int i = 0; i < 4; i++) {
        ivec2 pixel = ivec2(block) * 2 + ivec2(i & 1, i >> 1);
        if (!in_picture(pixel)) continue;
        bool lit = seen_lit(pixel, args.slice.w);
        bits |= lit ? BD_OWN_LIT : BD_OWN_UNLIT;
        if (lit) add_pixel(m, pixel);
    }
    store_measures(block, m);
    imageStore(own, multires_texel(args.multires.levels[1], block), uvec4(bits | own_test(m, bits)));
}
