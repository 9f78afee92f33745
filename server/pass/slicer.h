// Slices: long passes are cut into pieces of about 6 ms, so that cancel, deadlines and other
// clients' frames get their turn, and no driver's watchdog fires (architecture.md, A frame).
//
// A pass names the kind of work that it does, asks how many rows fit into a slice at its own cost a
// row, records them, and calls the checkpoint. The slicer learns how fast the device is at each
// kind; slices never change the result. What is done on the host between two checkpoints counts to
// the slice, so loops over large data call the checkpoint too.
//
// Thread: render thread.

#ifndef BD_PASS_SLICER_H
#define BD_PASS_SLICER_H

#include <stdbool.h>
#include <stdint.h>

#include "base/err.h"
#include "gpu/gpu.h"

#define BD_SLICER_KIND_MAX 96

struct bd_slicer {
    struct bd_gpu *gpu;
    // BD_ERR_OK to go on; BD_ERR_CANCELLED or BD_ERR_DEADLINE to stop. May be NULL. Another frame
    // may be rendered in it (bd_renderer_suspend).
    enum bd_err (*should_stop)(void *user);
    void *user;
    uint32_t kind, kind_count;
    struct {
        const char *name;    // static
        double units_per_ms; // learnt
    } kinds[BD_SLICER_KIND_MAX];
    double forced_units; // of a slice, whatever is learnt: for tests. 0 = none
    uint64_t slice_start_ns;
    double slice_start_compile_ms;
    double last_share; // of a slice's time that the last one took
    uint32_t slice_count;
    // Without the compiling of programs, which nobody can cut.
    double longest_ms;
    const char *longest_kind;
};

// Keeps what the slicer has learnt; a new one is all zeroes.
void bd_slicer_init(struct bd_slicer *slicer, struct bd_gpu *gpu,
                    enum bd_err (*should_stop)(void *user), void *user);

// What is recorded from here on, until the next call. `kind` is static.
void bd_slicer_work(struct bd_slicer *slicer, const char *kind);

// Units of work that make one slice at the speed known so far.
double bd_slicer_units(const struct bd_slicer *slicer);

// How many rows of `units_per_row` fit into one slice; at least 8 (a row of work groups), at most
// `rows_left`. A unit is one light-receiver evaluation or its like.
uint32_t bd_slicer_rows(struct bd_slicer *slicer, double units_per_row, uint32_t rows_left);

struct bd_tile {
    uint32_t x, y, width, height;
};

// The tile that comes after `tile` (all zero at first): whole rows, or a part of eight rows where
// those are more than a slice; the sides are multiples of 8 but at the picture's right and lower
// border. False after the last.
bool bd_slicer_next_tile(struct bd_slicer *slicer, double units_per_pixel, uint32_t width_px,
                         uint32_t height_px, struct bd_tile *tile);

// Whether the slice has lasted its time already, as far as the host can tell.
bool bd_slicer_is_over(const struct bd_slicer *slicer);

// For loops of the host's: a checkpoint, if the slice has lasted its time already. `user` is the
// slicer.
BD_MUST_CHECK
enum bd_err bd_slicer_pause(void *user);

// Ends a slice in which `units` of work were recorded (0: not known, nothing is learnt): waits for
// it, then asks whether to stop.
BD_MUST_CHECK
enum bd_err bd_slicer_checkpoint(struct bd_slicer *slicer, double units);

#endif
