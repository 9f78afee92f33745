// Gather over cuts of trees of VPLs, one cut a receiver: each takes a node of a tree for one light
// where that is good enough, and looks further down where not (Nichols, Shopf and Wyman 2009, 3.5;
// algorithms.md A2.4). Demodulated irradiance, without visibility.
//
// An inner node is a point with the flux of its leaves, held to the most that they can send: by the
// disk of their summed area, which is too dark off its axis, the error is four times as large.
//
// tau = 0 visits every leaf that can be seen: the flat gather to rounding. Both tau and what it is
// compared with scale with the light, and every length with the scene: neither changes the cut.

#ifndef BD_PASS_GATHER_TREE_H
#define BD_PASS_GATHER_TREE_H

#include "pass/gather_fragments.h"
#include "pass/vpl_tree.h"

enum bd_tree_criterion {
    // Most minus least of what the node's leaves can send the receiver together is above tau times
    // what the roots of all trees by themselves send it. Less than BD_TREE_ESTIMATE_MIN of the
    // frame's mean irradiance counts as that much.
    BD_TREE_LIGHTCUTS,
    // The most that they can send is above tau times the frame's mean irradiance: the flux of all
    // lights over 4 pi R^2, R the radius of the sphere that holds the scene.
    BD_TREE_BOUND,
    // Eqs. 7 and 8 corrected (errata N3, N4): what a block of the map at the node's level could
    // send from the node's place, if it lay square to the light and was white, is above the same.
    BD_TREE_LEVEL,
    // Eqs. 4 to 8 as printed, sums as well as criterion; tau in units of the light's intensity.
    BD_TREE_PRINTED,
};

#define BD_TREE_ESTIMATE_MIN 1e-3
// Leaves along a root's side, at most (llvmpipe ends an invocation's loops after 65,535 rounds).
#define BD_TREE_ROOT_LEAVES_MAX 64u

struct bd_gather_tree_inputs {
    const struct bd_gpu_scene *scene;
    const struct bd_viewpoint *viewpoint;
    const struct bd_gbuffer *gbuffer;
    // One a light, in the order that they are summed in; the leaves that each tree was built from.
    const struct bd_vpl_tree *const *trees;
    const struct bd_vpl_list *const *leaves;
    uint32_t tree_count;
    enum bd_tree_criterion criterion;
    double tau;
    bool near_patches; // some VPL asks for the exact near field
    bool glossy;       // of pixels: receivers have a specular lobe worth its price
    // Of fragments:
    const struct bd_discontinuity *discontinuity;
    const struct bd_fragments *fragments;
    bool vector; // the irradiance vector, too (surface detail)
    // With vectors: how far off interpolated light may be (shaders/common/light_spread.glsl), too.
    bool spread;
    uint32_t finest_level;          // whose blocks, and those below, may hold several surfaces
    struct bd_multires_light *into; // NULL, or earlier light that these fragments are added to
    const struct bd_visibility_inputs *visibility; // of leaves that are chosen (pass/choose_tree.h)
};

// At every pixel.
BD_MUST_CHECK
enum bd_err bd_gather_tree_run(const struct bd_pass_context *context,
                               const struct bd_gather_tree_inputs *inputs, struct bd_indirect **out,
                               struct bd_err_detail *detail);
// At fragments.
BD_MUST_CHECK
enum bd_err bd_gather_tree_fragments_run(const struct bd_pass_context *context,
                                         const struct bd_gather_tree_inputs *inputs,
                                         struct bd_multires_light **out,
                                         struct bd_err_detail *detail);

#endif
