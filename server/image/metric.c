#include "image/metric.h"

#include <math.h>
#include <stdbool.h>

static bool same_shape(const struct bd_image *a, const struct bd_image *b)
{
    return a->width_px == b->width_px && a->height_px == b->height_px &&
           a->channel_count == b->channel_count;
}

static enum bd_err check_shapes(const struct bd_image *image, const struct bd_image *half_a,
                                const struct bd_image *half_b, struct bd_fault *fault)
{
    if (!same_shape(half_a, half_b))
        return bd_fault_set(fault, BD_ERR_USAGE, "reference",
                            "the reference's halves differ: %ux%ux%u and %ux%ux%u",
                            half_a->width_px, half_a->height_px, half_a->channel_count,
                            half_b->width_px, half_b->height_px, half_b->channel_count);
    if (!same_shape(image, half_a))
        return bd_fault_set(fault, BD_ERR_USAGE, "image",
                            "the image is %ux%ux%u, the reference %ux%ux%u", image->width_px,
                            image->height_px, image->channel_count, half_a->width_px,
                            half_a->height_px, half_a->channel_count);
    return BD_ERR_OK;
}

struct sums {
    double debiased, noise, image, reference;
};

static void add_sample(double i, double a, double b, struct sums *sums, struct bd_metric *out)
{
    if (!isfinite(i) || !isfinite(a) || !isfinite(b)) {
        out->nonfinite_count++;
        return;
    }
    double r = 0.5 * (a + b);
    sums->debiased += (i - a) * (i - b);
    sums->noise += 0.25 * (a - b) * (a - b);
    sums->image += i;
    sums->reference += r;
    out->max_abs = fmax(out->max_abs, fabs(i - r));
    out->sample_count++;
}

static double relative(double value, double mean)
{
    return value == 0 ? 0 : value / fabs(mean); // mean 0: infinite, with the value's sign
}

enum bd_err bd_metric_measure(const struct bd_image *image, const struct bd_image *half_a,
                              const struct bd_image *half_b, struct bd_metric *out,
                              struct bd_fault *fault)
{
    enum bd_err err = check_shapes(image, half_a, half_b, fault);
    if (err) return err;
    *out = (struct bd_metric){0};
    struct sums sums = {0};
    size_t count = (size_t)image->width_px * image->height_px * image->channel_count;
    for (size_t i = 0; i < count; i++)
        add_sample(image->pixels[i], half_a->pixels[i], half_b->pixels[i], &sums, out);
    if (!out->sample_count) return BD_ERR_OK;
    double n = (double)out->sample_count;
    out->mean_square = sums.debiased / n;
    out->mean_image = sums.image / n;
    out->mean_reference = sums.reference / n;
    out->rel_rmse = relative(sqrt(fmax(out->mean_square, 0)), out->mean_reference);
    out->signed_error = relative(out->mean_image - out->mean_reference, out->mean_reference);
    out->noise_floor = relative(sqrt(sums.noise / n), out->mean_reference);
    return BD_ERR_OK;
}
