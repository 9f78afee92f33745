// Vertex-stage access to the instance array (shared/instance.h).
#include "common/array.glsl"
#include "shared/bindings.h"
#include "shared/instance.h"

BD_ARRAY(instances, BD_UNIT_INSTANCES);

vec3 instance_rows_mul(uint instance, uint first_row, vec4 v)
{
    uint at = instance * BD_INSTANCE_VEC4S + first_row;
    return vec3(dot(BD_LOAD(instances, at), v), dot(BD_LOAD(instances, at + 1u), v),
                dot(BD_LOAD(instances, at + 2u), v));
}

vec3 view_from_mesh_position(uint instance, vec3 position)
{
    return instance_rows_mul(instance, 0u, vec4(position, 1.0));
}

vec3 render_from_mesh_normal(uint instance, vec3 normal)
{
    return instance_rows_mul(instance, 3u, vec4(normal, 0.0));
}
