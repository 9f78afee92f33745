// Where the sub-frames of an antialiased frame look through each pixel.
//
// Thread: any.

#ifndef BD_FRAME_SUB_FRAMES_H
#define BD_FRAME_SUB_FRAMES_H

#include <stdint.h>

#include "upload/viewpoint.h"

// Moves the viewpoint's samples to a sub-frame's place in the pixel: the first looks through its
// centre, as a frame of one does, and each power of two of them is spread as evenly as may be, so
// that a frame goes on where one of fewer ended. Sobol's points, scrambled (lights/sequence.h).
void bd_sub_frame_place(struct bd_viewpoint *viewpoint, uint32_t index);

#endif
