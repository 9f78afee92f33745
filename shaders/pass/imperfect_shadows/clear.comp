// Maps of a slice with nothing in them.
#include "kernel/imperfect_shadow.h"
#include "shared/bindings.h"
#include "shared/imperfect_shadows.h"

layout(local_size_x = 64) in;
layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_imperfect_args args; };
layout(std430, binding = BD_STORAGE_SHADOW_TEXELS) writeonly buffer texel_block { uint texels[]; };

void main()
{
    uint map = args.first_map + gl_WorkGroupID.y, of_map = args.side * args.side;
    if (gl_GlobalInvocationID.x < of_map) texels[map * of_map + gl_GlobalInvocationID.x] = NO_DISK;
}
