// How far off light may be that was gathered at one point of a block and is interpolated over it:
// an estimate, not a bound, and cheap enough to be summed with the light.
//
// Over a block of radius s at the distance r light of a VPL changes by parts of s / r. What is
// linear in that is interpolated rightly; the rest is its square, and what a horizon within the
// block cuts off: the VPL's, which a plane crosses unless both are parallel (so a lit wall has no
// say about itself), and the receiver's, where the block is no plane.
#include "common/pi.glsl"

struct light_spread {
    float sum;       // of the channels of irradiance
    float radius;    // of the block, render units
    float off_plane; // how far its surface leaves the plane of its normal, as a part of the radius
};

const float SPREAD_OF_SQUARE = 2.0;
const float SPREAD_OF_VPL_HORIZON = 0.5;
const float SPREAD_OF_OWN_HORIZON = 0.5;
// What is below this part of the light that VPLs would send without cosines does not count: it is
// next to nothing, and nothing in dark corners would ever be enough.
const float SPREAD_IGNORED = 0.002;

// `patch_of_vpl`: its normal, and the area in the kernel's denominator.
void add_spread(inout light_spread spread, vec3 n, vec3 to_vpl, float r2, vec4 patch_of_vpl,
                float flux)
{
    float near2 = spread.radius * spread.radius / (r2 + spread.radius * spread.radius);
    float near = sqrt(near2), inverse = inversesqrt(r2 + 1e-30);
    float here = dot(n, to_vpl) * inverse, there = -dot(patch_of_vpl.xyz, to_vpl) * inverse;
    float aslant = dot(patch_of_vpl.xyz, n);
    float turn = near * max(sqrt(max(1.0 - aslant * aslant, 0.0)), spread.off_plane);
    float part = SPREAD_OF_SQUARE * near2 * max(here, 0.0) * max(there + turn, 0.0);
    if (abs(there) < turn) part += SPREAD_OF_VPL_HORIZON * turn * max(here, 0.0);
    if (abs(here) < near * spread.off_plane)
        part += SPREAD_OF_OWN_HORIZON * near * spread.off_plane * max(there + near, 0.0);
    spread.sum += flux * (part - SPREAD_IGNORED) / (PI * r2 + patch_of_vpl.w);
}
