// Imperfect shadow maps: for each VPL, or a few neighbours of a list together, what it sees of the
// scene's points (pass/shadow_points.h), in one atlas. They answer whether a receiver sees a VPL
// without a ray (pass/visibility.h).
//
// Inexact by design: what is smaller than a texel or than points are apart hides by chance or not
// at all, and disks reach over edges. Errors of VPLs differ, and partly even out.
// Cost: a map of 8,192 points some .1 ms on two cores; an answer as much as a ray in a small scene.
//
// Ritschel, Grosch, Kim, Seidel, Dachsbacher, Kautz 2008; what stands for several VPLs: Dong,
// Grosch, Ritschel, Kautz, Seidel 2009.
//
// Thread: render thread, and the pool's.

#ifndef BD_PASS_IMPERFECT_SHADOWS_H
#define BD_PASS_IMPERFECT_SHADOWS_H

#include "pass/shadow_points.h"
#include "pass/vpl_grid.h"
#include "shared/rays.h"

struct bd_pool;

#define BD_SHADOW_MAPS_MAX       4096u
#define BD_SHADOW_MAP_SIDE_MIN   8u
#define BD_SHADOW_MAP_SIDE_MAX   256u
#define BD_SHADOW_MAPS_BYTES_MAX ((size_t)128 << 20)

// Side of a map of so many that all of them fit: `side` or half of it, or less.
uint32_t bd_shadow_map_side_of(uint32_t side, uint32_t map_count);

// A list's: VPL i has map first + i / vpls_each.
struct bd_shadow_maps_of_list {
    uint32_t first, vpls_each; // 0: none
};

struct bd_imperfect_shadows {
    uint32_t side_px, count, per_set;
    struct bd_shadow_maps_of_list *lists; // in the order in which lists were given
    uint32_t list_count;
    struct bd_shadow_centre *centres;
    uint32_t *maps;                     // keys of disks, map by map (kernel/imperfect_shadow.h)
    struct bd_buf *centre_buf, *texels; // the device's, where the processor has no loops
};

struct bd_imperfect_shadows_inputs {
    const struct bd_shadow_points *points;
    const struct bd_vpl_list *const *lists;
    uint32_t list_count;
    uint32_t side_px; // of a map, at most; BD_SHADOW_MAP_SIDE_MIN to _MAX
};

BD_MUST_CHECK
enum bd_err bd_imperfect_shadows_run(const struct bd_pass_context *context,
                                     const struct bd_imperfect_shadows_inputs *inputs,
                                     struct bd_imperfect_shadows **out,
                                     struct bd_err_detail *detail);
void bd_imperfect_shadows_destroy(struct bd_gpu *gpu, struct bd_imperfect_shadows **shadows);
uint64_t bd_imperfect_shadows_bytes(const struct bd_imperfect_shadows *shadows);

// --- answers ------------------------------------------------------------------------------------

struct bd_imperfect_view {
    const struct bd_imperfect_shadows *shadows;
    const struct bd_shadow_points *points;  // that they were made of
    const struct bd_vpl_list *const *lists; // for which they were made, in that order
    float bias;  // how steep a surface may fall off behind a point's plane and not hide itself
    bool filled; // where no point has come to lie, texels around are asked
};

// Of a list of those, what names a VPL's map in a segment's to_triangle, whose `to` then is the
// receiver's own normal; none of any other list.
struct bd_shadow_maps_of_list bd_imperfect_maps_of(const struct bd_imperfect_view *view,
                                                   const struct bd_vpl_list *list);

// Answers segments in memory, as bd_visibility_ask does, by the processor; and in buffers, by the
// device: `count` from 0 on, a multiple of 32 but for the last.
void bd_imperfect_ask(const struct bd_imperfect_view *view, struct bd_pool *pool,
                      const struct bd_segment *segments, size_t count, uint32_t *occluded);
BD_MUST_CHECK
enum bd_err bd_imperfect_ask_device(const struct bd_pass_context *context,
                                    const struct bd_imperfect_view *view, struct bd_buf *segments,
                                    struct bd_buf *occluded, size_t first, size_t count,
                                    struct bd_err_detail *detail);

#endif
