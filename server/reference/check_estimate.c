#include "reference/check_estimate.h"

#include <math.h>
#include <stdlib.h>

#include "base/assert.h"

// The share of the samples and of the sum that make a tail.
#define TAIL_SAMPLES 0.01
#define TAIL_SUM     0.5

// Chosen for coverage on real frames (tests/bench/results/NOTES.md). What makes them fail is always
// an error above the interval, of pixels that nothing in the frame gives away. The first stands for
// edges of shadows too: leaving it out where edges were looked at cost a tenth of the coverage.
#define EDGE_SURPRISES 0.2
#define WIDTH          1.3

// One traced pixel, channel-averaged.
struct measured {
    double square;       // debiased squared error d
    double error;        // I - R
    double reference;    // R
    double square_noise; // variance of d by the reference's samples
    double error_noise;
    double sample_noise; // variance of one sample of the reference
    double contribution; // to the mean of d, by what it stands for; 0 if it stands for itself alone
};

// What a sample of each stratum brings to the variance, summed up.
struct spread {
    double variance;   // of the estimate
    double noise;      // part of it that is the reference's
    double square_sum; // of strata's variances over their degrees of freedom
    double third_moment;
    double unseen; // to the squared relative error, by pixels that were not traced
};

// --- one pixel ------------------------------------------------------------------------------

// A and B are means of the same number of samples. Their own noise makes (I - A)(I - B) vary by
// error^2 (var A + var B) + var A var B; channels are taken to vary together, which they mostly do.
static struct measured measure(const float *image, const struct bd_check_traced *traced)
{
    const struct bd_check_sums *sums = &traced->sums;
    const double n = traced->sample_count;
    struct measured out = {0};
    double square_deviation = 0, error_deviation = 0;
    for (int c = 0; c < 3; c++) {
        double a = sums->sum[0][c] / n, b = sums->sum[1][c] / n;
        double from_a = (double)image[c] - a, from_b = (double)image[c] - b;
        double mean = (a + b) / 2;
        double variance = fmax(sums->square_sum[c] / (2 * n) - mean * mean, 0) / n;
        out.square += from_a * from_b / 3;
        out.error += ((double)image[c] - mean) / 3;
        out.reference += mean / 3;
        out.sample_noise += variance * n / 3;
        square_deviation += sqrt(2 * fmax(from_a * from_b, 0) * variance + variance * variance) / 3;
        error_deviation += sqrt(variance / 2) / 3;
    }
    out.square_noise = square_deviation * square_deviation;
    out.error_noise = error_deviation * error_deviation;
    return out;
}

// Means over the whole frame: of d, and of R as the frame's own mean, which is known, less the mean
// difference: the frame knows most of what makes pixels differ. Where that is no number that a mean
// of light can be, by chance, the mean of what was traced.
static void estimate_means(const struct bd_check_plan *plan, struct measured *measured,
                           struct bd_check_result *out)
{
    double square = 0, error = 0, reference = 0, sample_noise = 0;
    for (uint32_t s = 0; s < plan->stratum_count; s++) {
        const struct bd_check_stratum *stratum = &plan->strata[s];
        double weight = (double)stratum->pixel_count /
                        ((double)stratum->sample_count * (double)plan->pixel_count);
        for (uint32_t i = 0; i < stratum->sample_count; i++) {
            struct measured *m = &measured[stratum->first + i];
            bool certain = stratum->sample_count == stratum->pixel_count;
            m->contribution = certain ? 0 : weight * m->square;
            square += weight * m->square;
            error += weight * m->error;
            reference += weight * m->reference;
            sample_noise += weight * m->sample_noise;
        }
    }
    out->mean_square = square;
    out->black = !(reference > 0);
    out->mean_reference = out->black ? 0 : plan->mean_image - error;
    if (!(out->mean_reference > 0)) out->mean_reference = reference;
    if (!out->black)
        out->sample_variance = sample_noise / (out->mean_reference * out->mean_reference);
}

// What errors are told in: the reference's mean, or cd/m^2 where that is nothing.
static double unit_of(const struct bd_check_result *result)
{
    return result->black ? 1 : result->mean_reference;
}

// --- spread ---------------------------------------------------------------------------------

