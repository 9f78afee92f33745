// Level 1: what 2 x 2 pixels measure, their own test, and which of them stands for all: they are equally
// near to the centre, so the first that can be lit.
//
// Slopes, chords and steps are between neighbours, whichever block they are in: a jump between two blocks
// belongs to both.
#include "common/seen_surface.glsl"
#include "pass/discontinuity/measures.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = BD_IMAGE_WORDS, r32ui) writeonly uniform uimage2D words;
layout(binding = BD_IMAGE_REPRESENTATIVES, r32ui) writeonly uniform uimage2D representative;

struct seen {
    bool lit;
    float depth;
    vec3 normal;
};

bool in_picture(ivec2 pixel)
{
    return all(greaterThanEqual(pixel, ivec2(0))) &&
           multires_has(args.multires.levels[0], uvec2(pixel));
}

seen look(ivec2 pixel)
{
    seen s = seen(false, 0.0, vec3(0.0));
    if (!in_picture(pixel)) return s;
    s.lit = seen_lit(pixel, args.face);
#if BD_DEPTH_TEST != BD_TEST_NONE
    s.depth = seen_depth(pixel, args.face);
#endif
#if BD_NORMAL_TEST != BD_TEST_NONE
    s.normal = seen_normal(pixel, args.face);
#endif
    return s;
}

void add_pixel(inout measures m, seen s)
{
#if BD_DEPTH_TEST == BD_TEST_RANGE
    m.depth = max(m.depth, vec2(s.depth, -s.depth));
#endif
#if BD_NORMAL_TEST == BD_TEST_RANGE
    m.normal = max(m.normal, s.normal);
    m.normal_least = max(m.normal_least, -s.normal);
#endif
}

#if BD_DEPTH_TEST == BD_TEST_JUMP || BD_DEPTH_TEST == BD_TEST_STEP || BD_NORMAL_TEST == BD_TEST_JUMP
#define BETWEEN_PIXELS
#endif

#ifdef BETWEEN_PIXELS
// x = difference of depth, y = chord; nothing to what cannot be lit. The chord is a distance: 2
// sin(acos(dot) / 2), the same on paper, is 0 below 3e-4 rad in 32 bits.
vec2 jump_between(seen a, seen b)
{
    vec2 jump = vec2(abs(a.depth - b.depth), distance(a.normal, b.normal));
    return a.lit && b.lit ? jump : vec2(0.0);
}

#if BD_DEPTH_TEST == BD_TEST_STEP
// Over a plane 1 / z is affine in the picture, and z itself in an orthographic one. So this is 0 there,
// and the relative difference of depth where it jumps; nothing beside what cannot be lit.
float step_between(seen s, seen sides[2])
{
    if (!sides[0].lit || !sides[1].lit) return 0.0;
    float near = s.depth / sides[0].depth, far = s.depth / sides[1].depth;
    if (args.depth_scale > 0.0) {
        near = (sides[0].depth - s.depth) / args.depth_scale;
        far = (sides[1].depth - s.depth) / args.depth_scale;
        return abs(near + far);
    }
    return abs(near + far - 2.0);
}
#endif

// The derivative along an axis is the larger of the two one-sided ones.
void add_jumps(inout measures m, seen s, seen left_right[2], seen up_down[2])
{
    vec2 along_x = max(jump_between(s, left_right[0]), jump_between(s, left_right[1]));
    vec2 along_y = max(jump_between(s, up_down[0]), jump_between(s, up_down[1]));
#if BD_DEPTH_TEST == BD_TEST_JUMP
    float slope = length(vec2(along_x.x, along_y.x)) / (args.depth_scale > 0.0 ? args.depth_scale : s.depth);
    m.depth = max(m.depth, slope);
#endif
#if BD_DEPTH_TEST == BD_TEST_STEP
    m.depth = max(m.depth, max(step_between(s, left_right), step_between(s, up_down)));
#endif
#if BD_NORMAL_TEST == BD_TEST_JUMP
    m.normal = max(m.normal, max(along_x.y, along_y.y));
#endif
}
#endif

void main()
{
    uvec2 block = gl_GlobalInvocationID.xy + uvec2(0u, args.first_row);
    if (gl_GlobalInvocationID.y >= args.row_count || !multires_has(args.multires.levels[1], block))
        return;
    ivec2 first = 2 * ivec2(block);
    seen inner[4];
    for (int i = 0; i < 4; i++) inner[i] = look(first + ivec2(i & 1, i >> 1));
    measures m = MEASURES_OF_NOTHING;
    uint word = 0u, pixel_of_block = ~0u;
    for (int i = 0; i < 4; i++) {
        ivec2 pixel = first + ivec2(i & 1, i >> 1);
        if (in_picture(pixel)) word |= inner[i].lit ? BD_BLOCK_WITH_CHILD(i) : BD_BLOCK_HAS_UNLIT;
        if (!inner[i].lit) continue;
        pixel_of_block = min(pixel_of_block, BD_PIXEL_PACK(uint(pixel.x), uint(pixel.y)));
        add_pixel(m, inner[i]);
#ifdef BETWEEN_PIXELS
        // One neighbour along each axis is in the block, the other beyond it.
        seen left_right[2] = seen[2](inner[i ^ 1], look(pixel + ivec2(2 * (i & 1) - 1, 0)));
        seen up_down[2] = seen[2](inner[i ^ 2], look(pixel + ivec2(0, 2 * (i >> 1) - 1)));
        add_jumps(m, inner[i], left_right, up_down);
#endif
    }
    ivec2 texel = multires_texel(args.multires.levels[1], block);
    store_measures(block, m);
    imageStore(words, texel, uvec4(word | own_kind(m, word)));
    imageStore(representative, texel, uvec4(pixel_of_block));
}
