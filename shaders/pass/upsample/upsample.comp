// Light at fragments, from one level to the next finer one (algorithms.md A1, Upsampling).
//
// A block in a fragment above its own level takes the weighted mean of what lies around it at that
// level, by the paper's tent (1 2 1) x (1 2 1) over the 3 x 3 blocks around it: fragments of this
// level, and children of the level above. Four children of a parent share its value, so those count
// together, at the parent's own centre: with all parents there, this is bilinear interpolation.
//
// What departs from the paper, each for a smaller error where light changes smoothly:
// a fragment keeps its own; where some of the parents are missing the rest lies to one side, and its
// mean with it, so the weights are tilted by least squares, that light which changes linearly over
// the picture is kept as it is; and where a parent has both neighbours, their second difference
// takes back what a straight line cuts off.
//
// BD_FINE: level 0, into `irradiance`. BD_DETAIL: BD_DETAIL_* of shared/upsample.h.
#include "common/blocks.glsl"
#include "common/luminance.glsl"
#include "common/one_surface.glsl"
#include "shared/upsample.h"

layout(local_size_x = 8, local_size_y = 8) in;
layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_upsample_args args; };
layout(binding = BD_UNIT_BLOCK_REPRESENTATIVE) uniform usampler2D representative;
layout(binding = 1, rgba32f) uniform image2D coarse;
#if BD_DETAIL == BD_DETAIL_DIRECTION
layout(binding = 3, rgba32f) uniform image2D coarse_vector;
#endif
#ifdef BD_FINE
layout(binding = 0, rgba32f) writeonly uniform image2D irradiance;
layout(binding = BD_UNIT_FINE) uniform sampler2D fine;
#if BD_DETAIL == BD_DETAIL_DIRECTION
layout(binding = BD_UNIT_FINE_VECTOR) uniform sampler2D fine_vector;
#endif
#endif

// In alpha: black is data. Only a fragment's own light has all of it, so that what another
// invocation writes beside it is never taken for that.
const float GATHERED = 1.0;
const float INTERPOLATED = 0.5;

struct light {
    vec3 irradiance, vector;
    float state;
};

light stacked_light(uint level, ivec2 block)
{
    ivec2 at = in_stack(level, block);
    vec4 e = imageLoad(coarse, at);
    light l = light(e.rgb, vec3(0.0), e.a);
#if BD_DETAIL == BD_DETAIL_DIRECTION
    l.vector = imageLoad(coarse_vector, at).xyz;
#endif
    return l;
}

light light_of_level(uint level, ivec2 block)
{
#ifdef BD_FINE
    vec4 e = texelFetch(fine, block, 0);
    light l = light(e.rgb, vec3(0.0), e.a);
#if BD_DETAIL == BD_DETAIL_DIRECTION
    l.vector = texelFetch(fine_vector, block, 0).xyz;
#endif
    return l;
#else
    return stacked_light(level, block);
#endif
}

// --- which blocks are one surface -------------------------------------------------------------

receiver receiver_of(uint level, ivec2 block)
{
#ifdef BD_FINE
    if (level == 0u) return gbuffer_receiver(block);
#endif
    uint pixel = texelFetch(representative, in_stack(level, block), 0).x;
    return gbuffer_receiver(ivec2(BD_PIXEL_X(pixel), BD_PIXEL_Y(pixel)));
}

// --- the mean -----------------------------------------------------------------------------------

struct moments {
    vec2 origin; // px
    float scale; // 1 / px
    float weight;
    vec2 first;
    vec3 second; // xx, yy, xy
    vec3 e, e_x, e_y, least, most;
    vec3 v, v_x, v_y;
};

void take(inout moments m, float weight, vec2 at, light l)
{
    vec2 p = (at - m.origin) * m.scale;
    m.weight += weight;
    m.first += weight * p;
    m.second += weight * vec3(p * p, p.x * p.y);
    m.e += weight * l.irradiance;
    m.e_x += weight * p.x * l.irradiance;
    m.e_y += weight * p.y * l.irradiance;
    m.least = min(m.least, l.irradiance);
    m.most = max(m.most, l.irradiance);
    m.v += weight * l.vector;
    m.v_x += weight * p.x * l.vector;
    m.v_y += weight * p.y * l.vector;
}

