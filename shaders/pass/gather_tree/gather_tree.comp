// Gather over a cut of a light's tree of VPLs, one cut a receiver (algorithms.md A2.4): a node
// stands for all leaves below it where the criterion says that it may.
//
// Depth first, in Morton order, without a stack: the place in the tree is a level and an index.
//
// A receiver visits only so many nodes in a round, and stops at a root's end: a software device ends
// loops that are too long. Where it is to go on is kept, and that somebody has not finished.
//
// image 0: irradiance, demodulated; image 1 (BD_GLOSSY): see common/vpl_gather.glsl.
// BD_PRINTED: Eqs. 1 to 6 of the paper, with their errors.
// BD_ESTIMATE: adds what the roots by themselves send to each receiver's estimate; no images.
// BD_FRAGMENTS: a receiver is a block of pixels of a list (images 0 and 1: level 0, the rest; with
// BD_VECTOR 2 and 3: the irradiance vector), else a pixel.
// BD_SPREAD: also how far off light that is interpolated over the block may be, in a of image 3.
#include "common/morton.glsl"
#include "common/vpl_gather.glsl"
#include "common/vpl_tree.glsl"
#include "shared/gather_tree.h"
#ifdef BD_FRAGMENTS
#include "common/block_receiver.glsl" // last: what it includes and others do is above
#endif

layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_gather_tree_args args; };
BD_ARRAY(nodes, BD_UNIT_TREE_NODES);
// Irradiance of each receiver, of all lights, by their trees' roots alone. Not improved on the way,
// and in whole steps, whose sum has no order: a cut must not depend on which light comes first.
layout(std430, binding = BD_STORAGE_ESTIMATES) buffer estimate_block { uint estimates[]; };
layout(std430, binding = BD_STORAGE_NEXT_ROOTS) buffer next_block {
    uint unfinished_round; // the last that somebody did not finish in
    uint next_roots[];     // of each receiver
};
#ifdef BD_FRAGMENTS
layout(local_size_x = 64) in;
layout(std430, binding = BD_STORAGE_FRAGMENTS) readonly buffer fragments_block { uint fragments[]; };
#else
layout(local_size_x = 8, local_size_y = 8) in;
#endif
#ifndef BD_ESTIMATE
layout(binding = 0, rgba32f) uniform image2D light_0;
#if defined(BD_FRAGMENTS) || defined(BD_GLOSSY)
layout(binding = 1, rgba32f) uniform image2D light_1;
#endif
#ifdef BD_VECTOR
layout(binding = 2, rgba32f) uniform image2D vector_0;
layout(binding = 3, rgba32f) uniform image2D vector_1;
#endif
#endif

// A place in the tree.
struct place {
    uint root;   // counted over all faces
    uint level;  // 0 = roots
    uint morton; // in the level, in the face
};

uint roots_of_face() { return args.tree.z * args.tree.z; }

place root_place(uint root)
{
    return place(root, 0u, root % roots_of_face());
}

// Index of a level's first node in a face.
uint level_first(uint level) { return roots_of_face() * ((1u << 2u * level) - 1u) / 3u; }

tree_node load_node(place p)
{
    uint face = p.root / roots_of_face();
    uint at = (face * level_first(args.tree.w) + level_first(p.level) + p.morton) *
              BD_TREE_NODE_VEC4S;
    return tree_node_of(BD_LOAD(nodes, at), BD_LOAD(nodes, at + 1u), BD_LOAD(nodes, at + 2u),
                        BD_LOAD(nodes, at + 3u), BD_LOAD(nodes, at + 4u), BD_LOAD(nodes, at + 5u),
                        BD_LOAD(nodes, at + 6u));
}

place child(place p) { return place(p.root, p.level + 1u, 4u * p.morton); }

// What comes after p and all that is below it.
place next(place p)
{
    p.morton++;
    // Up to where there is a next sibling: in no loop, since a software device counts rounds.
    uint up = min(uint(findLSB(p.morton)) / 2u, p.level);
    p.morton >>= 2u * up;
    p.level -= up;
    return p.level == 0u ? root_place(p.root + 1u) : p;
}

bool is_inner(uint level) { return level + 1u < args.tree.w; }

// What a node is to a receiver: a light somewhere.
struct node_light {
    vec3 irradiance, direction; // direction of any length
};

#ifdef BD_PRINTED
node_light light_of(receiver r, tree_node n, uint level, float most)
{
    // Eqs. 1 to 6: area and intensity by the fraction of the sphere (errata N1, N2).
    vec3 to_node = n.position - r.position;
    float side = float(args.tree.z << level);
    float area = args.light.y / (4.0 * PI * side * side) * n.light_distance2;
    float form_factor = area * disk_seen(r, to_node, dot(to_node, to_node), n.normal, area);
    return node_light(n.flux * (form_factor / (4.0 * PI) * args.light.z), to_node);
}
#else
// Mean over a lobe of <leaf's normal, direction to the receiver>, those below 0 counted as 0, times
// share and distance. What the mean normal's square lacks of 1 is the variance of the leaves'
// normals, which the two directions across the mean share alike; over that the cosine is spread
// evenly.
float mean_facing(lobe l, vec3 to_lobe, float r2)
{
    float mean = -dot(l.normal, to_lobe);
    float variance = 0.5 * max(l.share * l.share - dot(l.normal, l.normal), 0.0) * r2;
    float reach = max(sqrt(3.0 * variance), 1e-18); // of an even spread
    float above = clamp(mean, -reach, reach) + reach;
    return above * above / (4.0 * reach) + max(mean - reach, 0.0);
}

