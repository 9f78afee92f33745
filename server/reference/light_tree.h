// Lights that have a place, in a tree, from which one is drawn by what it can give to a point.
//
// A node is a box around its lights, a cone around the directions they face, and their power. What
// it can give is estimated from these alone (Conty Estevez and Kulla 2018, Importance Sampling of
// Many Lights with Adaptive Tree Splitting): power / distance^2 x the cosines at both ends, were
// nothing in the way. A walk from the root takes one of two children at a time in proportion, with
// one random number that is stretched again after each step. The mean of 1/distance^2 over a box
// is taken as 1/(least x largest distance), which is exact for a row of lights that points at the
// receiver.
//
// - Only what can give nothing for sure has probability 0: boxes that lie behind the receiver or
//   that face away with all they hold, by more than their coordinates' rounding; punctual lights
//   that are out of range or cone. Everything else has at least BD_LIGHT_SHARE_MIN of its parent's,
//   so that a strong light behind a wall takes little from weak ones before it. Of punctual lights
//   a billion times weaker than a hidden one 32,768 samples still leave 30 %; by power alone none
//   would be found.
// - What it cannot know: a double-sided lamp that is closed (a sphere) hides half of its triangles
//   from every point. Model it single-sided.
// - The probabilities of all lights at a point add up to 1.
// - Without a receiver the choice is in proportion to power.
// - Memory: 96 bytes a light in nodes, 8 in its way from the root; punctual lights 16 more. Time to
// build:
//   n log n, on one thread, the same tree each time.
//
// Private to reference/. Built on one thread, then read by all.

#ifndef BD_REFERENCE_LIGHT_TREE_H
#define BD_REFERENCE_LIGHT_TREE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/err.h"

#define BD_LIGHT_SHARE_MIN 0x1p-7f

// 48 bytes. Reference space.
struct bd_light_node {
    float low[3], high[3];
    float axis[3];    // around which its lights face
    float cos_spread; // the least cosine of theirs to it; -1: any direction
    float power;      // of the tree's, which is 1; never 0
    uint32_t next;    // the first of two children, which are neighbours; of a leaf, its light
};

// Of a node of punctual lights: they shine within this of where they face, and so far.
struct bd_light_reach {
    float cosine, range;
};

struct bd_light_tree {
    uint32_t count; // lights; the root is node 0
    uint32_t node_count;
    struct bd_light_node *nodes;
    struct bd_light_reach
        *reach;     // of nodes of punctual lights; NULL: surfaces, which shine by the cosine
    uint64_t *ways; // of each light: bit k is the child taken at depth k; unset if it has no power
};

// A light to put in. Surfaces leave the last two out.
struct bd_tree_light {
    float low[3], high[3];
    float axis[3]; // unit, where it faces; zero: everywhere
    bool two_sided;
    double power; // 0: never drawn
    struct bd_light_reach reach;
};

// The light of that number, for building.
typedef struct bd_tree_light (*bd_tree_light_at)(const void *user, uint32_t index);

// At most 2^30 lights. `is_punctuals`: they have reaches, and do not shine by the cosine.
BD_MUST_CHECK
enum bd_err bd_light_tree_init(struct bd_light_tree *tree, uint32_t count, bool is_punctuals,
                               bd_tree_light_at at, const void *user, struct bd_err_detail *detail);
void bd_light_tree_finish(struct bd_light_tree *tree);
uint64_t bd_light_tree_bytes(const struct bd_light_tree *tree, uint32_t light_count);

// A point that looks for light. Unit normals on the side that light is scattered to.
struct bd_receiver {
    float position[3];
    float normal[3], normal_geometric[3]; // shading; geometric
    bool all_round;                       // light from behind is scattered, too
};

struct bd_light_draw {
    double u; // uniform in [0, 1), and so again when the light is drawn
    uint32_t light;
    float probability; // never 0
};

// One light for each number, which must ascend; `receiver` NULL: by power. What several numbers
// have in common of their ways is walked once. Not to be called without lights.
void bd_light_tree_choose(const struct bd_light_tree *tree, const struct bd_receiver *receiver,
                          uint32_t count, struct bd_light_draw *draws);
// With which bd_light_tree_choose chooses this light.
float bd_light_tree_probability(const struct bd_light_tree *tree,
                                const struct bd_receiver *receiver, uint32_t light);

#endif
