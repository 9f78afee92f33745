// Walks over cuts of trees of VPLs, a round at a time (shaders/common/tree_walk.glsl): what all who
// take cuts share on the host, whatever they do at a node.
//
// Private to pass/.

#ifndef BD_PASS_TREE_WALK_H
#define BD_PASS_TREE_WALK_H

#include "pass/gather_tree.h"
#include "shared/gather_tree.h"

// Some of a tree's roots: a round of all of them, or a part of the estimate by them.
struct bd_tree_roots {
    uint32_t light, first, count;
    bool estimate;
    bool goes_on; // from where the round before ended
    bool anew;    // nothing was added yet
};

struct bd_tree_walk {
    const struct bd_gather_tree_inputs *inputs;
    double mean_irradiance; // of the frame
    // A word, the last round that some receiver did not finish in; then where each is to go on.
    struct bd_buf *next_roots;
    struct bd_buf *estimates; // a word a receiver
    uint32_t round;           // counted over all lights, from 1
};

// Without buffers: for bd_tree_walk_args alone.
struct bd_tree_walk bd_tree_walk_of(const struct bd_gather_tree_inputs *inputs);
// Of all faces.
uint32_t bd_tree_root_count(const struct bd_vpl_tree *tree);
// Buffers for so many receivers.
BD_MUST_CHECK
enum bd_err bd_tree_walk_begin(struct bd_gpu *gpu, const struct bd_gather_tree_inputs *inputs,
                               size_t receivers, struct bd_tree_walk *out,
                               struct bd_err_detail *detail);
void bd_tree_walk_end(struct bd_gpu *gpu, struct bd_tree_walk *walk);

// What is bound for some roots. `args` are bd_gather_tree_args.
struct bd_gather_tree_args bd_tree_walk_args(const struct bd_tree_walk *walk,
                                             const struct bd_tree_roots *roots);
void bd_tree_walk_bind(const struct bd_tree_walk *walk, const struct bd_tree_roots *roots,
                       const struct bd_gather_tree_args *args, struct bd_bindings *bindings);

// Has the roots gone through at all receivers.
typedef enum bd_err bd_tree_roots_fn(void *user, const struct bd_tree_roots *roots);

// Of all lights, where the criterion asks for estimates.
BD_MUST_CHECK
enum bd_err bd_tree_walk_estimate(struct bd_tree_walk *walk, bd_tree_roots_fn *visit, void *user);
// Rounds until each receiver has been through the light's tree: one, unless tau is very small.
BD_MUST_CHECK
enum bd_err bd_tree_walk_light(struct bd_gpu *gpu, struct bd_tree_walk *walk, uint32_t light,
                               bd_tree_roots_fn *visit, void *user);

#endif
