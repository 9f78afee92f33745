// A VPL an instance: two triangles over the rectangle of its splat.
#include "common/splat_area.glsl"
#include "shared/splat.h"

layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_splat_args args; };
flat out uint splat_vpl;
flat out float splat_reach_squared;

const ivec2 CORNERS[6] = ivec2[6](ivec2(0, 0), ivec2(0, 1), ivec2(1, 0), ivec2(1, 0), ivec2(0, 1),
                                  ivec2(1, 1));

void main()
{
    splat_vpl = args.first_vpl + uint(gl_InstanceID);
    splat_reach_squared = reach_squared(splat_vpl, args.bound);
    ivec4 area = splat_area(splat_vpl, args.bound);
    ivec2 corner = area.xy + CORNERS[gl_VertexID] * (area.zw - area.xy);
    vec2 at = vec2(corner) / vec2(view.size_px.xy);
    gl_Position = vec4(2.0 * at.x - 1.0, 1.0 - 2.0 * at.y, 0.5, 1.0);
}
