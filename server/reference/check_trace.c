// Spot checks: the tracing of their pixels, in levels, until each is known well enough.

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "reference/check.h"
#include "reference/check_cache.h"
#include "reference/check_estimate.h"
#include "reference/check_plan.h"
#include "reference/check_scout.h"
#include "reference/check_ties.h"

// Samples in each half that find out how noisy a pixel is. They take no part in the estimate: if
// they did, pixels whose first samples happened to agree would stop early, and their luck stay.
#define PILOT_SAMPLES 4u
// Levels that an average pixel gets at first, and what noise may be left: a share of the variance,
// or a relative standard deviation so small that nobody minds.
#define LEVELS_AT_FIRST 2u
#define NOISE_SHARE     0.2
#define NOISE_SMALL     0.02

// Samples of each half in one item of a loop; items in one loop.
#define ITEM_SAMPLES BD_CHECK_LEVEL_SAMPLES
#define ITEM_MAX     4096u

const struct bd_check_options bd_check_options_default = {
    .pixel_count = 512,
    .samples_max = UINT64_C(1) << 21,
};

struct check {
    const struct bd_check_options *options;
    const struct bd_check_tracer *tracer;
    struct bd_check_cache *cache;
    struct bd_check_plan plan;
    struct bd_check_pixel *pixels; // of plan.samples
    uint32_t *levels;              // wanted of each
    uint64_t traced, goal;         // samples of both halves
};

// --- tracing --------------------------------------------------------------------------------

// A run of samples of one pixel, traced by one thread.
struct item {
    uint32_t sample, first, count; // index into plan.samples; samples of each half
    struct bd_reference_pixel traced;
};

struct batch {
    const struct check *check;
    struct item items[ITEM_MAX];
    uint32_t count;
};

static void trace_item(void *user, uint32_t i)
{
    struct batch *batch = user;
    const struct check *check = batch->check;
    struct item *item = &batch->items[i];
    uint32_t index = check->plan.samples[item->sample].index;
    memset(&item->traced, 0, sizeof item->traced);
    check->tracer->trace(check->tracer->user, index % check->plan.width_px,
                         index / check->plan.width_px, item->first, item->count, &item->traced);
}

static void add_sums(struct bd_check_sums *sums, const struct bd_reference_pixel *traced)
{
    for (int c = 0; c < 3; c++) {
        for (int half = 0; half < 2; half++)
            for (int part = 0; part < BD_PART_COUNT; part++)
                sums->sum[half][c] += traced->sum[half][part][c];
        sums->square_sum[c] += traced->beauty_square_sum[c];
    }
    sums->refused_ray_count += traced->refused_ray_count;
}

static double variance_of(const struct bd_check_sums *sums, double sample_count)
{
    double variance = 0;
    for (int c = 0; c < 3; c++) {
        double mean = (sums->sum[0][c] + sums->sum[1][c]) / (2 * sample_count);
        variance += fmax(sums->square_sum[c] / (2 * sample_count) - mean * mean, 0) / 3;
    }
    return variance;
}

// The level that sample `first` of a half belongs to; samples before it are the pilot's.
static uint32_t level_of(uint32_t first)
{
    uint32_t level = 0;
    while (first - PILOT_SAMPLES >= BD_CHECK_LEVEL_SAMPLES << level) level++;
    return level;
}

// Adds up in the order of the items: threads change no bit.
static void collect(struct check *check, const struct batch *batch)
{
    for (uint32_t i = 0; i < batch->count; i++) {
        const struct item *item = &batch->items[i];
        struct bd_check_pixel *pixel = &check->pixels[item->sample];
        check->traced += 2 * item->count;
        if (item->first < PILOT_SAMPLES) {
            struct bd_check_sums sums = {0};
            add_sums(&sums, &item->traced);
            pixel->pilot_variance = variance_of(&sums, PILOT_SAMPLES);
            continue;
        }
        uint32_t level = level_of(item->first);
        add_sums(&pixel->levels[level], &item->traced);
        if (item->first + item->count == PILOT_SAMPLES + (BD_CHECK_LEVEL_SAMPLES << level))
            pixel->level_count = level + 1;
    }
}

static enum bd_err run_batch(struct check *check, struct batch *batch)
{
    if (batch->count == 0) return BD_ERR_OK;
    enum bd_err err = check->tracer->loop(check->tracer->user, batch->count, trace_item, batch);
    if (!err) collect(check, batch);
    batch->count = 0;
    if (!err && check->options->progress)
        check->options->progress(check->options->user,
                                 check->goal ? fmin((double)check->traced / (double)check->goal, 1)
                                             : 0);
    return err;
}

