// Punctual lights, any number of them: a tree over all, from which those are found that may light
// some receivers, and drawn in about the proportion of what they would send if nothing stood
// between. What a punctual light gives a point is kernel/light.h's to say.
//
// A node knows a box around its punctual lights, a cone around all their directions, how far the
// farthest reaches, and how much they are. A cut is made for a box of receivers: what may light it
// most is split first, and what cannot reach it (its cones look elsewhere, its range ends before)
// is left out for good, so that of many spots the few remain that shine here.
//
// Estevez and Kulla 2018 (sampling of many lights); Walter et al. 2005 (cuts).
//
// Memory: 340 bytes a punctual light. Thread: built on one, then read by all.

#ifndef BD_LIGHTS_PUNCTUAL_TREE_H
#define BD_LIGHTS_PUNCTUAL_TREE_H

#include <stdbool.h>
#include <stdint.h>

#include "lights/emitter_tree.h"
#include "shared/light.h"

struct bd_punctual_bound {
    f3 middle, half;    // of their places' box
    float radius;       // about that
    f3 axis;            // of a cone that holds all directions in which they shine
    float cosine, sine; // of its half angle; -1: any direction; 2: none has a place (all parallel)
    float reach;        // of the farthest; may be INFINITY
    float even;         // irradiance of those that are parallel, brightest channel
};

struct bd_punctual_tree {
    uint32_t count;
    struct bd_light_uniform *punctuals; // in render space, the frame's unit
    struct bd_emitter_tree tree;        // flux: intensity of those with a place, brightest channel
    struct bd_punctual_bound *bounds;   // of each of its nodes
};

// Takes `punctuals` over, which is malloc's, whatever it returns; `count` > 0.
// BD_ERR_NO_MEMORY, or what `pause` returns (lights/area_lights.h).
BD_MUST_CHECK
enum bd_err bd_punctual_tree_create(struct bd_light_uniform *punctuals, uint32_t count,
                                    enum bd_err (*pause)(void *user), void *user,
                                    struct bd_punctual_tree **out, struct bd_err_detail *detail);
void bd_punctual_tree_destroy(struct bd_punctual_tree **punctuals);
uint64_t bd_punctual_tree_bytes(const struct bd_punctual_tree *punctuals);

// Nodes below which every punctual light is once that may light a box.
#define BD_PUNCTUAL_CUT_MAX 256u
struct bd_punctual_node {
    uint32_t node, begin, end; // leaves
    float most;                // what is split by
};
struct bd_punctual_cut {
    uint32_t count, punctual_count; // single punctual lights come first
    uint32_t below;                 // punctual lights of all nodes together
    struct bd_punctual_node nodes[BD_PUNCTUAL_CUT_MAX];
};
void bd_punctual_tree_cut(const struct bd_punctual_tree *punctuals, f3 least, f3 most,
                          struct bd_punctual_cut *cut);

// About what a node's punctual lights send to a receiver; 0 only where none of them can.
float bd_punctual_tree_weight(const struct bd_punctual_tree *punctuals, uint32_t node, f3 point,
                              f3 normal);
// The punctual light below a node that a number in [0, 1) draws, and its pdf; false where none can
// light the receiver.
bool bd_punctual_tree_draw(const struct bd_punctual_tree *punctuals,
                           const struct bd_punctual_node *below, f3 point, f3 normal, float number,
                           uint32_t *punctual, float *pdf);

#endif
