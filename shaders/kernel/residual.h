// What surfaces near a receiver give it beyond a clamped kernel: T_r of algorithms.md A3, from
// parts of the screen, a pixel or many together (shared/screen.h).
//
// G = cos cos / r^2 is clamped to b = `clamp`; what a part of area A sends beyond is
// (G - b)+ A per unit of radiance. `to` goes from the receiver to the part's middle.
#ifndef BD_KERNEL_RESIDUAL_H
#define BD_KERNEL_RESIDUAL_H

#include "kernel/vpl_light.h"

// Areas of grazing pixels are unsure, and count less and less beyond 80 degrees (A3: grazing).
#define GRAZING_COSINE 0.173648178f

KERNEL float part_of_grazing(float cosine)
{
    float degrees = f_angle(f_sqrt(f_max(1.0f - cosine * cosine, 0.0f)), cosine) * (180.0f / F_PI);
    float left = f_max(90.0f - degrees, 0.0f) * 0.1f;
    return f_select(cosine < GRAZING_COSINE, left * left, 1.0f);
}

// Irradiance of a unit of radiance, of a part as a point.
KERNEL float residual_light(f3 n, f3 n_geometric, f3 to, float r2, f3 normal, float area,
                            float clamp)
{
    float kernel = disk_kernel(f3_dot(n, to), -f3_dot(normal, to), f_max(r2, 1e-24f), 0.0f);
    float projected = F_PI * area * kernel;
    return f_select(see_each_other(n, n_geometric, to, r2, normal),
                    f_max(projected - clamp * area, 0.0f), 0.0f);
}

// Nearer than this, as a part of its area, squared, a pixel is the patch that it covers: across an
// edge the first row of pixels is 11 % too bright as points.
#define NEAR_PIXELS 16.0f

// Half a side of what a pixel covers: how far the ray to its middle moves over the surface when it
// turns by `step`. Where it grazes so far that the pixel's area is held, so is this.
KERNEL f3 side_of_pixel(f3 ray, f3 normal, f3 step)
{
    float along = f3_dot(ray, normal), least = GRAZING_COSINE * f3_length(ray);
    float down = f_select(along < 0.0f, f_min(along, -least), f_max(along, least));
    return f3_sub(step, f3_scale(ray, f3_dot(step, normal) / down));
}

// As printed, paper_mode: of its middle alone. (Of one below a horizon, that side up: else whoever
// is within a part that spans an edge would get nothing from it.)
KERNEL float most_as_printed(f3 n, f3 to, float r2, f3 normal)
{
    float cosines = f_abs(f3_dot(n, to) * f3_dot(normal, to));
    return cosines / f_max(r2 * r2, 1e-24f);
}

// How far the patch about `here` reaches along `half_side`, of it, where the next pixel's plane
// crosses its own: at a crease that is where both end, and each pixel's row begins there and not
// half a pixel off. 1 where the surfaces do not meet; at least REACH_LEAST.
#define REACH_LEAST 0.02f
KERNEL float reach_to_next(f3 here, f3 normal, f3 half_side, f3 next, f3 next_normal)
{
    f3 way = f3_sub(next, here);
    float above_next = -f3_dot(next_normal, way), above_here = f3_dot(normal, way);
    float falls = -f3_dot(next_normal, half_side);
    float reach = above_next / f_select(falls == 0.0f, 1.0f, falls);
    float length = f3_length(way);
    bool meet = b_and(above_next * above_here > 0.0f, reach > 0.0f);
    bool at_crease = b_and(f_abs(above_next) < 1e-4f * length, above_here > 1e-2f * length);
    return f_select(b_or(meet, at_crease), f_min(f_max(reach, REACH_LEAST), 2.0f), 1.0f);
}

// Along each side: a patch that is not small beside what the clamp reaches is taken in parts, each
// of which is below it, or not.
KERNEL uint parts_of_side(float area, float clamp)
{
    return u_of(f_min(10.0f * f_sqrt(area * clamp), 7.0f)) + 1u;
}

// The middle of one of them, in half sides.
KERNEL float middle_of_part(uint part, uint parts)
{
    return (2.0f * f_of(part) + 1.0f) / f_of(parts) - 1.0f;
}

// `to`, u and v of the patch; `part`: of it counts.
KERNEL float residual_patch(f3 n, f3 n_geometric, f3 to, f3 u, f3 v, float part, float area,
                            float clamp)
{
    float projected = F_PI * patch_light(n, n_geometric, to, f3_dot(to, to), u, v, part);
    return f_max(projected - clamp * area, 0.0f);
}

// Of a sum over parts, so that they are no more than a hemisphere together: surfaces behind one
// another count all, and would send more light than there is (hazard 52). `given`: of a radiance
// of 1.
KERNEL float part_of_hemisphere(float given)
{
    return F_PI / f_max(given, F_PI);
}

// Likewise of what a lobe reflects of a radiance of 1: parts that each are as wide as it overlap.
KERNEL float part_of_lobe(float reflected)
{
    return 1.0f / f_max(reflected, 1.0f);
}

// Whether its normals turn by more than some 25 degrees, or depth jumps.
KERNEL bool spans_edge(float radius, float thickness)
{
    return thickness > 0.2f * radius;
}

// The nearest that anything of a part may be, squared.
KERNEL float nearest_of_part(float r2, float radius)
{
    float nearest = f_max(f_sqrt(r2) - radius, 0.0f);
    return nearest * nearest;
}

// How much G may be at any place of the part: its cosines there at most, over the nearest distance.
// `thickness`: how far places of the part lie off the plane of its middle. A receiver in that plane
// gets nothing from a flat part, however near it is.
KERNEL float most_of_part(f3 n, f3 to, float r2, f3 normal, float radius, float thickness)
{
    float nearest2 = f_max(nearest_of_part(r2, radius), 1e-24f), r = f_sqrt(f_max(r2, 1e-24f));
    float height = -f3_dot(normal, to);
    float beside = f_select(is_above(height, r2), height, 0.0f) + thickness;
    float here = f_min(f_max((f3_dot(n, to) + radius) / r, 0.0f), 1.0f);
    float there = f_min(beside / r, 1.0f);
    return here * f_max(there, 0.0f) / nearest2;
}

#endif
