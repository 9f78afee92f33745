#include "reference/check_plan.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"

// Samples that a stratum gets: fewer know its variance badly, more make strata wide.
#define STRATUM_SAMPLES 8
// At most this share of the samples goes to pixels that stand for themselves alone; the rest is
// left to find what the score did not foresee.
#define CERTAIN_SHARE 0.5

// Scores are sorted by the leading bits of their floats alone: steps of 1/128.
#define BIN_BITS  16
#define BIN_COUNT (1u << BIN_BITS)

struct bins {
    uint32_t count[BIN_COUNT];
    double score[BIN_COUNT];
    uint32_t stratum[BIN_COUNT];
};

static uint32_t bin_of(float score)
{
    uint32_t bits;
    memcpy(&bits, &score, sizeof bits);
    return bits >> (32 - BIN_BITS);
}

// A number between 0 and 2^64 for each pixel: splitmix64 of Steele, Lea and Flood 2014.
static uint64_t lot_of(uint64_t seed, uint32_t index)
{
    uint64_t z =
        seed * UINT64_C(0xd1342543de82ef95) + (index + UINT64_C(1)) * UINT64_C(0x9e3779b97f4a7c15);
    z = (z ^ z >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ z >> 27) * UINT64_C(0x94d049bb133111eb);
    return z ^ z >> 31;
}

// --- frame ----------------------------------------------------------------------------------

static bool has_shape(const struct bd_image *image, const struct bd_image *beauty,
                      uint32_t channel_count)
{
    return !image ||
           (image->width_px == beauty->width_px && image->height_px == beauty->height_px &&
            image->channel_count == channel_count);
}

enum bd_err bd_check_frame_check(const struct bd_check_frame *frame, struct bd_err_detail *detail)
{
    const struct bd_image *beauty = frame->beauty;
    if (beauty->channel_count < 3)
        return bd_err_set(detail, BD_ERR_USAGE, "layers", "beauty has %u channels, not 3 or 4",
                          beauty->channel_count);
    if (!has_shape(frame->indirect, beauty, 3) || !has_shape(frame->normal, beauty, 3) ||
        !has_shape(frame->albedo, beauty, 3) || !has_shape(frame->depth, beauty, 1) ||
        !has_shape(frame->level, beauty, 1))
        return bd_err_set(detail, BD_ERR_USAGE, "layers",
                          "the layers of a checked frame differ in size or channels");
    return BD_ERR_OK;
}

static bool is_measured(const struct bd_image *beauty, uint64_t index)
{
    const float *rgb = beauty->pixels + index * beauty->channel_count;
    return isfinite(rgb[0]) && isfinite(rgb[1]) && isfinite(rgb[2]);
}

static void measure_image(const struct bd_image *beauty, struct bd_check_plan *plan)
{
    double sum = 0;
    uint64_t pixel_count = (uint64_t)beauty->width_px * beauty->height_px;
    for (uint64_t i = 0; i < pixel_count; i++) {
        if (!is_measured(beauty, i)) continue;
        const float *rgb = beauty->pixels + i * beauty->channel_count;
        sum += ((double)rgb[0] + rgb[1] + rgb[2]) / 3;
        plan->pixel_count++;
    }
    plan->mean_image = plan->pixel_count ? sum / (double)plan->pixel_count : 0;
}

// --- strata ---------------------------------------------------------------------------------

static void fill_bins(const struct bd_image *beauty, const float *scores, struct bins *bins)
{
    uint64_t pixel_count = (uint64_t)beauty->width_px * beauty->height_px;
    for (uint64_t i = 0; i < pixel_count; i++) {
        if (!is_measured(beauty, i)) continue;
        uint32_t bin = bin_of(scores[i]);
        bins->count[bin]++;
        bins->score[bin] += (double)scores[i];
    }
}

