// One list of subsplats: what each VPL's glossy lobe sends to the viewer from four points of a block
// says whether the block will do for that VPL (Nichols and Wyman 2010; algorithms.md A1, per-VPL
// refinement). If so the lobe over the block is the plane through the four, added to the
// multiresolution image; if not, the block's children are in the VPL's next list.
//
// A block is in one list of a batch only, so each sum has one writer and one order.
#include "common/vpl_gather.glsl"
#include "pass/subsplats/lists.glsl"

layout(binding = BD_UNIT_ALL_IRRADIANCE) uniform sampler2D all_irradiance;
layout(std430, binding = BD_STORAGE_SUBSPLATS) readonly buffer block_block { uint blocks[]; };
layout(std430, binding = BD_STORAGE_SUBSPLAT_MASKS) readonly buffer mask_block { uint masks[]; };
layout(std430, binding = BD_STORAGE_SPLIT_MASKS) buffer split_block { uint split_masks[]; };
layout(std430, binding = BD_STORAGE_SUBSPLAT_SCAN) writeonly buffer scan_block { uint sums_of[]; };
layout(std430, binding = BD_STORAGE_SUBSPLAT_COUNTS) buffer count_block { bd_subsplats_counts counts; };
layout(binding = BD_IMAGE_GLOSSY_FINE, rgba32f) uniform image2D fine;
layout(binding = BD_IMAGE_GLOSSY_COARSE, rgba32f) uniform image2D coarse;
layout(binding = BD_IMAGE_GLOSSY_SLOPE_X, rgba32f) uniform image2D slope_x;
layout(binding = BD_IMAGE_GLOSSY_SLOPE_Y, rgba32f) uniform image2D slope_y;

struct point {
    receiver surface;
    vec3 viewer;
};

struct points {
    point a, b, c, d;  // by rows; only the first of a pixel
    uint others;       // 1; 0 of a pixel
    vec2 distance_px;  // between the left and the right ones, the upper and the lower ones
    float irradiance;  // of all VPLs, the largest there
};

point point_at(ivec2 pixel, inout float irradiance)
{
    vec3 e = texelFetch(all_irradiance, pixel, 0).rgb;
    irradiance = max(irradiance, max(e.x, max(e.y, e.z)));
    receiver r = gbuffer_receiver(pixel);
    return point(r, direction_to_viewer(r.relative_position));
}

// The four lie where two points would integrate a cubic, as near as pixels allow.
points points_of(uint level, ivec2 block)
{
    ivec4 pixels = pixels_of_block(level, block);
    ivec2 inset = max((pixels.zw - pixels.xy + 1) / 4, 1) - 1;
    ivec2 low = min(pixels.xy + inset, pixels.zw), high = max(pixels.zw - inset, pixels.xy);
    points p;
    p.irradiance = 0.0;
    p.a = point_at(low, p.irradiance);
    p.b = point_at(ivec2(high.x, low.y), p.irradiance);
    p.c = point_at(ivec2(low.x, high.y), p.irradiance);
    p.d = point_at(high, p.irradiance);
    p.others = level == 0u ? 0u : 1u;
    p.distance_px = vec2(high - low);
    return p;
}

// What a VPL's lobe sends from the four.
struct lobe {
    vec3 a, b, c, d;
};

// False where one of them is so near that the VPL must be integrated as a patch.
bool far_lobe(points p, uint index, out lobe l)
{
    virtual_light vpl = vpl_at(index);
    sums a = no_light(), b = no_light(), c = no_light(), d = no_light();
    bool far = add_far(a, p.a.surface, p.a.viewer, vpl);
    // A loop where a branch would do: the software device runs both sides of those.
    for (uint i = 0u; i < p.others; i++) {
        far = add_far(b, p.b.surface, p.b.viewer, vpl) && far;
        far = add_far(c, p.c.surface, p.c.viewer, vpl) && far;
        far = add_far(d, p.d.surface, p.d.viewer, vpl) && far;
    }
    bool alone = p.others == 0u;
    l = lobe(a.glossy, alone ? a.glossy : b.glossy, alone ? a.glossy : c.glossy,
             alone ? a.glossy : d.glossy);
    return far;
}

// What the lists' VPLs leave at a block.
struct left {
    vec3 mean, right_left, down_up;
    uint drawn;
};

float largest_of(vec3 v) { return max(v.x, max(v.y, v.z)); }

// Adds the lobe, unless the block is to be split: then true.
bool draw(inout left sum, points p, lobe l, bool counts_now)
{
    vec3 least = min(min(l.a, l.b), min(l.c, l.d)), most = max(max(l.a, l.b), max(l.c, l.d));
    float largest = largest_of(max(abs(least), abs(most)));
    float limit = args.threshold_absolute + args.threshold_relative * (largest + args.of_mean_vpl * p.irradiance);
    bool split = p.others != 0u && largest_of(most - least) > limit;
    float weight = counts_now && !split ? 1.0 : 0.0;
    sum.mean += 0.25 * weight * ((l.a + l.b) + (l.c + l.d));
    sum.right_left += 0.5 * weight * ((l.b - l.a) + (l.d - l.c));
    sum.down_up += 0.5 * weight * ((l.c - l.a) + (l.d - l.b));
    sum.drawn += uint(weight);
    return split;
}

