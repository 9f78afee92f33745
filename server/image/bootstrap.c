#include "image/bootstrap.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define TILES_WANTED 64
#define COVERAGE     0.95

struct bd_tiles bd_tiles_of(uint32_t width_px, uint32_t height_px)
{
    struct bd_tiles tiles = {.tile_px = 2 * BD_TILE_PX};
    do {
        tiles.tile_px /= 2;
        tiles.columns = (width_px + tiles.tile_px - 1) / tiles.tile_px;
        tiles.rows = (height_px + tiles.tile_px - 1) / tiles.tile_px;
    } while (tiles.tile_px > 1 && bd_tiles_count(&tiles) < TILES_WANTED);
    return tiles;
}

// Steele, Lea, Flood, "Fast Splittable Pseudorandom Number Generators", 2014.
static uint32_t next_random(uint64_t *state)
{
    uint64_t z = *state += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return (uint32_t)((z ^ (z >> 31)) >> 32);
}

// How often each tile is in the next draw of `tile_count` with replacement.
static void draw_tiles(uint64_t *state, size_t tile_count, uint32_t *times)
{
    memset(times, 0, tile_count * sizeof *times);
    for (size_t i = 0; i < tile_count; i++)
        times[((uint64_t)next_random(state) * tile_count) >> 32]++;
}

// --- the normal distribution ----------------------------------------------------------------

static double normal_cdf(double z)
{
    return 0.5 * erfc(-z / sqrt(2));
}

// By bisection; it is asked a few times a figure.
static double normal_quantile(double p)
{
    double low = -9, high = 9;
    for (int i = 0; i < 60; i++) {
        double middle = 0.5 * (low + high);
        *(normal_cdf(middle) < p ? &low : &high) = middle;
    }
    return 0.5 * (low + high);
}

// --- intervals ------------------------------------------------------------------------------

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// The share of the draws below the value, where equal ones count half: away from 0 and 1, so that
// its normal quantile is finite.
static double share_below(const double *draws, double value)
{
    double below = 0;
    for (int i = 0; i < BD_BOOTSTRAP_DRAWS; i++)
        below += draws[i] < value ? 1 : (draws[i] == value ? 0.5 : 0);
    double least = 0.5 / BD_BOOTSTRAP_DRAWS;
    return fmin(fmax(below / BD_BOOTSTRAP_DRAWS, least), 1 - least);
}

static double sorted_at(const double *draws, double share)
{
    double place = share * (BD_BOOTSTRAP_DRAWS - 1);
    size_t below = (size_t)place;
    double rest = place - (double)below;
    // Not interpolated where it changes nothing: infinity minus infinity is no number.
    if (rest == 0 || draws[below] == draws[below + 1]) return draws[below];
    return draws[below] * (1 - rest) + draws[below + 1] * rest;
}

// Sorts the draws. A bias and an acceleration of 0 make it the percentile interval.
static struct bd_figure interval(double value, double *draws, double bias, double acceleration)
{
    qsort(draws, BD_BOOTSTRAP_DRAWS, sizeof *draws, ascending);
    double ends[2];
    for (int end = 0; end < 2; end++) {
        double z = bias + normal_quantile(end ? (1 + COVERAGE) / 2 : (1 - COVERAGE) / 2);
        double bend = 1 - acceleration * z;
        double share = normal_cdf(bend > 0 ? bias + z / bend : (z < 0 ? -9 : 9));
        ends[end] = sorted_at(draws, share);
    }
    return (struct bd_figure){value, fmin(ends[0], value), fmax(ends[1], value)};
}

// --- figures of sums ------------------------------------------------------------------------

struct workspace {
    double *draws;   // [figure][BD_BOOTSTRAP_DRAWS]
    double *left;    // [tile][figure], each with that tile left out
    double *sums;    // [term]
    double *totals;  // [term]
    double *figures; // [figure]
    uint32_t *times; // [tile]
};

static void close_workspace(struct workspace *space)
{
    free(space->draws);
    free(space->left);
    free(space->sums);
    free(space->totals);
    free(space->figures);
    free(space->times);
}

static enum bd_err open_workspace(const struct bd_statistics *statistics, size_t tile_count,
                                  struct workspace *space, struct bd_err_detail *detail)
{
    *space = (struct workspace){
        .draws = calloc(statistics->figures * BD_BOOTSTRAP_DRAWS, sizeof(double)),
        .left = calloc(statistics->figures * tile_count, sizeof(double)),
        .sums = calloc(statistics->terms, sizeof(double)),
        .totals = calloc(statistics->terms, sizeof(double)),
        .figures = calloc(statistics->figures, sizeof(double)),
        .times = calloc(tile_count, sizeof(uint32_t)),
    };
    if (space->draws && space->left && space->sums && space->totals && space->figures &&
        space->times)
        return BD_ERR_OK;
    close_workspace(space);
    return bd_err_set(detail, BD_ERR_NO_MEMORY, "interval", "no memory for an interval");
}

static void add_terms(double *sums, const double *terms, double weight, size_t count)
{
    for (size_t i = 0; i < count; i++) sums[i] += weight * terms[i];
}

static void draw_figures(const struct bd_statistics *statistics, const double *sums,
                         size_t tile_count, struct workspace *space)
{
    uint64_t state = 1;
    for (size_t draw = 0; draw < BD_BOOTSTRAP_DRAWS; draw++) {
        draw_tiles(&state, tile_count, space->times);
        memset(space->sums, 0, statistics->terms * sizeof *space->sums);
        for (size_t tile = 0; tile < tile_count; tile++)
            if (space->times[tile])
                add_terms(space->sums, sums + tile * statistics->terms, space->times[tile],
                          statistics->terms);
        statistics->evaluate(space->sums, statistics->user, space->figures);
        for (size_t f = 0; f < statistics->figures; f++)
            space->draws[f * BD_BOOTSTRAP_DRAWS + draw] = space->figures[f];
    }
}

