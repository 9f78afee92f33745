// Nodes of a tree of VPLs (shared/vpl_tree.h): what their leaves send to a receiver, and what of it
// at most and at least. n and n_geometric are the receiver's unit normals.
#ifndef BD_KERNEL_VPL_TREE_H
#define BD_KERNEL_VPL_TREE_H

#include "kernel/vpl_light.h"

// Leaves of a node that face alike. Second moments of position, as the next term of a series, made
// it worse: nodes of a cut are as large as they are near.
STRUCT(lobe)
{
    f3 position, normal; // the mean normal times share
    float share;         // of the node's flux
};

STRUCT(tree_node)
{
    f3 position, normal, flux, box_min, box_max;
    float area, chord, radiosity, light_distance2, near2;
    lobe first;
};

KERNEL float strongest(f3 c) { return f_max(c.x, f_max(c.y, c.z)); }

// --- bounds -------------------------------------------------------------------------------------

// Leaves at most this high over a receiver's plane give it nothing; half of what a gather allows
// (kernel/vpl_light.h), so that rounding cannot take away what a leaf by itself would give.
#define TREE_COPLANAR_HEIGHT 5e-6f
// Of the lowest leaf over the receiver's plane, for all to count: well above what a gather cuts
// off.
#define TREE_LIT_SINE 1e-3f

// Bounds of the irradiance, of its strongest channel, that all leaves of a node together send to a
// receiver.
STRUCT(tree_bounds)
{
    float least, most; // most = 0 where none of them can send it any
};

// Least and largest product with d of any point of the box centre +- size.
STRUCT(span)
{
    float low, high;
};

KERNEL span box_range(f3 centre, f3 size, f3 d)
{
    float middle = f3_dot(d, centre), reach = f3_dot(f3_abs(d), size);
    span s;
    s.low = middle - reach;
    s.high = middle + reach;
    return s;
}

// A leaf at v from the receiver sends P <n, v> <n', -v> / (pi |v|^4) at most, and no form factor
// exceeds 1; it sends as much over pi |v|^4 + A |v|^2 at least. The box bounds v; a leaf's n' is
// within `chord` of the mean normal, so <n', -v> is within chord |v| of <normal, -v>.
KERNEL tree_bounds bounds_of(tree_node node, f3 position, f3 n, f3 n_geometric)
{
    float power = strongest(node.flux);
    f3 centre = f3_sub(f3_scale(f3_add(node.box_min, node.box_max), 0.5f), position);
    f3 size = f3_scale(f3_sub(node.box_max, node.box_min), 0.5f);
    span surface = box_range(centre, size, n_geometric), own = box_range(centre, size, n);
    span sender = box_range(centre, size, f3_scale(node.normal, -1.0f));
    f3 away = f3_abs(centre);
    float nearest = f3_length(f3_max(f3_sub(away, size), 0.0f));
    float farthest = f3_length(f3_add(away, size)), near = f_max(nearest, 1e-18f);
    bool above = b_and(surface.high > TREE_COPLANAR_HEIGHT, own.high > 0.0f);
    bool facing = sender.high + node.chord * farthest > TREE_COPLANAR_HEIGHT;
    bool seen = b_and(power > 0.0f, b_and(above, facing));
    float cosines = f_min(own.high / near, 1.0f) *
                    f_min(f_max(sender.high, 0.0f) / near + node.chord, 1.0f);
    float most = f_min(power * cosines / (F_PI * near * near), node.radiosity);
    // All of the box above the receiver's surface, and in front of every leaf?
    bool lit = b_and(nearest > 0.0f, surface.low > TREE_LIT_SINE * farthest);
    float far = f_max(farthest, 1e-18f);
    cosines = f_max(own.low / far, 0.0f) * f_max(sender.low / far - node.chord, 0.0f);
    float least = power * cosines / (F_PI * far * far + node.area);
    tree_bounds b;
    b.least = f_select(b_and(seen, lit), least, 0.0f);
    b.most = f_select(seen, f_select(nearest > 0.0f, most, node.radiosity), 0.0f);
    return b;
}

