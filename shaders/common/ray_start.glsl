// Where a pixel's rays start: along its surface nearer to the viewer by what a position loses, so that
// in a corner it does not lie behind the other surface, which its own normal's lift leaves as it is.
#include "common/gbuffer.glsl"
#include "kernel/lift.h"

receiver ray_receiver(ivec2 pixel)
{
    receiver r = gbuffer_receiver(pixel);
    vec3 viewer = direction_to_viewer(r.relative_position), n = r.normal_geometric;
    float lift = lift_of_segment(largest_coordinate(view.position.xyz), r.position, r.position);
    r.position += lift * (viewer - dot(viewer, n) * n);
    return r;
}
