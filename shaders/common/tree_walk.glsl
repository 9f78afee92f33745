// A cut of a light's tree of VPLs for a receiver (algorithms.md A2.4): a node stands for all leaves
// below it where the criterion says that it may.
//
// Depth first, in Morton order, without a stack: the place in the tree is a level and an index.
//
// BD_PRINTED: Eqs. 1 to 6 of the paper, with their errors.
#include "common/array.glsl"
#include "common/morton.glsl"
#include "common/vpl_gather.glsl"
#include "common/vpl_tree.glsl"
#include "shared/gather_tree.h"

layout(std140, binding = BD_UNIFORM_TREE) uniform tree_block { bd_gather_tree_args tree_args; };
BD_ARRAY(nodes, BD_UNIT_TREE_NODES);
// Irradiance of each receiver, of all lights, by their trees' roots alone. Not improved on the way,
// and in whole steps, whose sum has no order: a cut must not depend on which light comes first.
layout(std430, binding = BD_STORAGE_ESTIMATES) buffer estimate_block { uint estimates[]; };
layout(std430, binding = BD_STORAGE_NEXT_ROOTS) buffer next_block {
    uint unfinished_round; // the last that somebody did not finish in
    uint next_roots[];     // of each receiver
};

// A place in the tree.
struct place {
    uint root;   // counted over all faces
    uint level;  // 0 = roots
    uint morton; // in the level, in the face
};

uint roots_of_face() { return tree_args.root_side * tree_args.root_side; }

place root_place(uint root)
{
    return place(root, 0u, root % roots_of_face());
}

// Index of a level's first node in a face.
uint level_first(uint level) { return roots_of_face() * ((1u << 2u * level) - 1u) / 3u; }

tree_node load_node(place p)
{
    uint face = p.root / roots_of_face();
    uint at = (face * level_first(tree_args.level_count) + level_first(p.level) + p.morton) *
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

bool is_inner(uint level) { return level + 1u < tree_args.level_count; }

// What a node is to a receiver: a light somewhere.
struct node_light {
    vec3 irradiance, direction; // direction of any length
};

#ifdef BD_PRINTED
node_light light_of(receiver r, tree_node n, uint level, float most)
{
    // Eqs. 1 to 6: area and intensity by the fraction of the sphere (errata N1, N2).
    vec3 to_node = n.position - r.position;
    float side = float(tree_args.root_side << level);
    float area = tree_args.face_extent / (4.0 * PI * side * side) * n.light_distance2;
    float form_factor = area * disk_seen(r, to_node, dot(to_node, to_node), n.normal, area, VPL_UNBOUNDED);
    return node_light(n.flux * (form_factor / (4.0 * PI) * tree_args.per_m2), to_node);
}
#else
node_light light_of(receiver r, tree_node n, uint level, float most)
{
    if (!is_inner(level)) {
        vec3 to_leaf = n.first.position - r.position;
        float kernel = disk_seen(r, to_leaf, dot(to_leaf, to_leaf), n.first.normal, n.area,
                                 VPL_UNBOUNDED);
        return node_light(n.flux * kernel, to_leaf);
    }
    lobe second = second_lobe(n);
    inner_light l = light_of_inner(n.first, second, strongest(n.flux), r.position, r.normal,
                                   r.normal_geometric, most);
    return node_light(n.flux * l.kernel,
                      direction_of_inner(n.first, second, l.share, r.position));
}
#endif

// Some leaf of the node sends the receiver something.
bool must_refine(tree_node n, float r2, uint level, tree_bounds bounds, float estimate)
{
    float side = float(tree_args.root_side << level);
    switch (tree_args.criterion) {
    case BD_TREE_CRITERION_BOUND: return bounds.most > tree_args.tau_absolute;
    // Errata N4, with tau on the other side: r^2 <= (I / (2 pi tau) - 2 V^2) / (3 res^2) where six
    // faces of res^2 blocks share the sphere.
    case BD_TREE_CRITERION_LEVEL:
        return tree_args.tau_absolute *
                   (PI * side * side * r2 + tree_args.face_extent * n.light_distance2) <=
               tree_args.face_flux;
    // Eq. 8: the leaves' resolution at every level, tau in units of the light's whole intensity.
    case BD_TREE_CRITERION_PRINTED:
        side = float(tree_args.root_side << (tree_args.level_count - 1u));
        return 3.0 * tree_args.tau_relative * side * side * r2 <=
               2.0 * (1.0 - tree_args.tau_relative) * n.light_distance2;
    default: return bounds.most - bounds.least > tree_args.tau_relative * max(estimate, tree_args.estimate_min);
    }
}

const float STEPS_MAX = 16777216.0; // of one light: exact as a float, and 256 of them in 32 bits

uint estimated_steps(receiver r)
{
    float estimate = 0.0;
    for (uint root = tree_args.first_root; root < tree_args.first_root + tree_args.root_count; root++) {
        tree_node n = load_node(root_place(root));
        tree_bounds bounds = bounds_of(n, r.position, r.normal, r.normal_geometric);
        if (bounds.most > 0.0) estimate += strongest(light_of(r, n, 0u, bounds.most).irradiance);
    }
    return uint(min(estimate * tree_args.steps_per_unit, STEPS_MAX));
}
uint leaf_index(place p)
{
    uint side = tree_args.root_side << (tree_args.level_count - 1u), face = p.root / roots_of_face();
    uvec2 at = place_of_morton(p.morton);
    return (face * side + at.y) * side + at.x;
}

// Where a receiver is on its way, and where that ends for this round.
struct walk {
    place at;
    uint end;    // root
    uint visits; // nodes
};

walk walk_from(uint root)
{
    return walk(root_place(root), tree_args.first_root + tree_args.root_count, 0u);
}

// A node that stands for its leaves.
struct cut_node {
    place at;
    tree_node n;
    tree_bounds bounds; // most = 0: it sends the receiver nothing
    vec3 to_node;
    float r2;
};

// Looks at the node where the walk is, and goes on; false where that is too coarse. In no loop of
// its own: a software device would wait for the slowest of eight receivers at every node.
bool takes_next(receiver r, inout walk w, float estimate, out cut_node c)
{
    c.at = w.at;
    c.n = load_node(w.at);
    c.to_node = c.n.position - r.position;
    c.r2 = dot(c.to_node, c.to_node);
    c.bounds = bounds_of(c.n, r.position, r.normal, r.normal_geometric);
    w.visits++;
    if (is_inner(w.at.level) && c.bounds.most > 0.0 &&
        must_refine(c.n, c.r2, w.at.level, c.bounds, estimate)) {
        w.at = child(w.at);
        return false;
    }
    w.at = next(w.at);
    if (w.at.level == 0u && w.visits + tree_args.nodes_per_root > tree_args.nodes_per_round)
        w.end = w.at.root;
    return true;
}

// A leaf that must be integrated as a patch.
bool is_near(cut_node c) { return c.r2 < c.n.near2 && faces(c.n.normal, c.to_node, c.r2); }

// Of all lights' roots, as far as estimates were asked for.
float estimate_of(uint receiver_index)
{
    return tree_args.steps_per_unit > 0.0 ? float(estimates[receiver_index]) / tree_args.steps_per_unit : 0.0;
}