// The squared relative error q = S / M^2 changes by dS / M^2 - 2 S dM / M^3; what one pixel brings.
static double influence(const struct measured *m, const struct bd_check_result *means)
{
    double unit = unit_of(means), by_square = m->square / (unit * unit);
    if (means->black) return by_square;
    return by_square + 2 * fmax(means->mean_square, 0) * m->error / (unit * unit * unit);
}

static double influence_noise(const struct measured *m, const struct bd_check_result *means)
{
    double unit = unit_of(means);
    double by_square = sqrt(m->square_noise) / (unit * unit);
    double by_error = 2 * fmax(means->mean_square, 0) * sqrt(m->error_noise) / (unit * unit * unit);
    return (by_square + by_error) * (by_square + by_error);
}

// Sampling without replacement: what the samples scatter counts for the pixels that were not
// chosen, their noise for those that were.
static void add_stratum(const struct bd_check_plan *plan, const struct bd_check_stratum *stratum,
                        const struct measured *measured, const struct bd_check_result *means,
                        struct spread *spread)
{
    const double n = stratum->sample_count;
    const double chosen = n / stratum->pixel_count;
    const double share = (double)stratum->pixel_count / (double)plan->pixel_count;
    double mean = 0, squares = 0, cubes = 0, noise = 0;
    for (uint32_t i = 0; i < stratum->sample_count; i++) {
        mean += influence(&measured[i], means) / n;
        noise += influence_noise(&measured[i], means) / n;
    }
    for (uint32_t i = 0; i < stratum->sample_count; i++) {
        double off = influence(&measured[i], means) - mean;
        squares += off * off;
        cubes += off * off * off;
    }
    double scattered = n > 1 ? share * share * (1 - chosen) * squares / (n - 1) / n : 0;
    double of_noise = share * share * noise / n;
    double variance = fmax(scattered + chosen * of_noise, of_noise);
    spread->variance += variance;
    spread->noise += of_noise;
    if (n > 1) spread->square_sum += variance * variance / (n - 1);
    if (n > 2)
        spread->third_moment += share * share * share * (1 - chosen) * (1 - 2 * chosen) * cubes /
                                (n * (n - 1) * (n - 2));
}

// What pixels that were not chosen may add to the mean of d. Two ways to be surprised: one is as
// badly predicted by its score as the worst that was traced; or an edge is in the wrong place by a
// pixel somewhere, which no sample need have met (EDGE_SURPRISES of them, at the mean contrast).
static double unseen_square(const struct bd_check_plan *plan, const struct measured *measured)
{
    double worst = 0, score = 0, contrast = 0;
    uint32_t strata = 0, samples = 0;
    for (uint32_t i = 0; i < plan->sample_count; i++)
        worst = fmax(worst, measured[i].square / (double)plan->samples[i].score);
    for (uint32_t s = 0; s < plan->stratum_count; s++) {
        const struct bd_check_stratum *stratum = &plan->strata[s];
        if (stratum->sample_count == stratum->pixel_count) continue;
        double hidden = (double)(stratum->pixel_count - stratum->sample_count);
        score += hidden / stratum->pixel_count * stratum->score / stratum->sample_count;
        for (uint32_t i = 0; i < stratum->sample_count; i++)
            contrast +=
                hidden * (double)plan->samples[stratum->first + i].contrast / stratum->sample_count;
        strata++;
        samples += stratum->sample_count;
    }
    if (strata == 0) return 0;
    return (worst * score / strata + EDGE_SURPRISES * contrast / samples) /
           (double)plan->pixel_count;
}

static struct spread spread_of(const struct bd_check_plan *plan, const struct measured *measured,
                               const struct bd_check_result *means)
{
    struct spread spread = {0};
    for (uint32_t s = 0; s < plan->stratum_count; s++)
        add_stratum(plan, &plan->strata[s], measured + plan->strata[s].first, means, &spread);
    spread.unseen = unseen_square(plan, measured) / (unit_of(means) * unit_of(means));
    return spread;
}

// --- interval -------------------------------------------------------------------------------

static int larger_first(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x < y) - (x > y);
}

