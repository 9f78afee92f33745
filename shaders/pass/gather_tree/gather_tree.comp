// Gather over a cut of a light's tree of VPLs, one cut a receiver (algorithms.md A2.4): a node
// stands for all leaves below it where the criterion says that it may.
//
// Depth first, in Morton order, without a stack: the place in the tree is a level and an index.
//
// image 0: irradiance, demodulated; image 1 (BD_GLOSSY): see common/vpl_gather.glsl.
// BD_ESTIMATE: adds what the roots by themselves send to each receiver's estimate; no images.
#include "common/morton.glsl"
#include "common/vpl_gather.glsl"
#include "common/vpl_tree.glsl"
#include "shared/gather_tree.h"

layout(local_size_x = 8, local_size_y = 8) in;
layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_gather_tree_args args; };
BD_ARRAY(nodes, BD_UNIT_TREE_NODES);
// Irradiance that each receiver will get as far as known: coarse, then more and more of it exact.
layout(std430, binding = BD_STORAGE_ESTIMATES) buffer estimate_block { float estimates[]; };
#ifndef BD_ESTIMATE
layout(binding = 0, rgba32f) uniform image2D irradiance;
#ifdef BD_GLOSSY
layout(binding = 1, rgba32f) uniform image2D glossy;
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
    while (p.level > 0u && (p.morton & 3u) == 0u) {
        p.morton >>= 2;
        p.level--;
    }
    return p.level == 0u ? root_place(p.root + 1u) : p;
}

bool printed() { return args.cut.x == BD_TREE_CRITERION_PRINTED; }

// Irradiance from the node as one light.
vec3 node_irradiance(receiver r, tree_node n, vec3 to_node, float r2, uint level)
{
    if (!printed()) return n.flux * disk_seen(r, to_node, r2, n.normal, n.area);
    // Eqs. 1 to 6 as printed: area and intensity by the fraction of the sphere (errata N1, N2).
    float side = float(args.tree.z << level);
    float area = args.light.y / (4.0 * PI * side * side) * n.light_distance2;
    float form_factor = area * disk_seen(r, to_node, r2, n.normal, area);
    return n.flux * (form_factor / (4.0 * PI) * args.light.z);
}

// `bound` is above 0: some leaf of the node sends the receiver something.
bool must_refine(tree_node n, float r2, uint level, float bound, float estimate)
{
    float side = float(args.tree.z << level);
    switch (args.cut.x) {
    case BD_TREE_CRITERION_BOUND: return bound > args.tau.y;
    // Errata N4, with tau on the other side: r^2 <= (I / (2 pi tau) - 2 V^2) / (3 res^2) where six
    // faces of res^2 blocks share the sphere.
    case BD_TREE_CRITERION_LEVEL:
        return args.tau.y * (PI * side * side * r2 + args.light.y * n.light_distance2) <=
               args.light.x;
    // Eq. 8: the leaves' resolution at every level, tau in units of the light's whole intensity.
    case BD_TREE_CRITERION_PRINTED:
        side = float(args.tree.z << (args.tree.w - 1u));
        return 3.0 * args.tau.x * side * side * r2 <= 2.0 * (1.0 - args.tau.x) * n.light_distance2;
    default: return bound > args.tau.x * max(estimate, args.tau.z);
    }
}

#ifdef BD_ESTIMATE
void gather(receiver r, inout float estimate)
{
    for (uint root = args.tree.x; root < args.tree.x + args.tree.y; root++) {
        tree_node n = load_node(root_place(root));
        vec3 to_node = n.position - r.position;
        estimate += strongest(node_irradiance(r, n, to_node, dot(to_node, to_node), 0u));
    }
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
uint walk(inout sums s, receiver r, vec3 viewer, inout place p, uint end, inout float estimate,
          inout sums at_root, inout float root_alone)
{
    while (p.root < end) {
        tree_node n = load_node(p);
        vec3 to_node = n.position - r.position;
        float r2 = dot(to_node, to_node);
        float bound = tree_bound(n, r.position, r.normal, r.normal_geometric);
        vec3 alone = bound > 0.0 ? node_irradiance(r, n, to_node, r2, p.level) : vec3(0.0);
        if (p.level == 0u) {
            estimate += strongest(s.diffuse - at_root.diffuse) - root_alone;
            at_root.diffuse = s.diffuse;
            root_alone = strongest(alone);
        }
        bool inner = p.level + 1u < args.tree.w;
        if (inner && bound > 0.0 && must_refine(n, r2, p.level, bound, estimate)) {
            p = child(p);
            continue;
        }
#ifdef BD_VPL_PATCH
        if (bound > 0.0 && r2 < n.near2 && faces(n.normal, to_node, r2)) {
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

void gather(inout sums s, receiver r, vec3 viewer, inout float estimate)
{
    place p = root_place(args.tree.x);
    uint end = args.tree.x + args.tree.y;
    sums at_root = s;
    float root_alone = 0.0;
    while (p.root < end) {
        uint leaf = walk(s, r, viewer, p, end, estimate, at_root, root_alone);
#ifdef BD_VPL_PATCH
        while (leaf != NONE) {
            add_patch(s, r, viewer, leaf);
            leaf = NONE;
        }
#endif
    }
    estimate += strongest(s.diffuse - at_root.diffuse) - root_alone;
}
#endif

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, args.rows.x);
    if (pixel.x >= int(view.size_px.x) || gl_GlobalInvocationID.y >= args.rows.y) return;
    uint index = uint(pixel.y) * view.size_px.x + uint(pixel.x);
    receiver r = gbuffer_receiver(pixel);
    bool first = args.rows.z != 0u;
#ifdef BD_ESTIMATE
    float estimate = first ? 0.0 : estimates[index];
    if (r.lit) gather(r, estimate);
    estimates[index] = estimate;
#else
    vec3 viewer = direction_to_viewer(r.relative_position);
    sums s = no_light();
    float estimate = estimates[index];
    if (r.lit) gather(s, r, viewer, estimate);
    estimates[index] = estimate;
    if (!first) s.diffuse += imageLoad(irradiance, pixel).rgb;
    imageStore(irradiance, pixel, vec4(s.diffuse, 1.0));
#ifdef BD_GLOSSY
    if (!first) s.glossy += imageLoad(glossy, pixel).rgb;
    imageStore(glossy, pixel, vec4(s.glossy, 1.0));
#endif
#endif
}
