// One face of a light's shadow map: which triangle is nearest, not only how near. `direct` tests
// the triangles themselves, so that no bias is needed at any scale.
#include "common/surface.glsl"

layout(location = 0) out uint out_triangle; // id + 1, BD_TRIANGLE_MASKED in bit 31

void main()
{
    out_triangle = triangle_id() + 1u;
#ifdef BD_ALPHA_MASK
    discard_by_alpha(surface_base_color().a);
    out_triangle |= 0x80000000u;
#endif
}
