// What every pass is given: the device and the slicer. A pass is one file: inputs in, a struct of
// textures or buffers out, which the caller owns and destroys with the pass's own destroy.

#ifndef BD_PASS_PASS_H
#define BD_PASS_PASS_H

#include "gpu/gpu.h"
#include "pass/slicer.h"

struct bd_pass_context {
    struct bd_gpu *gpu;
    struct bd_slicer *slicer;
};

#endif
