#include "frame/sub_frames.h"

#include <math.h>

#include "base/hash.h"
#include "lights/sequence.h"
#include "upload/viewpoint.h"

// The one of 20,000 scrambles that errs least about the parts of a pixel on either side of an edge:
// root mean squares over edges of all angles .20, .10, .053, .035, .022 and .013 with 2 to 64
// sub-frames, and .027 and .024 with 16 where edges are upright or level (R2, Roberts 2018: .067,
// .102 and .054).
#define SCRAMBLE 13715u

void bd_sub_frame_place(struct bd_viewpoint *viewpoint, uint32_t index)
{
    const struct bd_sequence sequence = bd_sequence_of(SCRAMBLE, 0);
    float first[2], own[2];
    bd_sequence_pair(&sequence, 0, first);
    bd_sequence_pair(&sequence, index, own);
    viewpoint->sub_frame = index;
    viewpoint->sample_x_px = fmod(1.5 + own[0] - first[0], 1);
    viewpoint->sample_y_px = fmod(1.5 + own[1] - first[1], 1);
}

uint64_t bd_seed_of_round(uint64_t seed, uint32_t round)
{
    return round ? bd_hash64(&round, sizeof round, seed) : seed;
}