// The bins from `*end` on hold the pixels that are all traced: those whose score is no less than
// what one sample of the rest would stand for.
static void find_certain(const struct bins *bins, uint32_t sample_count, double *score_left,
                         uint32_t *samples_left, uint32_t *end)
{
    uint32_t certain_max = (uint32_t)(CERTAIN_SHARE * sample_count);
    for (; *end > 0; --*end) {
        uint32_t count = bins->count[*end - 1];
        if (sample_count - *samples_left + count > certain_max) return;
        if (bins->score[*end - 1] * *samples_left < *score_left * count) return;
        *samples_left -= count;
        *score_left -= bins->score[*end - 1];
    }
}

static void add_stratum(struct bd_check_plan *plan, uint32_t pixel_count, double score)
{
    plan->strata[plan->stratum_count++] =
        (struct bd_check_stratum){.pixel_count = pixel_count, .score = score};
}

// Cuts the bins below `end` into strata of about equal score.
static void cut_strata(struct bins *bins, uint32_t end, double score, uint32_t stratum_max,
                       struct bd_check_plan *plan)
{
    uint32_t count = 0;
    double in_stratum = 0, passed = 0;
    uint32_t cut = 1;
    for (uint32_t b = 0; b < end; b++) {
        bins->stratum[b] = plan->stratum_count;
        count += bins->count[b];
        in_stratum += bins->score[b];
        passed += bins->score[b];
        if (count == 0 || cut >= stratum_max || passed * stratum_max < score * cut) continue;
        add_stratum(plan, count, in_stratum);
        while (cut < stratum_max && passed * stratum_max >= score * cut) cut++;
        count = 0;
        in_stratum = 0;
    }
    if (count > 0) add_stratum(plan, count, in_stratum);
}

// Neyman's rule with the score for the spread: samples by the stratum's sum of scores, at least
// two, and no more than it has pixels. What rounding leaves over goes to the brightest first.
static void share_samples(struct bd_check_stratum *strata, uint32_t count, uint32_t samples)
{
    double score = 0;
    for (uint32_t s = 0; s < count; s++) score += strata[s].score;
    uint32_t given = 0;
    for (uint32_t s = 0; s < count; s++) {
        double fair = score > 0 ? samples * strata[s].score / score : 0;
        uint32_t most = strata[s].pixel_count < 2 ? strata[s].pixel_count : 2;
        strata[s].sample_count = fair < most ? most : (uint32_t)fair;
        if (strata[s].sample_count > strata[s].pixel_count)
            strata[s].sample_count = strata[s].pixel_count;
        given += strata[s].sample_count;
    }
    for (uint32_t before = UINT32_MAX; given < samples && given != before;) {
        before = given;
        for (uint32_t s = count; s-- > 0 && given < samples;) {
            if (strata[s].sample_count == strata[s].pixel_count) continue;
            strata[s].sample_count++;
            given++;
        }
    }
    for (uint32_t s = 0; given > samples; s = (s + 1) % count) {
        if (strata[s].sample_count <= 2) continue;
        strata[s].sample_count--;
        given--;
    }
}

static void make_strata(struct bins *bins, uint32_t sample_count, struct bd_check_plan *plan)
{
    double score_left = 0;
    for (uint32_t b = 0; b < BIN_COUNT; b++) score_left += bins->score[b];
    uint32_t samples_left = sample_count, end = BIN_COUNT;
    find_certain(bins, sample_count, &score_left, &samples_left, &end);
    uint32_t stratum_max = samples_left / STRATUM_SAMPLES;
    cut_strata(bins, end, score_left, stratum_max ? stratum_max : 1, plan);
    share_samples(plan->strata, plan->stratum_count, samples_left);
    for (uint32_t b = end; b < BIN_COUNT; b++) bins->stratum[b] = plan->stratum_count;
    uint32_t certain = sample_count - samples_left;
    if (certain == 0) return;
    add_stratum(plan, certain, 0);
    plan->strata[plan->stratum_count - 1].sample_count = certain;
}

// --- choice ---------------------------------------------------------------------------------

// A stratum's samples so far: a heap with the largest lot on top.
struct lot {
    uint64_t lot;
    struct bd_check_sample sample;
};

static bool is_larger(const struct lot *a, const struct lot *b)
{
    return a->lot != b->lot ? a->lot > b->lot : a->sample.index > b->sample.index;
}

