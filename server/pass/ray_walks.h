// Walks of a device through the triangles of a snapshot: one for each of a buffer's segments or
// rays, as often as it takes until all have ended.
//
// Shoemake 1998 (Pluecker coordinates); Smits 1998 (walks without a stack).
//
// Thread: render thread.

#ifndef BD_PASS_RAY_WALKS_H
#define BD_PASS_RAY_WALKS_H

#include "pass/occluders.h"
#include "pass/pass.h"

enum bd_ray_question { BD_RAY_QUESTION_OCCLUDED, BD_RAY_QUESTION_NEAREST };

// So far, without what others took in between.
struct bd_ray_counts {
    uint64_t count;
    double ms;
};

static inline void bd_ray_counts_add(struct bd_ray_counts *sum, struct bd_ray_counts more)
{
    sum->count += more.count;
    sum->ms += more.ms;
}

// What walks keep from one dispatch to the next: all zeroes before the first.
struct bd_ray_walks {
    struct bd_buf *places, *counts;
};

struct bd_ray_walks_inputs {
    enum bd_ray_question question;
    const struct bd_occluders *occluders; // on the device
    enum bd_rays_alpha alpha;
    struct bd_buf *asked, *answers; // shared/rays.h
    size_t count, count_max;        // of them: now, and in any later call
};

// In slices of their own.
BD_MUST_CHECK
enum bd_err bd_ray_walks_run(const struct bd_pass_context *context,
                             const struct bd_ray_walks_inputs *inputs, struct bd_ray_walks *walks,
                             struct bd_ray_counts *traced, struct bd_err_detail *detail);
void bd_ray_walks_finish(struct bd_gpu *gpu, struct bd_ray_walks *walks);

// Segments or rays of the next slice of their kind: all that are left, or a multiple of 64.
size_t bd_rays_of_slice(const struct bd_slicer *slicer, size_t left);

#endif
