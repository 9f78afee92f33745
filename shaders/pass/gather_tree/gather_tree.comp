// Gather over a cut of a light's tree of VPLs, one cut a receiver (algorithms.md A2.4): a node
// stands for all leaves below it where the criterion says that it may.
//
// Depth first, in Morton order, without a stack: the place in the tree is a level and an index.
//
// image 0: irradiance, demodulated; image 1 (BD_GLOSSY): see common/vpl_gather.glsl.
// BD_ESTIMATE: adds what the roots by themselves send to each receiver's estimate; no images.
// BD_FRAGMENTS: a receiver is a block of pixels of a list (images 0 and 1: level 0, the rest; with
// BD_VECTOR 2 and 3: the irradiance vector), else a pixel.
#include "common/morton.glsl"
#include "common/vpl_gather.glsl"
#include "common/vpl_tree.glsl"
#include "shared/gather_tree.h"
#ifdef BD_FRAGMENTS
#include "common/block_receiver.glsl" // last: what it includes and others do is above
#endif

layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_gather_tree_args args; };
BD_ARRAY(nodes, BD_UNIT_TREE_NODES);
// Irradiance of each receiver, of all lights, by their trees' roots alone. Not improved on the way, and
// in whole steps, whose sum has no order: a cut must not depend on which light comes first.
layout(std430, binding = BD_STORAGE_ESTIMATES) buffer estimate_block { uint estimates[]; };
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
                        BD_LOAD(nodes, at + 3u), BD_LOAD(nodes, at + 4u));
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

bool printed() { return args.cut.x == BD_TREE_CRITERION_PRINTED; }

bool is_inner(uint level) { return level + 1u < args.tree.w; }

// Irradiance of a unit of flux from an inner node as a point. The mean cosine of its leaves' normals is
// above the cosine of their mean where some face away, which send nothing and not less than nothing:
// SPREAD of what the squared length lacks of 1 stands for the mean of their magnitudes.
const float SPREAD = 0.125;

float node_kernel(receiver r, vec3 to_node, float r2, vec3 normal)
{
    float receiver_dot = dot(r.normal, to_node);
    float side = dot(r.normal_geometric, to_node);
    if (!(receiver_dot > 0.0 && is_above(side, r2) && r2 > COINCIDENT_SQUARED)) return 0.0;
    float facing = -dot(normal, to_node), lack = max(1.0 - dot(normal, normal), 0.0);
    float mean = 0.5 * (facing + sqrt(facing * facing + SPREAD * lack * r2));
    return disk_kernel(receiver_dot, mean, r2, 0.0);
}

// Irradiance from the node as one light; at most `most`, since a point is unbounded.
vec3 node_irradiance(receiver r, tree_node n, vec3 to_node, float r2, uint level, float most)
{
    if (printed()) {
        // Eqs. 1 to 6: area and intensity by the fraction of the sphere (errata N1, N2).
        float side = float(args.tree.z << level);
        float area = args.light.y / (4.0 * PI * side * side) * n.light_distance2;
        float form_factor = area * disk_seen(r, to_node, r2, n.normal, area);
        return n.flux * (form_factor / (4.0 * PI) * args.light.z);
    }
    if (!is_inner(level)) return n.flux * disk_seen(r, to_node, r2, n.normal, n.area);
    float kernel = node_kernel(r, to_node, r2, n.normal);
    return n.flux * min(kernel, most / strongest(n.flux));
}

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
        vec3 to_node = n.position - r.position;
        tree_bounds bounds = bounds_of(n, r.position, r.normal, r.normal_geometric);
        if (!(bounds.most > 0.0)) continue;
        float r2 = dot(to_node, to_node);
        estimate += strongest(node_irradiance(r, n, to_node, r2, 0u, bounds.most));
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