static void sift_up(struct lot *heap, uint32_t at)
{
    for (; at > 0 && is_larger(&heap[at], &heap[(at - 1) / 2]); at = (at - 1) / 2) {
        struct lot swapped = heap[at];
        heap[at] = heap[(at - 1) / 2];
        heap[(at - 1) / 2] = swapped;
    }
}

static void sift_down(struct lot *heap, uint32_t count)
{
    for (uint32_t at = 0;;) {
        uint32_t child = 2 * at + 1;
        if (child >= count) return;
        if (child + 1 < count && is_larger(&heap[child + 1], &heap[child])) child++;
        if (!is_larger(&heap[child], &heap[at])) return;
        struct lot swapped = heap[at];
        heap[at] = heap[child];
        heap[child] = swapped;
        at = child;
    }
}

// Keeps the smallest lots of each stratum: a choice without replacement in which all are equal.
static void draw_lots(const struct bd_image *beauty, const float *scores, const struct bins *bins,
                      uint64_t seed, const struct bd_check_plan *plan, struct lot *lots)
{
    uint32_t *filled = calloc(plan->stratum_count, sizeof *filled);
    BD_ASSERT(filled);
    uint64_t pixel_count = (uint64_t)beauty->width_px * beauty->height_px;
    for (uint64_t i = 0; i < pixel_count; i++) {
        if (!is_measured(beauty, i)) continue;
        uint32_t s = bins->stratum[bin_of(scores[i])];
        struct lot *heap = lots + plan->strata[s].first;
        const struct lot lot = {lot_of(seed, (uint32_t)i), {(uint32_t)i, scores[i], 0}};
        if (filled[s] < plan->strata[s].sample_count) {
            heap[filled[s]] = lot;
            sift_up(heap, filled[s]++);
        } else if (is_larger(&heap[0], &lot)) {
            heap[0] = lot;
            sift_down(heap, filled[s]);
        }
    }
    free(filled);
}

static void choose(const struct bd_check_frame *frame, const float *scores, const struct bins *bins,
                   uint64_t seed, struct bd_check_plan *plan)
{
    for (uint32_t s = 0; s < plan->stratum_count; s++) {
        plan->strata[s].first = plan->sample_count;
        plan->sample_count += plan->strata[s].sample_count;
    }
    struct lot *lots = calloc(plan->sample_count + 1, sizeof *lots);
    plan->samples = calloc(plan->sample_count + 1, sizeof *plan->samples);
    BD_ASSERT(lots && plan->samples);
    draw_lots(frame->beauty, scores, bins, seed, plan, lots);
    for (uint32_t i = 0; i < plan->sample_count; i++) {
        plan->samples[i] = lots[i].sample;
        plan->samples[i].contrast = bd_check_contrast(frame->beauty, lots[i].sample.index);
    }
    free(lots);
}

enum bd_err bd_check_plan_make(const struct bd_check_frame *frame, uint32_t sample_count,
                               uint64_t seed, struct bd_check_plan *out,
                               struct bd_err_detail *detail)
{
    *out = (struct bd_check_plan){.width_px = frame->beauty->width_px,
                                  .height_px = frame->beauty->height_px};
    enum bd_err err = bd_check_frame_check(frame, detail);
    if (err) return err;
    measure_image(frame->beauty, out);
    if (sample_count > out->pixel_count) sample_count = (uint32_t)out->pixel_count;
    float *scores = bd_check_scores(frame);
    struct bins *bins = calloc(1, sizeof *bins);
    out->strata = calloc((size_t)sample_count + 2, sizeof *out->strata);
    if (scores && bins && out->strata) {
        fill_bins(frame->beauty, scores, bins);
        make_strata(bins, sample_count, out);
        choose(frame, scores, bins, seed, out);
    } else {
        err = bd_err_set(detail, BD_ERR_NO_MEMORY, "check", "no memory to choose pixels");
    }
    free(scores);
    free(bins);
    return err;
}

void bd_check_plan_finish(struct bd_check_plan *plan)
{
    free(plan->strata);
    free(plan->samples);
    *plan = (struct bd_check_plan){0};
}
