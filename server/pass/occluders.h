// Occluders: the triangles of a snapshot, for one of the two who may be asked what lies between two
// points (pass/visibility.h). The processor has Embree's structure, the device a tree of its own.
//
// Thread: render thread.

#ifndef BD_PASS_OCCLUDERS_H
#define BD_PASS_OCCLUDERS_H

#include "pass/pass.h"
#include "rays/nodes.h"
#include "rays/rays.h"

enum bd_rays_executor {
    BD_RAYS_AUTO, // the device, unless that is software: there the processor is faster
    BD_RAYS_PROCESSOR,
    BD_RAYS_DEVICE,
};

struct bd_occluders {
    struct bd_rays *rays;             // of the processor; NULL: the device is asked
    struct bd_buf *nodes, *triangles; // shared/rays.h
    struct bd_buf *cutouts, *texels;  // NULL where all is opaque
    uint32_t node_count, cutout_triangles;
};

// Whether the device is to be asked, if the scene can be (rays/nodes.h).
bool bd_occluders_on_device(const struct bd_gpu *gpu, enum bd_rays_executor executor);

// Takes the structure over.
struct bd_occluders *bd_occluders_of_rays(struct bd_rays **rays);
// In slices of their own.
BD_MUST_CHECK
enum bd_err bd_occluders_upload(const struct bd_pass_context *context,
                                const struct bd_ray_nodes *nodes, struct bd_occluders **out,
                                struct bd_err_detail *detail);
void bd_occluders_destroy(struct bd_gpu *gpu, struct bd_occluders **occluders);
uint64_t bd_occluders_bytes(const struct bd_occluders *occluders);

#endif
