// The spread of light (kernel/light_spread.h) over the block of a receiver, summed over VPLs.
#include "kernel/light_spread.h"

struct light_spread {
    float sum;       // of the channels of irradiance
    float radius;    // of the block, render units
    float off_plane; // how far its surface leaves the plane of its normal, as a part of the radius
};

// `patch_of_vpl`: its normal, and the area in the kernel's denominator.
void add_spread(inout light_spread spread, vec3 n, vec3 to_vpl, float r2, vec4 patch_of_vpl,
                float flux)
{
    spread.sum += spread_of_vpl(spread.radius, spread.off_plane, n, to_vpl, r2, patch_of_vpl.xyz,
                                patch_of_vpl.w, flux);
}