#ifdef BD_VPL_PATCH
point chosen(points p, uint index)
{
    if (index == 0u) return p.a;
    if (index == 1u) return p.b;
    return index == 2u ? p.c : p.d;
}

// In one loop over the points, for the sake of its length: few VPLs are near.
lobe near_lobe(points p, uint vpl)
{
    lobe l = lobe(vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
    for (uint i = 0u; i < 4u; i++) {
        point at = chosen(p, i);
        sums s = no_light();
        gather_block(s, at.surface, at.viewer, vpl, vpl + 1u);
        l.a = i == 0u ? s.glossy : l.a;
        l.b = i == 1u ? s.glossy : l.b;
        l.c = i == 2u ? s.glossy : l.c;
        l.d = i == 3u ? s.glossy : l.d;
    }
    return l;
}
#endif

// The VPLs of a word, the near ones after the others, as gathers do (common/vpl_gather.glsl): a loop
// over one VPL around the patch's formula is no loop to the compiler, and would run for every VPL.
// Returns those that want the block's children.
uint draw_word(inout left sum, points p, uint first_vpl, uint mask)
{
    uint split = 0u, near = 0u;
    while (mask != 0u) {
        uint bit = uint(findLSB(mask));
        mask &= mask - 1u;
        lobe l;
        bool far = far_lobe(p, first_vpl + bit, l);
        bool again = draw(sum, p, l, far);
        near |= far ? 0u : 1u << bit;
        split |= far && again ? 1u << bit : 0u;
    }
#ifdef BD_VPL_PATCH
    while (near != 0u) {
        uint bit = uint(findLSB(near));
        near &= near - 1u;
        split |= draw(sum, p, near_lobe(p, first_vpl + bit), true) ? 1u << bit : 0u;
    }
#endif
    return split;
}

uint mask_of_word(uint at, uint word)
{
    if (args.members == BD_SUBSPLAT_MASKED) return masks[at * BD_SUBSPLAT_WORDS + word];
    if (args.members == BD_SUBSPLAT_LEFT_OVER) return split_masks[at * BD_SUBSPLAT_WORDS + word];
    uint first = 32u * word, count = args.vpl_count > first ? min(args.vpl_count - first, 32u) : 0u;
    return count == 32u ? ~0u : (1u << count) - 1u;
}

// Adds to the image. The fourth channel counts VPLs: each pixel gets all of them once.
void add_to_image(uint level, ivec2 block, points p, left sum)
{
    vec4 mean = vec4(sum.mean, float(sum.drawn));
    if (level == 0u) {
        imageStore(fine, block, imageLoad(fine, block) + mean);
        return;
    }
    vec4 per_px = vec4(1.0 / max(p.distance_px, vec2(1.0)), 0.0, 0.0);
    ivec2 at = in_stack(level, block);
    imageStore(coarse, at, imageLoad(coarse, at) + mean);
    imageStore(slope_x, at, imageLoad(slope_x, at) + vec4(sum.right_left * per_px.x, 0.0));
    imageStore(slope_y, at, imageLoad(slope_y, at) + vec4(sum.down_up * per_px.y, 0.0));
}

void main()
{
    uint at = args.first_block + gl_GlobalInvocationID.x;
    if (at >= args.end_block) return;
    uint code = blocks[args.list_first_block + at], level = BD_FRAGMENT_LEVEL(code);
    ivec2 block = ivec2(BD_FRAGMENT_X(code), BD_FRAGMENT_Y(code));
    points p = points_of(level, block);
    left sum = left(vec3(0.0), vec3(0.0), vec3(0.0), 0u);
    uint split_count = 0u;
    for (uint word = 0u; word < BD_SUBSPLAT_WORDS; word++) {
        uint split = draw_word(sum, p, args.first_vpl + 32u * word, mask_of_word(at, word));
        split_masks[at * BD_SUBSPLAT_WORDS + word] = split;
        split_count += uint(bitCount(split));
    }
    sums_of[at] = split_count > 0u ? child_count(level, block) : 0u;
    bool left_over = args.members == BD_SUBSPLAT_LEFT_OVER; // counted before, as if they were split
    atomicAdd(counts.tested, left_over ? 0u : sum.drawn + split_count);
    atomicAdd(counts.split, left_over ? 0u - sum.drawn : split_count);
    atomicAdd(counts.drawn, sum.drawn);
    if (sum.drawn > 0u) add_to_image(level, block, p, sum);
}