// Goes on from p to `end` or to the first leaf that is near enough to be integrated as a patch,
// whose index it returns: a software device runs both sides of every branch, and that formula here
// would cost several times the rest.
uint walk(inout sums s, receiver r, vec3 viewer, inout place p, uint end, float estimate)
{
    while (p.root < end) {
        tree_node n = load_node(p);
        vec3 to_node = n.position - r.position;
        float r2 = dot(to_node, to_node);
        tree_bounds bounds = bounds_of(n, r.position, r.normal, r.normal_geometric);
        vec3 alone = vec3(0.0);
        if (bounds.most > 0.0) alone = node_irradiance(r, n, to_node, r2, p.level, bounds.most);
        if (is_inner(p.level) && bounds.most > 0.0 && must_refine(n, r2, p.level, bounds, estimate)) {
            p = child(p);
            continue;
        }
#ifdef BD_VPL_PATCH
        if (bounds.most > 0.0 && r2 < n.near2 && faces(n.normal, to_node, r2)) {
            uint leaf = leaf_index(p);
            p = next(p);
            return leaf;
        }
#endif
        add(s, r, viewer, to_node, r2, alone);
        p = next(p);
    }
    return NONE;
}

void gather(inout sums s, receiver r, vec3 viewer, float estimate)
{
    place p = root_place(args.tree.x);
    uint end = args.tree.x + args.tree.y;
    while (p.root < end) {
        uint leaf = walk(s, r, viewer, p, end, estimate);
#ifdef BD_VPL_PATCH
        while (leaf != NONE) {
            add_patch(s, r, viewer, leaf);
            leaf = NONE;
        }
#endif
    }
}
#endif

// What earlier roots and lights left there. Macros, since no function may be given an image with a
// format.
#define EARLIER(image, at) (args.rows.z != 0u ? vec3(0.0) : imageLoad(image, at).rgb)
#define ADD(image, at, sum) imageStore(image, at, vec4((sum) + EARLIER(image, at), 1.0))

#ifndef BD_ESTIMATE
#ifdef BD_FRAGMENTS
void keep(sums s, uint level, ivec2 block)
{
    ivec2 at = level == 0u ? block : in_stack(level, block);
    if (level == 0u) ADD(light_0, at, s.diffuse);
    else ADD(light_1, at, s.diffuse);
#ifdef BD_VECTOR
    if (level == 0u) ADD(vector_0, at, s.vector);
    else ADD(vector_1, at, s.vector);
#endif
}
#else
void keep(sums s, uint level, ivec2 pixel)
{
    ADD(light_0, pixel, s.diffuse);
#ifdef BD_GLOSSY
    ADD(light_1, pixel, s.glossy);
#endif
}
#endif
#endif

void light_receiver(receiver r, uint index, uint level, ivec2 block)
{
#ifdef BD_ESTIMATE
    uint steps = r.lit ? estimated_steps(r) : 0u;
    estimates[index] = args.rows.z != 0u ? steps : estimates[index] + steps;
#else
    sums s = no_light();
    float estimate = args.tau.w > 0.0 ? float(estimates[index]) / args.tau.w : 0.0;
    if (r.lit) gather(s, r, direction_to_viewer(r.relative_position), estimate);
    keep(s, level, block);
#endif
}

void main()
{
#ifdef BD_FRAGMENTS
    if (gl_GlobalInvocationID.x >= args.rows.y) return;
    uint index = args.rows.x + gl_GlobalInvocationID.x, fragment = fragments[index];
    uint level = BD_FRAGMENT_LEVEL(fragment);
    ivec2 block = ivec2(BD_FRAGMENT_X(fragment), BD_FRAGMENT_Y(fragment));
    light_receiver(block_receiver(level, block), index, level, block);
#else
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, args.rows.x);
    if (pixel.x >= int(view.size_px.x) || gl_GlobalInvocationID.y >= args.rows.y) return;
    uint index = uint(pixel.y) * view.size_px.x + uint(pixel.x);
    light_receiver(gbuffer_receiver(pixel), index, 0u, pixel);
#endif
}
