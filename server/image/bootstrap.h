// Intervals of 95 % by the bootstrap over tiles of a picture: errors of neighbours go together, so
// tiles are drawn again, not pixels.
//
// Figures made of sums get Efron's BCa interval ("Better Bootstrap Confidence Intervals", JASA
// 82, 1987), quantiles the plain percentile one. The generator's seed is fixed: the same input
// gives the same interval. Any thread.

#ifndef BD_IMAGE_BOOTSTRAP_H
#define BD_IMAGE_BOOTSTRAP_H

#include <stddef.h>
#include <stdint.h>

#include "base/err.h"

#define BD_BOOTSTRAP_DRAWS 1000
#define BD_TILE_PX         16

struct bd_tiles {
    uint32_t tile_px; // of a side: BD_TILE_PX, halved while that leaves fewer than 64 tiles
    uint32_t columns, rows;
};

struct bd_tiles bd_tiles_of(uint32_t width_px, uint32_t height_px);

static inline size_t bd_tiles_count(const struct bd_tiles *tiles)
{
    return (size_t)tiles->columns * tiles->rows;
}

static inline size_t bd_tiles_at(const struct bd_tiles *tiles, uint32_t x_px, uint32_t y_px)
{
    return (size_t)(y_px / tiles->tile_px) * tiles->columns + x_px / tiles->tile_px;
}

struct bd_figure {
    double value, low, high; // low <= value <= high
};

// What is asked of sums over a picture: `figures` of them from the sums of `terms` terms.
struct bd_statistics {
    size_t terms, figures;
    void (*evaluate)(const double *sums, const void *user, double *figures);
    const void *user;
};

// `sums`: of each tile, its terms. Fills `out` with as many figures as the statistics have.
BD_MUST_CHECK
enum bd_err bd_bootstrap(const struct bd_statistics *statistics, const double *sums,
                         size_t tile_count, struct bd_figure *out, struct bd_err_detail *detail);

struct bd_tiled_value {
    float value;
    uint32_t tile;
};

// The quantiles at `levels` (0 to 1, exclusive), each the nearest rank: the smallest value that at
// least level x count values do not exceed. Sorts `values`, of which there is at least one.
BD_MUST_CHECK
enum bd_err bd_bootstrap_quantiles(struct bd_tiled_value *values, size_t count, size_t tile_count,
                                   const double *levels, size_t level_count, struct bd_figure *out,
                                   struct bd_err_detail *detail);

#endif
