// Slices: long passes are cut into pieces of about 20 ms, so that cancel, deadlines and other
// clients get their turn, and no driver's watchdog fires (architecture.md, A frame).
//
// A pass asks how many rows fit into a slice at its own cost a row, records them, and calls the
// checkpoint. The slicer learns the device's speed as it goes; slices never change the result.
//
// Thread: render thread.

#ifndef BD_PASS_SLICER_H
#define BD_PASS_SLICER_H

#include <stdint.h>

#include "base/err.h"
#include "gpu/gpu.h"

struct bd_slicer {
    struct bd_gpu *gpu;
    // BD_ERR_OK to go on; BD_ERR_CANCELLED or BD_ERR_DEADLINE to stop. May be NULL.
    enum bd_err (*should_stop)(void *user);
    void *user;
    double units_per_ms; // learnt
    uint64_t slice_start_ns;
    uint32_t slice_count;
};

void bd_slicer_init(struct bd_slicer *slicer, struct bd_gpu *gpu,
                    enum bd_err (*should_stop)(void *user), void *user);

// Units of work that make one slice at the speed known so far.
double bd_slicer_units(const struct bd_slicer *slicer);

// How many rows of `units_per_row` fit into one slice; at least 8 (a row of work groups), at most
// `rows_left`. A unit is one light-receiver evaluation or its like.
uint32_t bd_slicer_rows(struct bd_slicer *slicer, double units_per_row, uint32_t rows_left);

// Ends a slice in which `units` of work were recorded: waits for it, then asks whether to stop.
BD_MUST_CHECK
enum bd_err bd_slicer_checkpoint(struct bd_slicer *slicer, double units);

#endif
