// A tree over many emitters, triangles or punctual lights, from which some are drawn about in
// proportion to what they may send to a receiver. A cut of it is made for the receiver, finer where
// what is below a node is near; a node of the cut is drawn, and from there a leaf, by the flux of
// both sides, how far away they are, how high above the receiver's horizon, and how far they turn
// away from it.
//
// Balanced, halved along the longest axis, so that a place in the order says the way to a leaf.
// Estevez and Kulla 2018 (sampling of many lights).
//
// Memory: 112 bytes an emitter. Thread: built on one, then read by all.

#ifndef BD_LIGHTS_EMITTER_TREE_H
#define BD_LIGHTS_EMITTER_TREE_H

#include <stdbool.h>
#include <stdint.h>

#include "base/err.h"
#include "kernel/math.h"

// Of leaves begin to end: its first half's node is the next one, its other half's behind all of
// that.
struct bd_emitter_node {
    f3 least, most; // of their corners
    float flux;
    float radius; // of the ball about their box
    // A cone that holds all their normals: its axis, and the cosine and sine of its half angle.
    f3 axis;
    float spread_cos, spread_sin;
};

// Of what shines from both of its sides, or to all.
static inline struct bd_emitter_node bd_emitter_to_all_sides(f3 least, f3 most, float flux)
{
    return (struct bd_emitter_node){.least = least,
                                    .most = most,
                                    .flux = flux,
                                    .radius = 0.5f * f3_length(f3_sub(most, least)),
                                    .axis = f3_of(0, 0, 1),
                                    .spread_cos = -1};
}

struct bd_emitter_tree {
    uint32_t count;                // of leaves; 2 count - 1 nodes
    struct bd_emitter_node *nodes; // NULL: no tree
    uint32_t *order;               // the emitter of each leaf
    uint32_t *place;               // the leaf of each emitter
};

// An emitter: its box, the place that it is sorted by, and its flux.
struct bd_emitter_leaf {
    struct bd_emitter_node node;
    f3 middle;
};

// BD_ERR_NO_MEMORY, or what `pause` returns (lights/area_lights.h).
BD_MUST_CHECK
enum bd_err bd_emitter_tree_init(struct bd_emitter_tree *tree, const struct bd_emitter_leaf *leaves,
                                 uint32_t count, enum bd_err (*pause)(void *user), void *user,
                                 struct bd_err_detail *detail);
void bd_emitter_tree_finish(struct bd_emitter_tree *tree);

// Nodes below which every emitter is once, but for those under the horizon.
#define BD_EMITTER_CUT_MAX 32u
struct bd_emitter_cut {
    uint32_t count;
    struct {
        uint32_t node, begin, end; // leaves
        float weight, nearest;     // what is drawn by, what is split by
    } nodes[BD_EMITTER_CUT_MAX];
    float weight; // together
};
void bd_emitter_tree_cut(const struct bd_emitter_tree *tree, f3 point, f3 normal,
                         struct bd_emitter_cut *cut);

// The emitter that a number in [0, 1) draws for the cut's receiver, and its pdf; false where all
// below a node lie under the horizon or turn away.
bool bd_emitter_tree_draw(const struct bd_emitter_tree *tree, const struct bd_emitter_cut *cut,
                          f3 point, f3 normal, float number, uint32_t *light, float *pdf);
// The pdf of an emitter.
float bd_emitter_tree_pdf(const struct bd_emitter_tree *tree, const struct bd_emitter_cut *cut,
                          f3 point, f3 normal, uint32_t light);

#endif
