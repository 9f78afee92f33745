// Visibility: which of a buffer's segments are blocked (rays/rays.h). One question for all who
// gather; what they do with the answer is theirs. Asked of the device where the occluders lie
// there, and of the processor otherwise: answers differ only where a segment passes within rounding
// of a triangle's edge. Segments to VPLs may be asked of imperfect shadow maps instead, or of
// nothing; all of them of environment maps.
//
// Cost: a ray a segment, some 10 to 40 M a second on two cores.
// Wald, Woop, Benthin, Johnson, Ernst 2014 (Embree).
//
// Thread: render thread, and the pool's.

#ifndef BD_PASS_VISIBILITY_H
#define BD_PASS_VISIBILITY_H

#include "lights/solids.h"
#include "pass/env_rays.h"
#include "pass/imperfect_shadows.h"
#include "pass/occluders.h"
#include "pass/pass.h"
#include "pass/ray_walks.h"

struct bd_visibility_inputs {
    const struct bd_occluders *occluders; // NULL where maps answer, or nothing hides
    struct bd_pool *pool;                 // of the processor's threads
    enum bd_rays_alpha alpha;
    const struct bd_imperfect_view *maps; // NULL: rays
    const struct bd_env_view *images;     // what rays ask instead of triangles; NULL: those
    bool nothing_hides;                   // no answer is yes
    // Of who looks for lights (pass/straight.h): where glass is, through which of it they look, and
    // whether through what blends, as far as it is not opaque.
    const struct bd_surface_hits *panes; // NULL: through none
    enum bd_straight straight;
    bool veils;
    // Who asks for an answer alone is told that such a segment is free as often as light passes it,
    // by a hash of the segment.
    bool by_chance;
};

// Whether who looks for lights looks through anything, and what hides those at first.
static inline bool bd_visibility_looks_through(const struct bd_visibility_inputs *inputs)
{
    return inputs->panes || inputs->veils;
}
static inline enum bd_rays_alpha
bd_visibility_alpha_of_lights(const struct bd_visibility_inputs *inputs)
{
    return inputs->veils ? BD_RAYS_ALPHA_ANY : inputs->alpha;
}

// Whether the processor answers by itself: what is for its loops has not to go by the device.
bool bd_visibility_is_native(const struct bd_visibility_inputs *inputs);

// Segments of a slice and their answers. Segments whose ends are one point ask nothing and are not
// blocked.
struct bd_segments {
    struct bd_buf *segments; // shared/rays.h
    struct bd_buf *occluded; // a bit each, 32 a word
    size_t count_max;        // a multiple of 32
    struct bd_ray_counts traced;
    // What processor and device work with, each from the first time on that it is asked.
    struct bd_segment *host;
    uint32_t *host_bits;
    struct bd_ray_walks walks;
};

// Of the buffer of segments: a slice of any picture's.
#define BD_SEGMENTS_BYTES_MAX ((size_t)64 << 20)
#define BD_SEGMENTS_MAX       (BD_SEGMENTS_BYTES_MAX / sizeof(struct bd_segment))

BD_MUST_CHECK
enum bd_err bd_segments_create(struct bd_gpu *gpu, size_t count_max, struct bd_segments **out,
                               struct bd_err_detail *detail);
void bd_segments_destroy(struct bd_gpu *gpu, struct bd_segments **segments);

// Answers segments in memory, any number of them: a bit each, words of `occluded`; in slices of
// their own.
BD_MUST_CHECK
enum bd_err bd_visibility_ask(const struct bd_pass_context *context,
                              const struct bd_visibility_inputs *inputs,
                              const struct bd_segment *segments, size_t count, uint32_t *occluded,
                              struct bd_ray_counts *traced, struct bd_err_detail *detail);
// Answers the first `count`, in slices of their own.
BD_MUST_CHECK
enum bd_err bd_visibility_run(const struct bd_pass_context *context,
                              const struct bd_visibility_inputs *inputs,
                              struct bd_segments *segments, size_t count,
                              struct bd_err_detail *detail);

#endif
