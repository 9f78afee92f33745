// What a list of VPLs sends to points of surfaces, in double precision: the sum that technique
// `rsm` forms (vpl_kernel=patch or disk, brdf=lambert), worked out from the same VPLs by other
// code.
//
// The kernel is that of shaders/common/vpl_gather.glsl: Wallace's disk-to-point form, nearer than a
// VPL's own limit the exact form factor of its parallelogram above the receiver's horizon, nothing
// in either's plane.
//
// Any thread.

#ifndef BD_TESTS_BENCH_VPL_SUM_H
#define BD_TESTS_BENCH_VPL_SUM_H

#include <stddef.h>
#include <stdint.h>

// By component, so that several are worked out at once. Those without flux are left out.
struct vpl_set {
    size_t count, capacity;
    float *position[3], *normal[3], *flux[3]; // render space and light unit
    float *area, *near2;                      // shared/vpl.h
    float (*quads)[8];                        // as on the device
};

struct vpl_receiver {
    double position[3], normal[3], normal_geometric[3];
};

// `vpls` and `quads` as read back from the device.
void vpl_set_append(struct vpl_set *set, const float *vpls, const float *quads, size_t count);
void vpl_set_finish(struct vpl_set *set);

// Irradiance at so many receivers; VPLs are walked once for all of them.
void vpl_sum(const struct vpl_set *set, const struct vpl_receiver *receivers, uint32_t count,
             double (*irradiance)[3]);

// Form factor from a point with unit normal n to the parallelogram centre +- u +- v, all relative
// to the point, clipped to the point's horizon.
double vpl_patch_form_factor(const double centre[3], const double u[3], const double v[3],
                             const double n[3]);

#endif