static enum bd_err add_item(struct check *check, struct batch *batch, uint32_t sample,
                            uint32_t first, uint32_t count)
{
    batch->items[batch->count++] = (struct item){.sample = sample, .first = first, .count = count};
    return batch->count == ITEM_MAX ? run_batch(check, batch) : BD_ERR_OK;
}

static struct batch *create_batch(const struct check *check)
{
    struct batch *batch = calloc(1, sizeof *batch);
    BD_ASSERT(batch);
    batch->check = check;
    return batch;
}

// --- how many samples -----------------------------------------------------------------------

static void take_from_cache(struct check *check)
{
    for (uint32_t i = 0; i < check->plan.sample_count; i++) {
        uint32_t index = check->plan.samples[i].index;
        const struct bd_check_pixel *held =
            check->cache ? bd_check_cache_get(check->cache, index) : NULL;
        check->pixels[i] =
            held ? *held : (struct bd_check_pixel){.index = index, .pilot_variance = -1};
    }
}

static enum bd_err trace_pilots(struct check *check, struct batch *batch)
{
    enum bd_err err = BD_ERR_OK;
    for (uint32_t i = 0; !err && i < check->plan.sample_count; i++)
        if (check->pixels[i].pilot_variance < 0) err = add_item(check, batch, i, 0, PILOT_SAMPLES);
    return err ? err : run_batch(check, batch);
}

static uint32_t samples_of(uint32_t levels)
{
    return BD_CHECK_LEVEL_SAMPLES << (levels - 1);
}

// Where noise bounds the estimate, its variance is the sum of (weight x variance / samples)^2 over
// the pixels; with a given number of samples in all it is least when they go as (weight x
// variance)^(2/3).
static void share_samples(struct check *check)
{
    double mean = 0;
    for (uint32_t s = 0, i = 0; s < check->plan.stratum_count; s++) {
        const struct bd_check_stratum *stratum = &check->plan.strata[s];
        for (uint32_t end = i + stratum->sample_count; i < end; i++)
            mean += stratum->pixel_count * check->pixels[i].pilot_variance / stratum->sample_count /
                    check->plan.sample_count;
    }
    for (uint32_t s = 0, i = 0; s < check->plan.stratum_count; s++) {
        const struct bd_check_stratum *stratum = &check->plan.strata[s];
        for (uint32_t end = i + stratum->sample_count; i < end; i++) {
            double noise =
                stratum->pixel_count * check->pixels[i].pilot_variance / stratum->sample_count;
            double steps = mean > 0 && noise > 0 ? 2.0 / 3 * log2(noise / mean) : -1;
            double levels = fmin(fmax(round(LEVELS_AT_FIRST + steps), 1), BD_CHECK_LEVEL_MAX - 2);
            check->levels[i] = (uint32_t)levels;
        }
    }
}

static uint64_t samples_wanted(const struct check *check, uint32_t more_levels)
{
    uint64_t samples = 0;
    for (uint32_t i = 0; i < check->plan.sample_count; i++) {
        uint32_t levels = check->levels[i] + more_levels;
        samples += 2 * samples_of(levels < BD_CHECK_LEVEL_MAX ? levels : BD_CHECK_LEVEL_MAX);
    }
    return samples;
}

static enum bd_err trace_level(struct check *check, struct batch *batch, uint32_t sample,
                               uint32_t level)
{
    uint32_t first = level == 0 ? 0 : samples_of(level), end = samples_of(level + 1);
    enum bd_err err = BD_ERR_OK;
    for (; !err && first < end; first += ITEM_SAMPLES)
        err = add_item(check, batch, sample, PILOT_SAMPLES + first, ITEM_SAMPLES);
    return err;
}

static enum bd_err trace_wanted(struct check *check, struct batch *batch)
{
    check->goal = check->traced;
    for (uint32_t i = 0; i < check->plan.sample_count; i++) {
        uint32_t have = check->pixels[i].level_count;
        if (have < check->levels[i])
            check->goal += 2 * (samples_of(check->levels[i]) - (have ? samples_of(have) : 0));
    }
    enum bd_err err = BD_ERR_OK;
    for (uint32_t i = 0; !err && i < check->plan.sample_count; i++)
        for (uint32_t l = check->pixels[i].level_count; !err && l < check->levels[i]; l++)
            err = trace_level(check, batch, i, l);
    return err ? err : run_batch(check, batch);
}

