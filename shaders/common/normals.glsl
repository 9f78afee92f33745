// Unit vectors by the octahedral map: in 32 bits, to about 3e-5 rad, where a virtual light's normal
// needs no more; in 64 bits where light is reflected by them, or a highlight changes with the way
// that the axes happen to lie.
#include "kernel/octahedral.h"

vec2 octahedral_from_unit(vec3 n)
{
    n /= abs(n.x) + abs(n.y) + abs(n.z);
    vec2 folded = (1.0 - abs(n.yx)) * vec2(n.x >= 0.0 ? 1.0 : -1.0, n.y >= 0.0 ? 1.0 : -1.0);
    return n.z >= 0.0 ? n.xy : folded;
}

vec3 unit_from_octahedral(vec2 e) { return unit_of_octahedral(e.x, e.y); }

// x = shading normal, y = geometric normal.
uvec2 pack_normals(vec3 shading, vec3 geometric)
{
    return uvec2(packSnorm2x16(octahedral_from_unit(shading)),
                 packSnorm2x16(octahedral_from_unit(geometric)));
}

vec3 unpack_normal(uint packed_normal)
{
    return unit_from_octahedral(unpackSnorm2x16(packed_normal));
}

// xy = shading normal, zw = geometric normal.
uvec4 pack_normals_precisely(vec3 shading, vec3 geometric)
{
    return floatBitsToUint(vec4(octahedral_from_unit(shading), octahedral_from_unit(geometric)));
}

vec3 unpack_precise_normal(uvec2 packed_normal)
{
    return unit_from_octahedral(uintBitsToFloat(packed_normal));
}
