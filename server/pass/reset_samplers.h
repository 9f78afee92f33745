// A dispatch that leaves the same sampler behind in every texture unit.
//
// Mesa keeps a unit's last sampler when a buffer texture is bound there, and the software driver
// generates code for what it finds. Without this, a daemon's first frame finds nothing in the
// units of BD_ARRAY and every later one finds what `composite` left: `direct` and `gather` would
// be generated twice, the second time within a pass, a quarter of a second each daemon.
//
// Thread: render thread. Software devices only; a failure costs that time and nothing else.

#ifndef BD_PASS_RESET_SAMPLERS_H
#define BD_PASS_RESET_SAMPLERS_H

#include "gpu/gpu.h"

void bd_reset_samplers(struct bd_gpu *gpu);

#endif