// --- the check ------------------------------------------------------------------------------

static void estimate(const struct check *check, const struct bd_image *beauty,
                     struct bd_check_result *out)
{
    struct bd_check_traced *traced = calloc((size_t)check->plan.sample_count + 1, sizeof *traced);
    BD_ASSERT(traced);
    uint64_t refused_ray_count = 0;
    for (uint32_t i = 0; i < check->plan.sample_count; i++) {
        traced[i].sample_count = samples_of(check->levels[i]);
        for (uint32_t l = 0; l < check->levels[i]; l++) {
            const struct bd_check_sums *level = &check->pixels[i].levels[l];
            for (int c = 0; c < 3; c++) {
                traced[i].sums.sum[0][c] += level->sum[0][c];
                traced[i].sums.sum[1][c] += level->sum[1][c];
                traced[i].sums.square_sum[c] += level->square_sum[c];
            }
            refused_ray_count += level->refused_ray_count;
        }
    }
    bd_check_estimate(&check->plan, beauty, traced, out);
    out->refused_ray_count = refused_ray_count;
    free(traced);
}

static bool is_noise_small(const struct bd_check_result *result)
{
    return result->noise_share <= NOISE_SHARE || result->noise <= NOISE_SMALL;
}

// True if every pixel got a level more.
static bool ask_for_more(struct check *check)
{
    if (samples_wanted(check, 1) > check->options->samples_max) return false;
    bool more = false;
    for (uint32_t i = 0; i < check->plan.sample_count; i++) {
        if (check->levels[i] == BD_CHECK_LEVEL_MAX) continue;
        check->levels[i]++;
        more = true;
    }
    return more;
}

static enum bd_err trace_and_estimate(struct check *check, const struct bd_image *beauty,
                                      struct bd_check_result *out)
{
    struct batch *batch = create_batch(check);
    take_from_cache(check);
    enum bd_err err = trace_pilots(check, batch);
    if (!err) share_samples(check);
    do {
        if (!err) err = trace_wanted(check, batch);
        if (!err) estimate(check, beauty, out);
    } while (!err && !is_noise_small(out) && ask_for_more(check));
    free(batch);
    return err;
}

static void put_into_cache(const struct check *check)
{
    for (uint32_t i = 0; check->cache && i < check->plan.sample_count; i++)
        bd_check_cache_put(check->cache, &check->pixels[i]);
}

enum bd_err bd_check_run(const struct bd_check_frame *frame, const struct bd_check_options *options,
                         const struct bd_check_tracer *tracer, struct bd_check_cache *cache,
                         struct bd_check_result *out, struct bd_err_detail *detail)
{
    *out = (struct bd_check_result){0};
    if (options->pixel_count < BD_CHECK_PIXELS_MIN || options->pixel_count > BD_CHECK_PIXELS_MAX)
        return bd_err_set(detail, BD_ERR_USAGE, "check", "%u: must be from %d to %d pixels",
                          options->pixel_count, BD_CHECK_PIXELS_MIN, BD_CHECK_PIXELS_MAX);
    struct check check = {.options = options, .tracer = tracer, .cache = cache};
    struct bd_check_frame seen = *frame;
    struct bd_check_surprise surprise = {0};
    struct bd_check_ties ties = {0};
    enum bd_err err = bd_check_frame_check(frame, detail);
    if (!err && !options->blind)
        err = bd_check_scout(frame, options->seed, tracer, cache, &check.traced, &surprise, detail);
    if (!err && !options->blind) err = bd_check_find_ties(frame, tracer, &ties, detail);
    seen.surprise = surprise.blocks ? &surprise : NULL;
    seen.ties = ties.differs ? &ties : NULL;
    if (!err)
        err = bd_check_plan_make(&seen, options->pixel_count, options->seed, &check.plan, detail);
    free(surprise.blocks);
    free(ties.differs);
    check.pixels = calloc((size_t)check.plan.sample_count + 1, sizeof *check.pixels);
    check.levels = calloc((size_t)check.plan.sample_count + 1, sizeof *check.levels);
    if (!err && (!check.pixels || !check.levels))
        err = bd_err_set(detail, BD_ERR_NO_MEMORY, "check", "no memory for %u traced pixels",
                         options->pixel_count);
    if (!err) err = trace_and_estimate(&check, frame->beauty, out);
    if (!err) put_into_cache(&check);
    out->sample_count = check.traced;
    bd_check_plan_finish(&check.plan);
    free(check.pixels);
    free(check.levels);
    return err;
}