// Part of a unit's variance that keeps the least squares regular where all lies on one line.
const float RIDGE = 0.02;

// Value at the origin of the plane that fits best.
light fitted(moments m)
{
    vec2 mean = m.first / m.weight;
    vec3 second = m.second / m.weight;
    float xx = second.x - mean.x * mean.x + RIDGE, yy = second.y - mean.y * mean.y + RIDGE;
    float xy = second.z - mean.x * mean.y;
    // Slope against position, solved for the way back from the mean position to the origin.
    vec2 back = vec2(yy * mean.x - xy * mean.y, xx * mean.y - xy * mean.x) / (xx * yy - xy * xy);
    float centre = (1.0 + dot(back, mean)) / m.weight;
    vec2 tilt = back / m.weight;
    vec3 e = centre * m.e - tilt.x * m.e_x - tilt.y * m.e_y;
    vec3 v = centre * m.v - tilt.x * m.v_x - tilt.y * m.v_y;
    return light(e, v, INTERPOLATED);
}

// --- a block ------------------------------------------------------------------------------------

bool exists(uint level, ivec2 block)
{
    return all(greaterThanEqual(block, ivec2(0))) && all(lessThan(block, blocks_of_level(level)));
}

// Blocks of this level that lie in a parent without light, by their bit in `missing`, with their
// weights in the tent.
void take_children(inout moments m, uint level, ivec2 block, ivec2 side, receiver here, uint missing)
{
    const ivec2 steps[5] = ivec2[5](ivec2(1, 0), ivec2(1, -1), ivec2(0, 1), ivec2(-1, 1), ivec2(1, 1));
    while (missing != 0u) {
        int i = findLSB(missing);
        missing &= missing - 1u;
        ivec2 child = block + steps[i] * side;
        if (!exists(level, child)) continue;
        light l = light_of_level(level, child);
        if (l.state != GATHERED || !is_one_surface(here, receiver_of(level, child))) continue;
        take(m, i == 0 || i == 2 ? 2.0 : 1.0, centre_of_block(level, child), l);
    }
}

// Between a block's centre and a quarter of its side from there, a straight line through it and its
// neighbour is off by this part of the second difference.
const float CURVATURE = 3.0 / 32.0;

void bend(inout light l, light before, light home, light after)
{
    l.irradiance -= CURVATURE * (before.irradiance - 2.0 * home.irradiance + after.irradiance);
    l.vector -= CURVATURE * (before.vector - 2.0 * home.vector + after.vector);
}

// Of the level above: with data, and of the surface that is here. state 0: no data; below 0: of
// another surface.
light neighbour(uint level, ivec2 parent, receiver here)
{
    light l = light(vec3(0.0), vec3(0.0), -1.0);
    if (!exists(level + 1u, parent)) return l;
    l = stacked_light(level + 1u, parent);
    if (l.state > 0.0 && !is_one_surface(here, receiver_of(level + 1u, parent))) l.state = -1.0;
    return l;
}

// Whether a block's parent lies in the middle of its neighbours: not where the picture's edge cuts
// one.
bool is_between(uint level, ivec2 block, ivec2 step)
{
    ivec2 parent = block >> 1;
    vec2 sum = centre_of_block(level + 1u, parent + step) + centre_of_block(level + 1u, parent - step);
    return distance(0.5 * sum, centre_of_block(level + 1u, parent)) < 0.25;
}

