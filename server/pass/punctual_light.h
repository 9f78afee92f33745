// Light of many punctual lights at receivers, by rays: each asks about as many punctual lights as
// it has rays, and where no more can light it than those, about each of them, so that nothing is
// left to chance. Private to pass/.
//
// Of more, those that would give most if nothing stood between are asked for sure; of the others
// each half of the rays draws some in even steps through what is left (inclusion in proportion to
// size), and what is drawn stands for the rest. Both halves have what is sure. Unbiased.
//
// Receivers come in blocks that lie together: lights/punctual_tree.h finds once who may light a
// block.
//
// Thread: any.

#ifndef BD_PASS_PUNCTUAL_LIGHT_H
#define BD_PASS_PUNCTUAL_LIGHT_H

#include "lights/punctual_tree.h"
#include "pass/area_samples.h"
#include "pass/visibility.h"

#define BD_PUNCTUAL_BLOCK 64u // receivers, at most

struct bd_punctual_light {
    const struct bd_punctual_tree *punctuals;
    const struct bd_visibility_inputs *visibility; // of the processor
    uint32_t rays; // of a receiver, at least 2
    bool lambert;
    uint32_t seed;
};

// Adds what arrives at each receiver to its halves. Of `at` positions, surfaces, `triangle` and
// `place` are read.
void bd_punctual_light_block(const struct bd_punctual_light *light,
                             const struct bd_area_receiver *at, uint32_t count,
                             struct bd_area_light_found (*halves)[2]);

#endif