// --- light --------------------------------------------------------------------------------------

// Shares below this are rounding.
#define LOBE_SHARE_MIN 1e-6f

// What of the node is not in its first lobe.
KERNEL lobe second_lobe(tree_node node)
{
    float share = 1.0f - node.first.share;
    bool is_there = share >= LOBE_SHARE_MIN;
    f3 rest = f3_sub(node.position, f3_scale(node.first.position, node.first.share));
    lobe l;
    l.share = f_select(is_there, share, 0.0f);
    l.position =
        f3_select(is_there, f3_scale(rest, 1.0f / f_max(share, LOBE_SHARE_MIN)), node.position);
    l.normal =
        f3_select(is_there, f3_sub(node.normal, node.first.normal), f3_of(0.0f, 0.0f, 0.0f));
    return l;
}

// Mean over a lobe of <leaf's normal, direction to the receiver>, those below 0 counted as 0, times
// share and distance. What the mean normal's square lacks of 1 is the variance of the leaves'
// normals, which the two directions across the mean share alike; over that the cosine is spread
// evenly.
KERNEL float mean_facing(f3 normal, float share, f3 to_lobe, float r2)
{
    float mean = -f3_dot(normal, to_lobe);
    float variance = 0.5f * f_max(share * share - f3_dot(normal, normal), 0.0f) * r2;
    float reach = f_max(f_sqrt(3.0f * variance), 1e-18f); // of an even spread
    float above = f_min(f_max(mean, -reach), reach) + reach;
    return above * above / (4.0f * reach) + f_max(mean - reach, 0.0f);
}

// Irradiance of a unit of the node's flux from a lobe of an inner node, as a point: unbounded.
KERNEL float lobe_light(f3 normal, float share, f3 n, f3 n_geometric, f3 to_lobe)
{
    float r2 = f3_dot(to_lobe, to_lobe), receiver_dot = f3_dot(n, to_lobe);
    bool above = b_and(receiver_dot > 0.0f, is_above(f3_dot(n_geometric, to_lobe), r2));
    float light = disk_kernel(receiver_dot, mean_facing(normal, share, to_lobe, r2), r2, 0.0f);
    return f_select(b_and(above, r2 > COINCIDENT_SQUARED), light, 0.0f);
}

// Of an inner node with one lobe: no more than `most` of tree_bounds.
KERNEL float light_of_lobe(lobe only, float power, f3 position, f3 n, f3 n_geometric, float most)
{
    f3 to_lobe = f3_sub(only.position, position);
    return f_min(lobe_light(only.normal, only.share, n, n_geometric, to_lobe),
                 most / f_max(power, 1e-37f));
}

// What an inner node is to a receiver: a light somewhere.
STRUCT(inner_light)
{
    float kernel; // irradiance of a unit of flux, no more than `most` of tree_bounds
    float share;  // of it, from the first lobe
};

// The node's two lobes, and its strongest flux.
KERNEL inner_light light_of_inner(lobe first, lobe second, float power, f3 position, f3 n,
                                  f3 n_geometric, float most)
{
    f3 to_first = f3_sub(first.position, position);
    f3 to_second = f3_sub(second.position, position);
    float from_first = lobe_light(first.normal, first.share, n, n_geometric, to_first);
    float sum = from_first + lobe_light(second.normal, second.share, n, n_geometric, to_second);
    inner_light l;
    l.kernel = f_min(sum, most / f_max(power, 1e-37f));
    l.share = f_select(sum > 0.0f, from_first / f_max(sum, 1e-37f), 1.0f);
    return l;
}

// Where that light comes from: of any length.
KERNEL f3 direction_of_inner(lobe first, lobe second, float share, f3 position)
{
    return f3_sub(f3_between(second.position, first.position, share), position);
}

#endif
