// What every pass is given: the device and the slicer. A pass is one file: inputs in, a struct of
// textures or buffers out, which the caller owns and destroys with the pass's own destroy.

#ifndef BD_PASS_PASS_H
#define BD_PASS_PASS_H

#include "base/pool.h"
#include "gpu/gpu.h"
#include "pass/native/native.h"
#include "pass/slicer.h"

// Who does the arithmetic instead of a software device.
struct bd_processor {
    struct bd_pool *pool;
    const struct bd_native_loops *loops;
};

struct bd_pass_context {
    struct bd_gpu *gpu;
    struct bd_slicer *slicer;
    const struct bd_processor *processor; // NULL: the device
};

#endif
