// A node of a tree of VPLs (shared/vpl_tree.h), and what its leaves send to a point at most.
#include "common/pi.glsl"
#include "shared/vpl_tree.h"

// Leaves of a node that face alike.
struct lobe {
    vec3 position, normal; // the mean normal times share
    float share;           // of the node's flux
};

struct tree_node {
    vec3 position, normal, flux, box_min, box_max;
    float area, chord, radiosity, light_distance2, near2;
    lobe first;
};

tree_node tree_node_of(vec4 a, vec4 b, vec4 c, vec4 d, vec4 e, vec4 f, vec4 g)
{
    return tree_node(a.xyz, b.xyz, c.xyz, d.xyz, e.xyz, a.w, b.w, c.w, d.w, e.w,
                     lobe(f.xyz, g.xyz, f.w));
}

// Shares below this are rounding.
const float LOBE_SHARE_MIN = 1e-6;

// What of the node is not in its first lobe.
lobe second_lobe(tree_node n)
{
    float share = 1.0 - n.first.share;
    if (share < LOBE_SHARE_MIN) return lobe(n.position, vec3(0.0), 0.0);
    return lobe((n.position - n.first.share * n.first.position) / share,
                n.normal - n.first.normal, share);
}

float strongest(vec3 c) { return max(c.r, max(c.g, c.b)); }

// Least and largest product with d of any point of the box centre +- half.
vec2 box_range(vec3 centre, vec3 half_size, vec3 d)
{
    float middle = dot(d, centre), reach = dot(abs(d), half_size);
    return vec2(middle - reach, middle + reach);
}

// Leaves at most this high over a receiver's plane give it nothing; half of what a gather allows
// (common/vpl_gather.glsl), so that rounding cannot take away what a leaf by itself would give.
const float TREE_COPLANAR_HEIGHT = 5e-6;
// Of the lowest leaf over the receiver's plane, for all to count: well above what a gather cuts
// off.
const float TREE_LIT_SINE = 1e-3;

// Bounds of the irradiance, of its strongest channel, that all leaves of a node together send to a
// receiver.
struct tree_bounds {
    float least, most; // most = 0 where none of them can send it any
};

// A leaf at v from the receiver sends P <n, v> <n', -v> / (pi |v|^4) at most, and no form factor
// exceeds 1; it sends as much over pi |v|^4 + A |v|^2 at least. The box bounds v; a leaf's n' is
// within `chord` of the mean normal, so <n', -v> is within chord |v| of <normal, -v>.
tree_bounds bounds_of(tree_node n, vec3 position, vec3 normal, vec3 normal_geometric)
{
    float power = strongest(n.flux);
    if (!(power > 0.0)) return tree_bounds(0.0, 0.0);
    vec3 centre = 0.5 * (n.box_min + n.box_max) - position;
    vec3 half_size = 0.5 * (n.box_max - n.box_min);
    vec2 surface = box_range(centre, half_size, normal_geometric);
    vec2 receiver = box_range(centre, half_size, normal);
    vec2 sender = box_range(centre, half_size, -n.normal);
    vec3 outside = max(abs(centre) - half_size, vec3(0.0)), across = abs(centre) + half_size;
    float nearest = length(outside), farthest = length(across);
    bool seen = surface.y > TREE_COPLANAR_HEIGHT && receiver.y > 0.0 &&
                sender.y + n.chord * farthest > TREE_COPLANAR_HEIGHT;
    if (!seen) return tree_bounds(0.0, 0.0);
    if (!(nearest > 0.0)) return tree_bounds(0.0, n.radiosity);
    float cosines = min(receiver.y / nearest, 1.0) *
                    min(max(sender.y, 0.0) / nearest + n.chord, 1.0);
    float most = min(power * cosines / (PI * nearest * nearest), n.radiosity);
    // All of the box above the receiver's surface, and in front of every leaf?
    if (!(surface.x > TREE_LIT_SINE * farthest)) return tree_bounds(0.0, most);
    cosines = max(receiver.x / farthest, 0.0) *
              max(sender.x / farthest - n.chord, 0.0);
    return tree_bounds(power * cosines / (PI * farthest * farthest + n.area), most);
}