light interpolated(uint level, ivec2 block, light home)
{
    const ivec2 steps[3] = ivec2[3](ivec2(1, 0), ivec2(0, 1), ivec2(1, 1));
    const float weights[3] = float[3](3.0, 3.0, 1.0);
    const uint children[3] = uint[3](0x3u, 0xcu, 0x10u);
    ivec2 side = (block & 1) * 2 - 1;
    receiver here = receiver_of(level, block);
    moments m;
    m.origin = centre_of_block(level, block);
    m.scale = exp2(-float(level));
    m.weight = 0.0;
    m.first = vec2(0.0);
    m.second = m.e = m.e_x = m.e_y = m.v = m.v_x = m.v_y = vec3(0.0);
    m.least = vec3(3e38);
    m.most = vec3(-3e38);
    bool at_home = is_one_surface(here, receiver_of(level + 1u, block >> 1));
    if (at_home) take(m, 9.0, centre_of_block(level + 1u, block >> 1), home);
    uint missing = 0u;
    light beside[3];
    for (int i = 0; i < 3; i++) {
        ivec2 parent = (block >> 1) + steps[i] * side;
        beside[i] = neighbour(level, parent, here);
        if (beside[i].state == 0.0) missing |= children[i];
        if (beside[i].state > 0.0)
            take(m, weights[i], centre_of_block(level + 1u, parent), beside[i]);
    }
    take_children(m, level, block, side, here, missing);
    bool both[2];
    light opposite[2];
    for (int i = 0; i < 2; i++) {
        ivec2 parent = (block >> 1) - steps[i] * side;
        opposite[i] = neighbour(level, parent, here);
        both[i] = at_home && beside[i].state > 0.0 && opposite[i].state > 0.0 &&
                  is_between(level, block, steps[i]);
        // Only to go on beyond the outermost centre as on the way there.
        if (beside[i].state <= 0.0 && opposite[i].state > 0.0)
            take(m, 1.0, centre_of_block(level + 1u, parent), opposite[i]);
    }
    // Nothing here is of this surface: what shares a block with it comes nearest.
    if (m.weight == 0.0) take(m, 1.0, m.origin, home);
    light l = fitted(m);
    for (int i = 0; i < 2; i++)
        if (both[i]) bend(l, opposite[i], home, beside[i]);
    vec3 slack = 0.25 * (m.most - m.least);
    l.irradiance = clamp(l.irradiance, max(m.least - slack, vec3(0.0)), m.most + slack);
    return l;
}

vec3 with_detail(light l, receiver here)
{
#if BD_DETAIL == BD_DETAIL_DIRECTION
    float of_fragments = luminance(l.irradiance);
    float of_pixel = max(dot(l.vector, here.normal), 0.0);
    return of_fragments > 0.0 ? l.irradiance * min(of_pixel / of_fragments, 4.0) : vec3(0.0);
#elif BD_DETAIL == BD_DETAIL_PAPER
    const float ALPHA = 0.5;
    float cosine = max(dot(direction_to_viewer(here.relative_position), here.normal), 0.0);
    return l.irradiance * (ALPHA * cosine + 1.0 - ALPHA);
#else
    return l.irradiance;
#endif
}

void main()
{
    uint level = args.rows.x;
    ivec2 block = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, args.rows.y);
    if (gl_GlobalInvocationID.y >= args.rows.z || !exists(level, block)) return;
    light l = light_of_level(level, block);
    light home = light(vec3(0.0), vec3(0.0), 0.0);
    bool is_gathered = l.state == GATHERED;
    if (!is_gathered && level < coarsest_level()) home = stacked_light(level + 1u, block >> 1);
    if (home.state > 0.0) l = interpolated(level, block, home);
#ifdef BD_FINE
    receiver here = gbuffer_receiver(block);
    vec3 e = is_gathered && BD_DETAIL == BD_DETAIL_DIRECTION ? l.irradiance : with_detail(l, here);
    imageStore(irradiance, block, vec4(here.lit ? e : vec3(0.0), l.state));
#else
    if (home.state == 0.0) return;
    ivec2 at = in_stack(level, block);
    imageStore(coarse, at, vec4(l.irradiance, INTERPOLATED));
#if BD_DETAIL == BD_DETAIL_DIRECTION
    imageStore(coarse_vector, at, vec4(l.vector, 1.0));
#endif
#endif
}
