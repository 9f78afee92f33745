// Rays through texels of a place's map (kernel/projected_point.h): half by the most that a texel or
// one of the eight about it gives, for what is bright next to it may lie where it is; half by how
// large it is, so that everything is looked at.
//
// Each texel draws by a number of its own whether it has one more than its whole ones, and numbers
// of neighbours are spread evenly: so rays are, too, and where one texel changes others keep theirs
// (Roberts 2018, the sequence R2).
#ifndef BD_KERNEL_MAP_RAYS_H
#define BD_KERNEL_MAP_RAYS_H

#include "kernel/stirred.h"

// Rays of a texel in the mean, of so many of a place: `size` of it under the place's normal, and
// `about` what is given there; and the sums of all.
KERNEL float rays_of_texel(uint rays, float size, float all_sizes, float about, float all_about)
{
    float by_size = size / f_max(all_sizes, 1e-37f), by_light = about / f_max(all_about, 1e-37f);
    return 0.5f * f_of(rays) * (by_size + by_light);
}

// One of a place's, by its chance.
KERNEL float first_of_map(uint chance)
{
    return part_of_one(stirred(chance ^ 0x6d726179u));
}

KERNEL uint drawn_of_texel(float rays, uint u, uint v, float first)
{
    float number = first + f_of(u) * 0.75487767f + f_of(v) * 0.56984029f;
    return u_of(rays + (number - f_floor(number)));
}

#endif
