#include "pass/slicer.h"

#include <math.h>
#include <string.h>

#include "base/assert.h"
#include "base/clock.h"

#define SLICE_MS        6.0
#define GROUP_SIDE      8u  // of work groups that light pixels
#define LEARNING_MS_MIN 0.5 // shorter slices measure the clock, not the device
// Part of a slice that must have been recorded to learn from it: a picture of one pixel keeps one
// lane of the device busy and would teach that the device is that slow.
#define LEARNING_SHARE_MIN 0.25
// First guesses, on the slow side; the second slice of a kind is already measured.
#define SOFTWARE_UNITS_PER_MS 2e4
#define HARDWARE_UNITS_PER_MS 1e7

void bd_slicer_init(struct bd_slicer *slicer, struct bd_gpu *gpu,
                    enum bd_err (*should_stop)(void *user), void *user)
{
    slicer->gpu = gpu;
    slicer->should_stop = should_stop;
    slicer->user = user;
    slicer->slice_start_ns = bd_clock_ns();
    slicer->slice_start_compile_ms = bd_gpu_compile_ms(gpu);
    slicer->slice_count = 0;
    slicer->longest_ms = 0;
    slicer->longest_kind = "";
    bd_slicer_work(slicer, "frame");
}

void bd_slicer_work(struct bd_slicer *slicer, const char *kind)
{
    uint32_t i = 0;
    while (i < slicer->kind_count && strcmp(slicer->kinds[i].name, kind) != 0) i++;
    slicer->kind = i;
    if (i < slicer->kind_count) return;
    BD_ASSERT_CMP(i, <, BD_SLICER_KIND_MAX);
    bool software = bd_gpu_caps(slicer->gpu)->software;
    slicer->kinds[slicer->kind_count].name = kind;
    slicer->kinds[slicer->kind_count++].units_per_ms =
        software ? SOFTWARE_UNITS_PER_MS : HARDWARE_UNITS_PER_MS;
}

double bd_slicer_units(const struct bd_slicer *slicer)
{
    if (slicer->forced_units > 0) return slicer->forced_units;
    return slicer->kinds[slicer->kind].units_per_ms * SLICE_MS;
}

// As many as fit into a slice, in whole work groups; at least one of those.
static uint32_t fitting(const struct bd_slicer *slicer, double units_each, uint32_t left)
{
    double fit = bd_slicer_units(slicer) / (units_each > 1 ? units_each : 1);
    if (fit >= left) return left;
    uint32_t whole = (uint32_t)fit / GROUP_SIDE * GROUP_SIDE;
    if (whole < GROUP_SIDE) whole = GROUP_SIDE;
    return whole < left ? whole : left;
}

uint32_t bd_slicer_rows(struct bd_slicer *slicer, double units_per_row, uint32_t rows_left)
{
    return fitting(slicer, units_per_row, rows_left);
}

bool bd_slicer_next_tile(struct bd_slicer *slicer, double units_per_pixel, uint32_t width_px,
                         uint32_t height_px, struct bd_tile *tile)
{
    tile->x += tile->width;
    if (tile->x >= width_px || tile->width == 0) {
        tile->x = 0;
        tile->y += tile->height;
        if (tile->y >= height_px) return false;
        tile->height = fitting(slicer, units_per_pixel * width_px, height_px - tile->y);
    }
    // What was learnt since the band began may make its rest several tiles, or one.
    tile->width = tile->height <= GROUP_SIDE
                      ? fitting(slicer, units_per_pixel * tile->height, width_px - tile->x)
                      : width_px - tile->x;
    return true;
}

static void learn(struct bd_slicer *slicer, double units, double ms)
{
    bool is_large = units >= LEARNING_SHARE_MIN * bd_slicer_units(slicer);
    if (units <= 0 || !is_large) return;
    double *known = &slicer->kinds[slicer->kind].units_per_ms;
    double measured = units / fmax(ms, LEARNING_MS_MIN);
    if (ms < LEARNING_MS_MIN && measured < *known) return; // it may be faster, but not slower
    // At most four times slower or twice as fast a slice: one page fault must not set the pace, and
    // triangles that are culled say little of those behind them.
    *known = fmin(fmax(measured, *known * 0.25), *known * 2);
}

static double slice_ms(const struct bd_slicer *slicer)
{
    double compile_ms = bd_gpu_compile_ms(slicer->gpu) - slicer->slice_start_compile_ms;
    return bd_ms_since(slicer->slice_start_ns) - compile_ms;
}

bool bd_slicer_is_over(const struct bd_slicer *slicer)
{
    return slice_ms(slicer) >= SLICE_MS;
}

enum bd_err bd_slicer_pause(void *user)
{
    struct bd_slicer *slicer = user;
    return bd_slicer_is_over(slicer) ? bd_slicer_checkpoint(slicer, 0) : BD_ERR_OK;
}

enum bd_err bd_slicer_checkpoint(struct bd_slicer *slicer, double units)
{
    enum bd_err err = bd_gpu_wait(slicer->gpu);
    if (err) return err;
    double ms = slice_ms(slicer);
    learn(slicer, units, ms);
    slicer->last_share = ms / SLICE_MS;
    if (ms > slicer->longest_ms) {
        slicer->longest_ms = ms;
        slicer->longest_kind = slicer->kinds[slicer->kind].name;
    }
    slicer->slice_count++;
    if (slicer->should_stop) err = slicer->should_stop(slicer->user);
    slicer->slice_start_ns = bd_clock_ns();
    slicer->slice_start_compile_ms = bd_gpu_compile_ms(slicer->gpu);
    return err;
}
