#include "pass/slicer.h"

#include "base/clock.h"

#define SLICE_MS         20.0
#define ROWS_MIN         8u
#define LEARNING_MS_MIN  1.0 // shorter slices measure the clock, not the device
// Part of a slice that must have been recorded to learn from it: a picture of one pixel keeps one
// lane of the device busy and would teach that the device is that slow.
#define LEARNING_SHARE_MIN 0.25
// First guesses, on the slow side; the second slice of a device's life is already measured.
#define SOFTWARE_UNITS_PER_MS 2e4
#define HARDWARE_UNITS_PER_MS 1e7

void bd_slicer_init(struct bd_slicer *slicer, struct bd_gpu *gpu,
                    enum bd_err (*should_stop)(void *user), void *user)
{
    double known = slicer->units_per_ms;
    bool software = bd_gpu_caps(gpu)->software;
    *slicer = (struct bd_slicer){
        .gpu = gpu,
        .should_stop = should_stop,
        .user = user,
        .units_per_ms = known > 0 ? known
                                  : (software ? SOFTWARE_UNITS_PER_MS : HARDWARE_UNITS_PER_MS),
        .slice_start_ns = bd_clock_ns(),
    };
}

double bd_slicer_units(const struct bd_slicer *slicer)
{
    return slicer->units_per_ms * SLICE_MS;
}

uint32_t bd_slicer_rows(struct bd_slicer *slicer, double units_per_row, uint32_t rows_left)
{
    double rows = bd_slicer_units(slicer) / (units_per_row > 1 ? units_per_row : 1);
    uint32_t whole = rows >= rows_left ? rows_left : (uint32_t)rows / ROWS_MIN * ROWS_MIN;
    if (whole < ROWS_MIN) whole = ROWS_MIN;
    return whole < rows_left ? whole : rows_left;
}

static void learn(struct bd_slicer *slicer, double units, double ms)
{
    if (ms < LEARNING_MS_MIN || units < LEARNING_SHARE_MIN * bd_slicer_units(slicer)) return;
    double measured = units / ms;
    // At most four times faster or slower a slice: one page fault must not set the pace.
    double low = slicer->units_per_ms * 0.25, high = slicer->units_per_ms * 4;
    slicer->units_per_ms = measured < low ? low : measured > high ? high : measured;
}

enum bd_err bd_slicer_checkpoint(struct bd_slicer *slicer, double units)
{
    enum bd_err err = bd_gpu_wait(slicer->gpu);
    if (err) return err;
    learn(slicer, units, bd_ms_since(slicer->slice_start_ns));
    slicer->slice_start_ns = bd_clock_ns();
    slicer->slice_count++;
    return slicer->should_stop ? slicer->should_stop(slicer->user) : BD_ERR_OK;
}
