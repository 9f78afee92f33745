// One triangle over the whole target, at a depth of the draw's own.
#include "shared/bindings.h"
#include "shared/gather_fragments.h"

layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_gather_fragments_args args; };

void main()
{
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0;
    gl_Position = vec4(corner, args.depth, 1.0);
}
