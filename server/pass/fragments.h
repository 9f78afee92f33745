// The list of fragments: the blocks that are lit as a whole, so that every pixel that can be lit is
// lit by exactly one of them (algorithms.md A1 refinement, A2.1 classification).
//
// Block B of level k is a fragment if it is not empty, is smooth (or k the finest level, which is 0
// unless the settings say otherwise), and its parent is discontinuous (or k is the coarsest level).
// These cover every pixel once.
//
// Lone pixels (bd_discontinuity_settings) are on top of that. In a discontinuous block of the
// finest level, a pixel that is of one surface (shaders/common/one_surface.glsl) neither with
// its block of the level above nor with three of the five around that, of which it would be
// interpolated, gets a fragment of its own, which
// takes the place of the block's there ("failed: recompute at full resolution", algorithms.md
// A0.8). So does a block of a level between. The finest fragment that a pixel lies in is the one
// that lights it.
//
// The list is ordered by level from the coarsest, in a
// level by rows of 8 x 8 tiles (neighbours in the list are neighbours in the picture), and is made
// by prefix sums: the same on every run and device.

#ifndef BD_PASS_FRAGMENTS_H
#define BD_PASS_FRAGMENTS_H

#include "pass/discontinuity.h"

enum bd_fragment_refinement {
    BD_REFINEMENT_ONE_PASS,  // every block decides for itself
    BD_REFINEMENT_ITERATIVE, // from the coarsest level, each pass splits what is discontinuous
};

struct bd_fragments {
    struct bd_multires_layout layout;
    // A bit for each block of each level, by half tiles (shared/fragments.h): whether it is one.
    struct bd_buf *masks;
    struct bd_buf *list; // uint32 BD_FRAGMENT_PACK each, `count` of them
    // On the host, read back once: slices and counts in the report need them.
    uint32_t count;
    uint32_t level_first[BD_MULTIRES_LEVEL_MAX], level_count[BD_MULTIRES_LEVEL_MAX];
    // Three uint32 group counts and one of 0, for an indirect dispatch of `count` invocations in
    // groups of 64: no more than 65535 groups in a row, so that a long list takes several rows, the
    // last of which reaches beyond it.
    struct bd_buf *dispatch;
};

// `gbuffer` tells which pixels of level 0 can be lit (rsm: which texels hold something).
BD_MUST_CHECK
enum bd_err bd_fragments_run(const struct bd_pass_context *context,
                             const struct bd_discontinuity_inputs *inputs,
                             const struct bd_discontinuity *discontinuity,
                             enum bd_fragment_refinement refinement, struct bd_fragments **out,
                             struct bd_err_detail *detail);

// Light of the blocks of a list, as bd_multires_light has it.
struct bd_light_of_blocks {
    struct bd_tex *irradiance, *vector; // of the levels from 1 on; a of the latter = its spread
};

// The next list, by light: all children with pixels to be lit of those fragments in `parents` whose
// spread of light is more than `threshold` of it, but for those that `first` has already. `parents`
// is `first`, the list that bd_fragments_run made, or the one that this made from it, and has more
// than pixels. Those are not split, so lists end after as many rounds as there are levels.
BD_MUST_CHECK
enum bd_err bd_fragments_refine(const struct bd_pass_context *context,
                                const struct bd_discontinuity_inputs *inputs,
                                const struct bd_discontinuity *discontinuity,
                                const struct bd_fragments *first,
                                const struct bd_fragments *parents,
                                const struct bd_light_of_blocks *light, double threshold,
                                struct bd_fragments **out, struct bd_err_detail *detail);
void bd_fragments_destroy(struct bd_gpu *gpu, struct bd_fragments **fragments);
uint64_t bd_fragments_bytes(const struct bd_fragments *fragments);

#endif
