// Gather at fragments: each sums every VPL at the point that stands for its block (Nichols, Shopf
// and Wyman 2009, 3.2; algorithms.md A2.2). Demodulated irradiance; without visibility, or of the
// VPLs that the fragment sees.
//
// That point is the block's centre, between the pixels around it, or where those are not one
// surface the pixel that stands for the block. With the irradiance vector, blocks are lit for their
// geometric normal.
//
// Two ways to visit the same fragments, with the same sums to rounding: the compacted list, in
// compute; and the paper's, a triangle over all blocks behind a mask that rejects what is no
// fragment before its shader runs.

#ifndef BD_PASS_GATHER_FRAGMENTS_H
#define BD_PASS_GATHER_FRAGMENTS_H

#include "pass/fragments.h"
#include "pass/gather.h"

enum bd_fragment_visit { BD_FRAGMENT_VISIT_LIST, BD_FRAGMENT_VISIT_MASK };

struct bd_gather_fragments_inputs {
    const struct bd_gpu_scene *scene;
    const struct bd_viewpoint *viewpoint;
    const struct bd_gbuffer *gbuffer;
    const struct bd_discontinuity *discontinuity;
    const struct bd_fragments *fragments;
    const struct bd_vpl_list *const *lists; // one a light, in the order that they are summed in
    uint32_t list_count;
    bool near_patches; // some VPL asks for the exact near field
    bool vector;       // the irradiance vector, too (surface detail)
    enum bd_fragment_visit visit;
    // With vectors: how far off interpolated light may be (shaders/common/light_spread.glsl), too.
    bool spread;
    const struct bd_visibility_inputs *visibility; // NULL: nothing hides any; else visit by list
    uint32_t finest_level;          // whose blocks, and those below, may hold several surfaces
    struct bd_multires_light *into; // NULL, or earlier light that these fragments are added to
};

// Whose vectors a multiresolution light has: pixels' are asked for where blocks are split into
// them, and light is interpolated from theirs.
enum bd_light_vectors {
    BD_LIGHT_VECTORS_NONE,
    BD_LIGHT_VECTORS_OF_BLOCKS,
    BD_LIGHT_VECTORS_ALL,
};

// Light at fragments, as a multiresolution image (shared/multires.h). a = 1 where a fragment is.
struct bd_multires_light {
    struct bd_multires_layout layout;
    // RGBA32F: irradiance in the frame's light unit; level 0, the rest.
    struct bd_tex *fine, *coarse;
    // RGBA32F or NULL: the irradiance vector, of all channels together: its dot product with the
    // fragment's normal is the sum of its irradiance. a of the latter = the spread of light, if
    // asked for.
    struct bd_tex *fine_vector, *coarse_vector;
    // RGBA32F or NULL: half the difference of the halves whose mean the light is.
    struct bd_tex *fine_noise, *coarse_noise;
    struct bd_ray_counts rays; // that were traced for it so far
};

// Its fragments, as those who ask what they see.
struct bd_askers bd_fragment_askers(const struct bd_gather_fragments_inputs *inputs);
// Whose vectors such a light has.
enum bd_light_vectors bd_fragment_vectors(const struct bd_gather_fragments_inputs *inputs);

BD_MUST_CHECK
enum bd_err bd_gather_fragments_run(const struct bd_pass_context *context,
                                    const struct bd_gather_fragments_inputs *inputs,
                                    struct bd_multires_light **out, struct bd_err_detail *detail);
// All textures of a multiresolution light, cleared to no data: for whoever fills it.
BD_MUST_CHECK
enum bd_err bd_multires_light_create(struct bd_gpu *gpu, const struct bd_multires_layout *layout,
                                     enum bd_light_vectors vectors, struct bd_multires_light **out,
                                     struct bd_err_detail *detail);
// With textures for its noise, which it has not yet.
BD_MUST_CHECK
enum bd_err bd_multires_light_add_noise(struct bd_gpu *gpu, struct bd_multires_light *light,
                                        struct bd_err_detail *detail);
// Its light at images 0 and 1, level 0 and the rest, and its vectors at 2 and 3, to be written.
void bd_multires_light_bind(const void *light, struct bd_bindings *bindings);
void bd_multires_light_destroy(struct bd_gpu *gpu, struct bd_multires_light **light);

#endif
