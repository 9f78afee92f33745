// The sub-frames of an antialiased frame: where they look through each pixel, and whose random
// numbers they share.
//
// Thread: any.

#ifndef BD_FRAME_SUB_FRAMES_H
#define BD_FRAME_SUB_FRAMES_H

#include <stdbool.h>
#include <stdint.h>

struct bd_viewpoint; // upload/viewpoint.h

// Moves the viewpoint's samples to a sub-frame's place in the pixel: the first looks through its
// centre, as a frame of one does, and each power of two of them is spread as evenly as may be, so
// that a frame goes on where one of fewer ended. Sobol's points, scrambled (lights/sequence.h).
void bd_sub_frame_place(struct bd_viewpoint *viewpoint, uint32_t index);

// A *round*: so many sub-frames have what is decided by chance in common, above all the light that
// the first of them gathers and the others take over. The next round draws all of it anew. So more
// and more sub-frames go to the truth in light, too, not at edges alone.
#define BD_SUB_FRAMES_OF_ROUND 64u

static inline uint32_t bd_round_of(uint32_t sub_frame)
{
    return sub_frame / BD_SUB_FRAMES_OF_ROUND;
}

static inline bool bd_begins_round(uint32_t sub_frame)
{
    return sub_frame % BD_SUB_FRAMES_OF_ROUND == 0;
}

// The first round's seed is the request's own.
uint64_t bd_seed_of_round(uint64_t seed, uint32_t round);

#endif
