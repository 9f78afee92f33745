// A node of a tree of VPLs (kernel/vpl_tree.h), as it lies in the array (shared/vpl_tree.h).
#include "kernel/vpl_tree.h"
#include "shared/vpl_tree.h"

tree_node tree_node_of(vec4 a, vec4 b, vec4 c, vec4 d, vec4 e, vec4 f, vec4 g)
{
    return tree_node(a.xyz, b.xyz, c.xyz, d.xyz, e.xyz, a.w, b.w, c.w, d.w, e.w,
                     lobe(f.xyz, g.xyz, f.w));
}