// Irradiance of a unit of the node's flux from a lobe: of an inner node as a point. A point is
// unbounded, the node's bounds are not.
float lobe_kernel(receiver r, lobe l, vec3 to_lobe, bool inner, float area)
{
    float r2 = dot(to_lobe, to_lobe);
    float receiver_dot = dot(r.normal, to_lobe), facing = -dot(l.normal, to_lobe);
    bool seen = receiver_dot > 0.0 && is_above(dot(r.normal_geometric, to_lobe), r2) &&
                r2 > COINCIDENT_SQUARED;
    if (!seen || !(inner || is_above(facing, r2))) return 0.0;
    return disk_kernel(receiver_dot, inner ? mean_facing(l, to_lobe, r2) : facing, r2,
                       inner ? 0.0 : area);
}

node_light light_of(receiver r, tree_node n, uint level, float most)
{
    bool inner = is_inner(level);
    lobe second = second_lobe(n);
    vec3 to_first = n.first.position - r.position, to_second = second.position - r.position;
    float first_kernel = lobe_kernel(r, n.first, to_first, inner, n.area), kernel = first_kernel;
    if (inner) kernel += lobe_kernel(r, second, to_second, inner, 0.0);
    float share = kernel > 0.0 ? first_kernel / kernel : 1.0;
    if (inner) kernel = min(kernel, most / strongest(n.flux));
    return node_light(n.flux * kernel, mix(to_second, to_first, share));
}
#endif

// Some leaf of the node sends the receiver something.
bool must_refine(tree_node n, float r2, uint level, tree_bounds bounds, float estimate)
{
    float side = float(args.tree.z << level);
    switch (args.cut.x) {
    case BD_TREE_CRITERION_BOUND: return bounds.most > args.tau.y;
    // Errata N4, with tau on the other side: r^2 <= (I / (2 pi tau) - 2 V^2) / (3 res^2) where six
    // faces of res^2 blocks share the sphere.
    case BD_TREE_CRITERION_LEVEL:
        return args.tau.y * (PI * side * side * r2 + args.light.y * n.light_distance2) <=
               args.light.x;
    // Eq. 8: the leaves' resolution at every level, tau in units of the light's whole intensity.
    case BD_TREE_CRITERION_PRINTED:
        side = float(args.tree.z << (args.tree.w - 1u));
        return 3.0 * args.tau.x * side * side * r2 <= 2.0 * (1.0 - args.tau.x) * n.light_distance2;
    default: return bounds.most - bounds.least > args.tau.x * max(estimate, args.tau.z);
    }
}

#ifdef BD_ESTIMATE
const float STEPS_MAX = 16777216.0; // of one light: exact as a float, and 256 of them in 32 bits

uint estimated_steps(receiver r)
{
    float estimate = 0.0;
    for (uint root = args.tree.x; root < args.tree.x + args.tree.y; root++) {
        tree_node n = load_node(root_place(root));
        tree_bounds bounds = bounds_of(n, r.position, r.normal, r.normal_geometric);
        if (bounds.most > 0.0) estimate += strongest(light_of(r, n, 0u, bounds.most).irradiance);
    }
    return uint(min(estimate * args.tau.w, STEPS_MAX));
}
#else
uint leaf_index(place p)
{
    uint side = args.tree.z << (args.tree.w - 1u), face = p.root / roots_of_face();
    uvec2 at = place_of_morton(p.morton);
    return (face * side + at.y) * side + at.x;
}

const uint NONE = 0xffffffffu;

// Where a receiver is on its way, and where that ends for this round.
struct walk {
    place at;
    uint end;    // root
    uint visits; // nodes
};

// Goes on to the end or to the first leaf that is near enough to be integrated as a patch, whose
// index it returns: a software device runs both sides of every branch, and that formula here would
// cost several times the rest.
uint go_on(inout sums s, receiver r, vec3 viewer, inout walk w, float estimate)
{
    while (w.at.root < w.end) {
        tree_node n = load_node(w.at);
        vec3 to_node = n.position - r.position;
        float r2 = dot(to_node, to_node);
        tree_bounds bounds = bounds_of(n, r.position, r.normal, r.normal_geometric);
        bool lit = bounds.most > 0.0, inner = is_inner(w.at.level);
        w.visits++;
        if (inner && lit && must_refine(n, r2, w.at.level, bounds, estimate)) {
            w.at = child(w.at);
            continue;
        }
        place at = w.at;
        w.at = next(at);
        if (w.at.level == 0u && w.visits + args.cut.z > args.cut.y) w.end = w.at.root;
#ifdef BD_SPREAD
        if (lit)
            add_spread(s.spread, r.normal_geometric, to_node, r2, vec4(n.normal, n.area),
                       all_channels(n.flux));
#endif
#ifdef BD_VPL_PATCH
        if (lit && r2 < n.near2 && faces(n.normal, to_node, r2)) return leaf_index(at);
#endif
        node_light l = light_of(r, n, at.level, bounds.most);
        if (lit) add(s, r, viewer, l.direction, dot(l.direction, l.direction), l.irradiance);
    }
    return NONE;
}