static void leave_one_out(const struct bd_statistics *statistics, const double *sums,
                          size_t tile_count, struct workspace *space)
{
    for (size_t tile = 0; tile < tile_count; tile++) {
        memcpy(space->sums, space->totals, statistics->terms * sizeof *space->sums);
        add_terms(space->sums, sums + tile * statistics->terms, -1, statistics->terms);
        statistics->evaluate(space->sums, statistics->user,
                             space->left + tile * statistics->figures);
    }
}

// Efron's a: a sixth of the skewness of what single tiles do to the figure.
static double acceleration(const double *left, size_t tile_count, size_t figure_count)
{
    double mean = 0, squares = 0, cubes = 0;
    for (size_t tile = 0; tile < tile_count; tile++) mean += left[tile * figure_count];
    mean /= (double)tile_count;
    for (size_t tile = 0; tile < tile_count; tile++) {
        double influence = mean - left[tile * figure_count];
        squares += influence * influence;
        cubes += influence * influence * influence;
    }
    double a = cubes / (6 * pow(squares, 1.5));
    return isfinite(a) ? a : 0; // no spread, or an infinite figure
}

enum bd_err bd_bootstrap(const struct bd_statistics *statistics, const double *sums,
                         size_t tile_count, struct bd_figure *out, struct bd_err_detail *detail)
{
    struct workspace space;
    enum bd_err err = open_workspace(statistics, tile_count, &space, detail);
    if (err) return err;
    for (size_t tile = 0; tile < tile_count; tile++)
        add_terms(space.totals, sums + tile * statistics->terms, 1, statistics->terms);
    draw_figures(statistics, sums, tile_count, &space);
    leave_one_out(statistics, sums, tile_count, &space);
    statistics->evaluate(space.totals, statistics->user, space.figures);
    for (size_t f = 0; f < statistics->figures; f++) {
        double *draws = space.draws + f * BD_BOOTSTRAP_DRAWS, value = space.figures[f];
        double a = acceleration(space.left + f, tile_count, statistics->figures);
        out[f] = interval(value, draws, normal_quantile(share_below(draws, value)), a);
    }
    close_workspace(&space);
    return BD_ERR_OK;
}

// --- quantiles ------------------------------------------------------------------------------

static int descending(const void *a, const void *b)
{
    const struct bd_tiled_value *x = a, *y = b;
    if (x->value != y->value) return x->value < y->value ? 1 : -1;
    return (x->tile > y->tile) - (x->tile < y->tile);
}

// The quantile of the values, each taken as often as its tile; they lie largest first.
static double weighted_quantile(const struct bd_tiled_value *values, size_t count,
                                const uint32_t *times, uint64_t total, double level)
{
    uint64_t above = total - (uint64_t)ceil(level * (double)total), seen = 0;
    for (size_t i = 0; i < count; i++) {
        seen += times[values[i].tile];
        if (seen > above) return (double)values[i].value;
    }
    return (double)values[count - 1].value;
}

struct quantile_space {
    double *draws;          // [level][BD_BOOTSTRAP_DRAWS]
    uint32_t *times, *held; // [tile], `held` how many values lie in it
};

static void draw_quantiles(const struct bd_tiled_value *values, size_t count, size_t tile_count,
                           const double *levels, size_t level_count, struct quantile_space *space)
{
    uint64_t state = 1;
    for (size_t draw = 0; draw < BD_BOOTSTRAP_DRAWS; draw++) {
        uint64_t total = 0;
        draw_tiles(&state, tile_count, space->times);
        for (size_t tile = 0; tile < tile_count; tile++)
            total += (uint64_t)space->times[tile] * space->held[tile];
        for (size_t l = 0; l < level_count; l++)
            space->draws[l * BD_BOOTSTRAP_DRAWS + draw] =
                weighted_quantile(values, count, space->times, total, levels[l]);
    }
}

enum bd_err bd_bootstrap_quantiles(struct bd_tiled_value *values, size_t count, size_t tile_count,
                                   const double *levels, size_t level_count, struct bd_figure *out,
                                   struct bd_err_detail *detail)
{
    struct quantile_space space = {
        .draws = calloc(level_count * BD_BOOTSTRAP_DRAWS, sizeof(double)),
        .times = calloc(tile_count, sizeof(uint32_t)),
        .held = calloc(tile_count, sizeof(uint32_t)),
    };
    enum bd_err err = BD_ERR_OK;
    if (!space.draws || !space.times || !space.held) {
        err = bd_err_set(detail, BD_ERR_NO_MEMORY, "interval", "no memory for an interval");
        goto release;
    }
    qsort(values, count, sizeof *values, descending);
    for (size_t i = 0; i < count; i++) space.held[values[i].tile]++;
    draw_quantiles(values, count, tile_count, levels, level_count, &space);
    for (size_t tile = 0; tile < tile_count; tile++) space.times[tile] = 1;
    for (size_t l = 0; l < level_count; l++) {
        double value = weighted_quantile(values, count, space.times, count, levels[l]);
        out[l] = interval(value, space.draws + l * BD_BOOTSTRAP_DRAWS, 0, 0);
    }
release:
    free(space.draws);
    free(space.times);
    free(space.held);
    return err;
}
