#include "reference/check_scout.h"

#include <math.h>
#include <stdlib.h>

#define SCOUTS_MAX 4096u
// Scouts in one item of a loop.
#define ITEM_SCOUTS 64u
// Of each half, the sample that is looked at: beyond any that an estimate uses.
#define SCOUT_SAMPLE (1u << 24)
// Blocks to each side that are a neighbourhood.
#define AROUND 2
// A single sample may be a million times too bright: it counts as so many times the mean.
#define SURPRISE_MOST 50.0

struct scouting {
    const struct bd_check_frame *frame;
    const struct bd_check_tracer *tracer;
    uint64_t seed;
    uint32_t step_px, columns, rows; // of blocks, each with one scout
    float *seen;                     // radiance, three numbers a block
    double *surprises; // squared: of radiances that a float holds, more than one holds
};

// Somewhere in the block: the same pixel each time.
static void place_of(const struct scouting *s, uint32_t block, uint32_t *x, uint32_t *y)
{
    const struct bd_image *beauty = s->frame->beauty;
    uint64_t z = (s->seed ^ UINT64_C(0x5851f42d4c957f2d)) + block * UINT64_C(0x9e3779b97f4a7c15);
    z = (z ^ z >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    z ^= z >> 27;
    *x = block % s->columns * s->step_px + (uint32_t)(z % s->step_px);
    *y = block / s->columns * s->step_px + (uint32_t)(z / s->step_px % s->step_px);
    if (*x >= beauty->width_px) *x = beauty->width_px - 1;
    if (*y >= beauty->height_px) *y = beauty->height_px - 1;
}

static void look(const struct scouting *s, uint32_t block)
{
    struct bd_reference_pixel seen = {0};
    uint32_t x, y;
    place_of(s, block, &x, &y);
    s->tracer->trace(s->tracer->user, x, y, SCOUT_SAMPLE, 1, &seen);
    for (int c = 0; c < 3; c++) {
        double sum = 0;
        for (int part = 0; part < BD_PART_COUNT; part++)
            sum += seen.sum[0][part][c] + seen.sum[1][part][c];
        s->seen[3 * block + c] = (float)(sum / 2);
    }
}

static void measure(const struct scouting *s)
{
    for (uint32_t block = 0; block < s->columns * s->rows; block++) {
        uint32_t x, y;
        place_of(s, block, &x, &y);
        const float *image = bd_image_at(s->frame->beauty, x, y);
        double square = 0;
        for (uint32_t c = 0; c < 3; c++) {
            double off = (double)image[c] - (double)s->seen[3 * block + c];
            square += off * off / 3;
        }
        s->surprises[block] = isfinite(square) ? square : 0;
    }
}

static void look_item(void *user, uint32_t item)
{
    const struct scouting *s = user;
    uint32_t end = (item + 1) * ITEM_SCOUTS;
    if (end > s->columns * s->rows) end = s->columns * s->rows;
    for (uint32_t block = item * ITEM_SCOUTS; block < end; block++) look(s, block);
}

static void hold_down(const struct scouting *s)
{
    double sum = 0;
    uint32_t count = s->columns * s->rows;
    for (uint32_t i = 0; i < count; i++) sum += s->surprises[i];
    double most = SURPRISE_MOST * sum / count;
    for (uint32_t i = 0; i < count; i++) s->surprises[i] = fmin(s->surprises[i], most);
}

static double around(const struct scouting *s, uint32_t column, uint32_t row)
{
    double sum = 0;
    uint32_t count = 0;
    for (int64_t r = (int64_t)row - AROUND; r <= (int64_t)row + AROUND; r++) {
        for (int64_t c = (int64_t)column - AROUND; c <= (int64_t)column + AROUND; c++) {
            if (r < 0 || c < 0 || r >= s->rows || c >= s->columns) continue;
            sum += s->surprises[(size_t)r * s->columns + (size_t)c];
            count++;
        }
    }
    return sum / count;
}

static void fill(const struct scouting *s, struct bd_check_surprise *out)
{
    for (uint32_t row = 0; row < s->rows; row++) {
        for (uint32_t column = 0; column < s->columns; column++) {
            const size_t block = (size_t)row * s->columns + column;
            out->blocks[2 * block] = s->surprises[block];
            out->blocks[2 * block + 1] = around(s, column, row);
        }
    }
}

static struct scouting scouting_of(const struct bd_check_frame *frame, uint64_t seed,
                                   const struct bd_check_tracer *tracer)
{
    struct scouting s = {.frame = frame, .tracer = tracer, .seed = seed};
    uint64_t count;
    do {
        s.step_px++;
        s.columns = (frame->beauty->width_px - 1) / s.step_px + 1;
        s.rows = (frame->beauty->height_px - 1) / s.step_px + 1;
        count = (uint64_t)s.columns * s.rows;
    } while (count > SCOUTS_MAX);
    return s;
}

enum bd_err bd_check_scout(const struct bd_check_frame *frame, uint64_t seed,
                           const struct bd_check_tracer *tracer, struct bd_check_cache *cache,
                           uint64_t *sample_count, struct bd_check_surprise *out,
                           struct bd_err_detail *detail)
{
    struct scouting s = scouting_of(frame, seed, tracer);
    const uint32_t count = s.columns * s.rows;
    bool is_known = false;
    enum bd_err err = BD_ERR_OK;
    s.surprises = calloc(count, sizeof *s.surprises);
    s.seen = cache ? bd_check_cache_scouts(cache, count, &is_known)
                   : calloc((size_t)count * 3, sizeof *s.seen);
    *out = (struct bd_check_surprise){s.step_px, s.columns,
                                      calloc((size_t)count * 2, sizeof *out->blocks)};
    if (!s.surprises || !s.seen || !out->blocks)
        err = bd_err_set(detail, BD_ERR_NO_MEMORY, "check", "no memory to look around");
    if (!err && !is_known) {
        err = tracer->loop(tracer->user, (count + ITEM_SCOUTS - 1) / ITEM_SCOUTS, look_item, &s);
        if (!err) *sample_count += 2 * (uint64_t)count;
    }
    if (err && cache && !is_known) bd_check_cache_forget_scouts(cache);
    if (!err) {
        measure(&s);
        hold_down(&s);
        fill(&s, out);
    }
    if (!cache) free(s.seen);
    free(s.surprises);
    return err;
}