// The root to go on from in the next round.
uint gather(inout sums s, receiver r, vec3 viewer, uint first_root, float estimate)
{
    walk w = walk(root_place(first_root), args.tree.x + args.tree.y, 0u);
    if (!r.lit) return w.end;
    while (w.at.root < w.end) {
        uint leaf = go_on(s, r, viewer, w, estimate);
#ifdef BD_VPL_PATCH
        while (leaf != NONE) {
            add_patch(s, r, viewer, leaf);
            leaf = NONE;
        }
#endif
    }
    return w.at.root;
}
#endif

// What earlier roots and lights left there. Macros, since no function may be given an image with a
// format.
#define EARLIER(image, at) (args.rows.z != 0u ? vec3(0.0) : imageLoad(image, at).rgb)
#define ADD(image, at, sum) imageStore(image, at, vec4((sum) + EARLIER(image, at), 1.0))

#ifndef BD_ESTIMATE
#ifdef BD_FRAGMENTS
#ifdef BD_SPREAD
vec4 earlier_vector(ivec2 at) { return imageLoad(vector_1, at); }
#elif defined(BD_VECTOR)
vec4 earlier_vector(ivec2 at) { return vec4(imageLoad(vector_1, at).rgb, 0.0); }
#endif

void keep(sums s, receiver r, uint level, ivec2 block)
{
    ivec2 at = level == 0u ? block : in_stack(level, block);
    if (level == 0u) ADD(light_0, at, s.diffuse);
    else ADD(light_1, at, s.diffuse);
#ifdef BD_VECTOR
    vec4 vector = vec4(irradiance_vector(s, r.normal), 1.0);
#ifdef BD_SPREAD
    vector.a = s.spread.sum;
#endif
    if (level == 0u) ADD(vector_0, at, vector.rgb);
    else imageStore(vector_1, at, args.rows.z != 0u ? vector : vector + earlier_vector(at));
#endif
}
#else
void keep(sums s, receiver r, uint level, ivec2 pixel)
{
    ADD(light_0, pixel, s.diffuse);
#ifdef BD_GLOSSY
    ADD(light_1, pixel, s.glossy);
#endif
}
#endif
#endif

#ifdef BD_ESTIMATE
void light_receiver(receiver r, uint index, uint level, ivec2 block)
{
    uint steps = r.lit ? estimated_steps(r) : 0u;
    estimates[index] = args.rows.z != 0u ? steps : estimates[index] + steps;
}

bool is_done(uint index) { return false; }
#else
void light_receiver(receiver r, uint index, uint level, ivec2 block)
{
    sums s = no_light();
#ifdef BD_SPREAD
    s.spread = spread_of_block(level, r, args.blocks.x);
#endif
    float estimate = args.tau.w > 0.0 ? float(estimates[index]) / args.tau.w : 0.0;
    uint first_root = args.rows.w == 0u ? args.tree.x : next_roots[index];
    uint next_root = gather(s, r, direction_to_viewer(r.relative_position), first_root, estimate);
    keep(s, r, level, block);
    next_roots[index] = next_root;
    if (next_root < args.tree.x + args.tree.y) unfinished_round = args.cut.w;
}

// In an earlier round.
bool is_done(uint index)
{
    return args.rows.w != 0u && next_roots[index] >= args.tree.x + args.tree.y;
}
#endif

void main()
{
#ifdef BD_FRAGMENTS
    if (gl_GlobalInvocationID.x >= args.rows.y) return;
    uint index = args.rows.x + gl_GlobalInvocationID.x, fragment = fragments[index];
    uint level = BD_FRAGMENT_LEVEL(fragment);
    ivec2 block = ivec2(BD_FRAGMENT_X(fragment), BD_FRAGMENT_Y(fragment));
    if (is_done(index)) return;
    light_receiver(block_receiver(level, block), index, level, block);
#else
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy) + ivec2(args.blocks.y, args.rows.x);
    if (gl_GlobalInvocationID.x >= args.blocks.z || gl_GlobalInvocationID.y >= args.rows.y) return;
    uint index = uint(pixel.y) * view.size_px.x + uint(pixel.x);
    if (is_done(index)) return;
    light_receiver(gbuffer_receiver(pixel), index, 0u, pixel);
#endif
}
