#include "image/metric_sums.h"

#include <math.h>

// What "1 % of the mean" keeps from a division by nothing.
#define FLOOR_SHARE 0.01

struct bd_metric_pixel bd_metric_pixel_at(const struct bd_metric_input *input, size_t p)
{
    struct bd_metric_pixel pixel = {.channel_count = input->image[0]->channel_count};
    for (int half = 0; half < 2; half++) {
        pixel.reference[half] = input->reference[half]->pixels + p * pixel.channel_count;
        pixel.image[half] = input->image[half]->pixels + p * pixel.channel_count;
    }
    return pixel;
}

bool bd_metric_pixel_is_finite(const struct bd_metric_pixel *pixel)
{
    for (uint32_t c = 0; c < pixel->channel_count; c++)
        if (!isfinite(pixel->image[0][c]) || !isfinite(pixel->image[1][c])) return false;
    return true;
}

static double middle(const float *const halves[2], uint32_t channel)
{
    return 0.5 * ((double)halves[0][channel] + (double)halves[1][channel]);
}

double bd_metric_pixel_mean_error(const struct bd_metric_pixel *pixel)
{
    double sum = 0;
    for (uint32_t c = 0; c < pixel->channel_count; c++)
        sum += fabs(middle(pixel->image, c) - middle(pixel->reference, c));
    return sum / pixel->channel_count;
}

static double ratio(double value, double by)
{
    return value == 0 ? 0 : value / by; // by 0: infinite, with the value's sign
}

static void add_channel(const struct bd_metric_pixel *pixel, uint32_t c, double mean, double share,
                        double sums[BD_TERM_COUNT])
{
    double a = (double)pixel->reference[0][c], b = (double)pixel->reference[1][c];
    double i1 = (double)pixel->image[0][c], i2 = (double)pixel->image[1][c];
    double i = 0.5 * (i1 + i2), r = 0.5 * (a + b), n = 0.5 * ((a - b) + (i1 - i2));
    double debiased = (i1 - a) * (i2 - b), floor = FLOOR_SHARE * mean;
    double clipped = fmax(fabs(r), floor), sum = fabs(i) + fabs(r) + floor;
    sums[BD_TERM_DEBIASED] += share * debiased;
    sums[BD_TERM_NOISE] += share * n * n;
    sums[BD_TERM_IMAGE] += share * i;
    sums[BD_TERM_REFERENCE] += share * r;
    sums[BD_TERM_REL_MSE] += share * ratio(debiased, clipped * clipped + floor * floor);
    sums[BD_TERM_MAPE] += share * ratio(fabs(i - r), fabs(r) + floor);
    sums[BD_TERM_MAPE_FLOOR] += share * ratio(fabs(n), fabs(r) + floor);
    sums[BD_TERM_SMAPE] += share * ratio(2 * fabs(i - r), sum);
    sums[BD_TERM_SMAPE_FLOOR] += share * ratio(2 * fabs(n), sum);
}

double bd_metric_add(const struct bd_metric_pixel *pixel, const struct bd_metric_scale *scale,
                     double sums[BD_TERM_COUNT])
{
    double share = 1.0 / pixel->channel_count, reference = 0;
    for (uint32_t c = 0; c < pixel->channel_count; c++) {
        add_channel(pixel, c, scale->mean, share, sums);
        reference += share * fabs(middle(pixel->reference, c));
    }
    double relative =
        ratio(bd_metric_pixel_mean_error(pixel), reference + FLOOR_SHARE * scale->mean);
    sums[BD_TERM_PIXELS] += 1;
    sums[BD_TERM_OVER_HALF] += relative > 0.5;
    return relative;
}

void bd_metric_evaluate(const double *sums, const void *user, double *figures)
{
    const struct bd_metric_scale *scale = user;
    double means[BD_TERM_COUNT];
    for (int i = 0; i < BD_TERM_COUNT; i++) means[i] = ratio(sums[i], sums[BD_TERM_PIXELS]);
    double rmse = sqrt(fmax(means[BD_TERM_DEBIASED], 0)), mean = fabs(means[BD_TERM_REFERENCE]);
    figures[BD_METRIC_REL_RMSE] = ratio(rmse, mean);
    figures[BD_METRIC_RMSE_MAX] = ratio(rmse, scale->max);
    figures[BD_METRIC_REL_MSE] = means[BD_TERM_REL_MSE];
    figures[BD_METRIC_MAPE] = means[BD_TERM_MAPE];
    figures[BD_METRIC_SMAPE] = means[BD_TERM_SMAPE];
    figures[BD_METRIC_SIGNED_ERROR] = ratio(means[BD_TERM_IMAGE] - means[BD_TERM_REFERENCE], mean);
    figures[BD_METRIC_P99] = figures[BD_METRIC_P999] = 0;
    figures[BD_METRIC_OVER_HALF] = means[BD_TERM_OVER_HALF];
    figures[BD_METRIC_PSNR] = -10 * log10(fmax(means[BD_TERM_DISPLAY_SQUARE], 0));
    figures[BD_METRIC_SSIM] = ratio(sums[BD_TERM_SSIM], sums[BD_TERM_SSIM_PIXELS]);
    figures[BD_METRIC_FLIP] = means[BD_TERM_FLIP];
    figures[BD_METRIC_HDR_FLIP] = means[BD_TERM_HDR_FLIP];
    figures[BD_METRIC_NOISE_FLOOR] = ratio(sqrt(fmax(means[BD_TERM_NOISE], 0)), mean);
    figures[BD_METRIC_MAPE_FLOOR] = means[BD_TERM_MAPE_FLOOR];
    figures[BD_METRIC_SMAPE_FLOOR] = means[BD_TERM_SMAPE_FLOOR];
    figures[BD_METRIC_MEAN_SQUARE] = means[BD_TERM_DEBIASED];
    figures[BD_METRIC_MEAN_IMAGE] = means[BD_TERM_IMAGE];
    figures[BD_METRIC_MEAN_REFERENCE] = means[BD_TERM_REFERENCE];
}