// Pixels that stand for themselves alone hide no others: however much they carry, it is known.
// Counted as a tail they would flag a third of all frames, which are better known than the rest.
static bool has_tail(const struct bd_check_plan *plan, const struct measured *measured, double sum)
{
    double *parts = malloc((size_t)plan->sample_count * sizeof *parts);
    BD_ASSERT(parts);
    for (uint32_t i = 0; i < plan->sample_count; i++) parts[i] = measured[i].contribution;
    qsort(parts, plan->sample_count, sizeof *parts, larger_first);
    double top = 0;
    uint32_t count = (uint32_t)ceil(TAIL_SAMPLES * plan->sample_count);
    for (uint32_t i = 0; i < count; i++) top += parts[i];
    free(parts);
    return sum > 0 && top > TAIL_SUM * sum;
}

double bd_check_student_t(double degrees_of_freedom)
{
    static const double exact[] = {12.7062, 4.30265, 3.18245, 2.77645, 2.57058};
    double n = fmax(degrees_of_freedom, 1);
    if (n < 5) {
        // Nearly a line in 1 / n between neighbours.
        int at = (int)n;
        double share = (1.0 / at - 1 / n) / (1.0 / at - 1.0 / (at + 1));
        return exact[at - 1] + share * (exact[at] - exact[at - 1]);
    }
    // Cornish and Fisher's expansion at z = 1.959964.
    return 1.959964 + 2.372271 / n + 2.822499 / (n * n) + 2.555850 / (n * n * n) +
           1.589536 / (n * n * n * n);
}

// The reference's own noise decides how well the error is known, not which pixels were chosen.
static bool is_noise(const struct bd_check_result *result)
{
    return result->noise_share > 0.5;
}

static void note_noise(const struct spread *spread, struct bd_check_result *out)
{
    double square = out->mean_square / (unit_of(out) * unit_of(out));
    out->noise_share = spread->variance > 0 ? spread->noise / spread->variance : 0;
    out->noise = square > 0 ? sqrt(spread->noise) / (2 * square) : INFINITY;
}

// Where sampling decides, on the log of the error, which its heavy right tail makes nearly normal;
// where the reference's noise does, or nothing is left above it, on its square, which may be zero.
static void make_interval(const struct spread *spread, struct bd_check_result *out)
{
    double square = out->mean_square / (unit_of(out) * unit_of(out));
    double deviation = sqrt(spread->variance);
    double freedom = spread->square_sum > 0
                         ? spread->variance * spread->variance / spread->square_sum
                         : INFINITY;
    double t = bd_check_student_t(freedom);
    double skewness = spread->variance > 0 ? spread->third_moment / pow(spread->variance, 1.5) : 0;
    // Johnson 1978, Hall 1992: the upper end of a right-skewed mean lies farther out.
    double lower = WIDTH * t, upper = WIDTH * t + fmax(skewness * (1 + 2 * t * t) / 6, 0);
    out->value = sqrt(fmax(square, 0));
    if (square > 0 && !is_noise(out)) {
        out->low = sqrt(square * exp(-lower * deviation / square));
        out->high = sqrt((square + spread->unseen) * exp(upper * deviation / square));
    } else {
        out->low = sqrt(fmax(square - lower * deviation, 0));
        out->high = sqrt(fmax(square + upper * deviation + spread->unseen, 0));
    }
    if (out->tail) out->high = INFINITY;
}

void bd_check_estimate(const struct bd_check_plan *plan, const struct bd_image *beauty,
                       const struct bd_check_traced *traced, struct bd_check_result *out)
{
    out->pixel_count = plan->sample_count;
    out->tail = out->black = false;
    out->noise_share = out->noise = out->mean_square = out->mean_reference = 0;
    out->sample_variance = 0;
    if (plan->sample_count == 0) {
        out->value = out->low = 0;
        out->high = INFINITY;
        return;
    }
    struct measured *measured = malloc((size_t)plan->sample_count * sizeof *measured);
    BD_ASSERT(measured);
    for (uint32_t i = 0; i < plan->sample_count; i++)
        measured[i] = measure(
            beauty->pixels + (size_t)plan->samples[i].index * beauty->channel_count, &traced[i]);
    estimate_means(plan, measured, out);
    struct spread spread = spread_of(plan, measured, out);
    note_noise(&spread, out);
    // Differences of noise have a sum near zero, of which any of them is a large part.
    out->tail = !is_noise(out) && has_tail(plan, measured, out->mean_square);
    make_interval(&spread, out);
    free(measured);
}
