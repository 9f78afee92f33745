// Light at fragments, from one level to the next finer one (algorithms.md A1, Upsampling), at
// children of a list of parents.
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
// Where nothing is missing around a parent inner.comp does the same by fewer steps.
#include "common/blocks.glsl"
#include "pass/upsample/light.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = BD_STORAGE_OUTER_BLOCKS) readonly buffer outer_block { uint outer_blocks[]; };
layout(std430, binding = BD_STORAGE_OUTER_CHILDREN) readonly buffer children_block { uvec2 outer_children[]; };

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

// --- a child ------------------------------------------------------------------------------------

ivec2 side_of(ivec2 child) { return (child & 1) * 2 - 1; }

// Pixels.
vec2 centre_of_child(ivec2 child) { return centre_of_block(multires_number(args.level), child); }
vec2 centre_of_parent(ivec2 parent) { return centre_of_block(multires_number(args.above), parent); }

// Fragments of the child's own level, by BD_SURFACES_CELLS.
void take_cells(inout moments m, ivec2 child, uint cells)
{
    const ivec2 steps[5] = ivec2[5](ivec2(1, 0), ivec2(0, 1), ivec2(1, 1), ivec2(1, -1), ivec2(-1, 1));
    while (cells != 0u) {
        int i = findLSB(cells);
        cells &= cells - 1u;
        ivec2 at = child + steps[i] * side_of(child);
        take(m, i < 2 ? 2.0 : 1.0, centre_of_child(at), light_of_child(at));
    }
}

// Whether a parent lies in the middle of its neighbours: not where the picture's edge cuts one.
bool is_between(ivec2 parent, ivec2 step)
{
    vec2 sum = centre_of_parent(parent + step) + centre_of_parent(parent - step);
    return distance(0.5 * sum, centre_of_parent(parent)) < 0.25;
}

moments moments_around(ivec2 child)
{
    moments m;
    m.origin = centre_of_child(child);
    m.scale = exp2(-float(multires_number(args.level)));
    m.weight = 0.0;
    m.first = vec2(0.0);
    m.second = m.e = m.e_x = m.e_y = m.v = m.v_x = m.v_y = vec3(0.0);
    m.least = vec3(3e38);
    m.most = vec3(-3e38);
    return m;
}

// `bits` are those of BD_SURFACES_CHILD.
light outer_child(ivec2 child, uint bits, uint cells)
{
    const ivec2 steps[3] = ivec2[3](ivec2(1, 0), ivec2(0, 1), ivec2(1, 1));
    const float weights[3] = float[3](3.0, 3.0, 1.0);
    ivec2 parent = child >> 1, side = side_of(child);
    light home = stacked_light(args.above, parent);
    bool at_home = (bits & BD_SURFACES_HOME) != 0u;
    moments m = moments_around(child);
    if (at_home) take(m, 9.0, centre_of_parent(parent), home);
    light beside[3];
    for (int i = 0; i < 3; i++) {
        ivec2 at = parent + steps[i] * side;
        beside[i] = stacked_light(args.above, at);
        if ((bits & BD_SURFACES_BESIDE(i)) != 0u)
            take(m, weights[i], centre_of_parent(at), beside[i]);
    }
    take_cells(m, child, cells);
    light opposite[2];
    for (int i = 0; i < 2; i++) {
        ivec2 at = parent - steps[i] * side;
        opposite[i] = stacked_light(args.above, at);
        // Only to go on beyond the outermost centre as on the way there.
        if ((bits & BD_SURFACES_OPPOSITE(i)) != 0u && (bits & BD_SURFACES_BESIDE(i)) == 0u)
            take(m, 1.0, centre_of_parent(at), opposite[i]);
    }
    // Nothing is of its surface: what shares a block with it comes nearest.
    if (m.weight == 0.0) take(m, 1.0, m.origin, home);
    light l = fitted(m);
    for (int i = 0; i < 2; i++) {
        uint both = BD_SURFACES_BESIDE(i) | BD_SURFACES_OPPOSITE(i) | BD_SURFACES_HOME;
        if ((bits & both) == both && is_between(parent, steps[i]))
            bend(l, opposite[i], home, beside[i]);
    }
    vec3 slack = 0.25 * (m.most - m.least);
    l.irradiance = clamp(l.irradiance, max(m.least - slack, vec3(0.0)), m.most + slack);
    return l;
}

void main()
{
    if (gl_GlobalInvocationID.x >= args.item_count) return;
    uint place = args.first_item + gl_GlobalInvocationID.x, packed_parent = outer_blocks[args.first_outer + place];
    ivec2 parent = ivec2(BD_PIXEL_X(packed_parent), BD_PIXEL_Y(packed_parent));
    uvec2 children = outer_children[args.first_children + place];
    for (int i = 0; i < 4; i++) {
        ivec2 child = 2 * parent + ivec2(i & 1, i >> 1);
        if (BD_SURFACES_LIT(children.x, i) == 0u || is_fragment(child)) continue;
        uint bits = BD_SURFACES_CHILD(children.x, i), cells = BD_SURFACES_CELLS(children.y, i);
        store(child, outer_child(child, bits, cells));
    }
}
