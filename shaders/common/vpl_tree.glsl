// A node of a tree of VPLs (shared/vpl_tree.h), and what its leaves send to a point at most.
#include "common/pi.glsl"
#include "shared/vpl_tree.h"

struct tree_node {
    vec3 position, normal, flux, box_min, box_max;
    float area, chord, radiosity, light_distance2, near2;
};

tree_node tree_node_of(vec4 a, vec4 b, vec4 c, vec4 d, vec4 e)
{
    return tree_node(a.xyz, b.xyz, c.xyz, d.xyz, e.xyz, a.w, b.w, c.w, d.w, e.w);
}

float strongest(vec3 c) { return max(c.r, max(c.g, c.b)); }

// Largest product with d of any point of the box centre +- half.
float box_reach(vec3 centre, vec3 half_size, vec3 d)
{
    return dot(d, centre) + dot(abs(d), half_size);
}

// Leaves at most this high over a receiver's plane give it nothing; half of what a gather allows
// (common/vpl_gather.glsl), so that rounding cannot take away what a leaf by itself would give.
const float TREE_COPLANAR_HEIGHT = 5e-6;
// Of the lowest leaf over the receiver's plane, for all to count: well above what a gather cuts off.
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
    float surface = box_reach(centre, half_size, normal_geometric);
    float receiver = box_reach(centre, half_size, normal);
    float sender = box_reach(centre, half_size, -n.normal);
    vec3 outside = max(abs(centre) - half_size, vec3(0.0)), across = abs(centre) + half_size;
    float nearest = length(outside), farthest = length(across);
    bool seen = surface > TREE_COPLANAR_HEIGHT && receiver > 0.0 &&
                sender + n.chord * farthest > TREE_COPLANAR_HEIGHT;
    if (!seen) return tree_bounds(0.0, 0.0);
    if (!(nearest > 0.0)) return tree_bounds(0.0, n.radiosity);
    float cosines = min(receiver / nearest, 1.0) *
                    min(max(sender, 0.0) / nearest + n.chord, 1.0);
    float most = min(power * cosines / (PI * nearest * nearest), n.radiosity);
    // All of the box above the receiver's surface, and in front of every leaf?
    float surface_least = -box_reach(centre, half_size, -normal_geometric);
    float receiver_least = -box_reach(centre, half_size, -normal);
    float sender_least = -box_reach(centre, half_size, n.normal);
    if (!(surface_least > TREE_LIT_SINE * farthest)) return tree_bounds(0.0, most);
    cosines = max(receiver_least / farthest, 0.0) *
              max(sender_least / farthest - n.chord, 0.0);
    return tree_bounds(power * cosines / (PI * farthest * farthest + n.area), most);
}
