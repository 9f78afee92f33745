#include "sched/reference_picture.h"

#include <math.h>

static const float depth_of_nothing_m = 1e10f;

static enum bd_err create_layer(const struct bd_frame_request *request, uint32_t layer,
                                struct bd_image **out, struct bd_err_detail *detail)
{
    uint32_t width_px = request->width_px, height_px = request->height_px;
    *out = bd_image_create(width_px, height_px, bd_layer_channel_count((enum bd_layer)layer));
    if (!*out)
        return bd_err_set(detail, BD_ERR_NO_MEMORY, "size",
                          "no memory for the layers of %ux%u pixels", width_px, height_px);
    if (layer == BD_LAYER_DEPTH)
        for (size_t i = 0; i < (size_t)width_px * height_px; i++)
            (*out)->pixels[i] = depth_of_nothing_m;
    return BD_ERR_OK;
}

enum bd_err bd_reference_picture_create(const struct bd_frame_request *request, uint32_t wanted,
                                        enum bd_err (*should_stop)(void *user), void *user,
                                        struct bd_image *layers[BD_LAYER_COUNT],
                                        struct bd_err_detail *detail)
{
    enum bd_err err = BD_ERR_OK;
    for (uint32_t l = 0; l < BD_LAYER_COUNT && !err; l++) {
        if (!(wanted >> l & 1)) continue;
        err = should_stop(user);
        if (!err) err = create_layer(request, l, &layers[l], detail);
    }
    for (uint32_t l = 0; err && l < BD_LAYER_COUNT; l++) bd_image_destroy(&layers[l]);
    return err;
}

struct target {
    struct bd_image *const *layers;
    uint32_t x_px, y_px;
};

static void put(const struct target *target, uint32_t layer, const double value[3])
{
    if (!target->layers[layer]) return;
    float *out = bd_image_at(target->layers[layer], target->x_px, target->y_px);
    for (int c = 0; c < 3; c++) out[c] = (float)value[c];
}

static void put_one(const struct target *target, uint32_t layer, double value)
{
    if (target->layers[layer])
        *bd_image_at(target->layers[layer], target->x_px, target->y_px) = (float)value;
}

static double share(double sum, double count)
{
    return count > 0 ? sum / count : 0;
}

// Of the mean of `count` samples, from their sum and the sum of their squares.
static double variance_of_mean(double sum, double square_sum, double count)
{
    if (count < 2) return 0;
    double squares = square_sum - sum * sum / count;
    return squares > 0 ? squares / (count * (count - 1)) : 0;
}

// The layers of a half stand in this order behind its first, beauty.
static const enum bd_reference_part parts[] = {BD_PART_DIRECT, BD_PART_INDIRECT, BD_PART_EMISSION};

static double sum_of(const struct bd_reference_pixel *pixel, uint32_t half,
                     enum bd_reference_part part, int c)
{
    return pixel->sum[half][part][c] + (part == BD_PART_INDIRECT ? pixel->landed[half][c] : 0);
}

static void store_half(const struct target *target, const struct bd_reference_pixel *pixel,
                       uint32_t half, uint32_t first_layer)
{
    double beauty[3] = {0, 0, 0};
    for (uint32_t p = 0; p < BD_PART_COUNT; p++) {
        double mean[3];
        for (int c = 0; c < 3; c++) {
            mean[c] = share(sum_of(pixel, half, parts[p], c), pixel->sample_count[half]);
            beauty[c] += mean[c];
        }
        put(target, first_layer + 1 + p, mean);
    }
    put(target, first_layer, beauty);
}

static void store_light(const struct target *target, const struct bd_reference_pixel *pixel)
{
    static const uint32_t variances[] = {BD_LAYER_DIRECT_VARIANCE, BD_LAYER_INDIRECT_VARIANCE};
    double count = (double)pixel->sample_count[0] + pixel->sample_count[1];
    double beauty_sum[3] = {0, 0, 0}, value[3];
    for (uint32_t p = 0; p < BD_PART_COUNT; p++) {
        double sum[3];
        for (int c = 0; c < 3; c++) {
            sum[c] = sum_of(pixel, 0, parts[p], c) + sum_of(pixel, 1, parts[p], c);
            beauty_sum[c] += sum[c];
            value[c] = share(sum[c], count);
        }
        put(target, BD_LAYER_DIRECT + p, value);
        if (p >= sizeof variances / sizeof variances[0]) continue;
        const double landed = parts[p] == BD_PART_INDIRECT ? 1 : 0;
        for (int c = 0; c < 3; c++)
            value[c] = variance_of_mean(
                sum[c], pixel->square_sum[parts[p]][c] + landed * pixel->landed_square_sum[c],
                count);
        put(target, variances[p], value);
    }
    for (int c = 0; c < 3; c++) value[c] = share(beauty_sum[c], count);
    put(target, BD_LAYER_BEAUTY, value);
    bd_image_at(target->layers[BD_LAYER_BEAUTY], target->x_px, target->y_px)[3] =
        (float)share(pixel->coverage, count);
    for (int c = 0; c < 3; c++)
        value[c] = variance_of_mean(
            beauty_sum[c], pixel->beauty_square_sum[c] + pixel->landed_square_sum[c], count);
    put(target, BD_LAYER_VARIANCE, value);
}

// As the raster's averages: albedo over all samples, depth and normal over those that met something.
static void store_guides(const struct target *target, const struct bd_reference_pixel *pixel)
{
    double count = (double)pixel->sample_count[0] + pixel->sample_count[1], value[3];
    for (int c = 0; c < 3; c++) value[c] = share(pixel->albedo[c], count);
    put(target, BD_LAYER_ALBEDO, value);
    const double *n = pixel->normal;
    double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (int c = 0; c < 3; c++) value[c] = share(n[c], length);
    put(target, BD_LAYER_NORMAL, value);
    put_one(target, BD_LAYER_NORMAL_LENGTH, share(length, pixel->coverage));
    if (pixel->coverage > 0)
        put_one(target, BD_LAYER_DEPTH, pixel->depth_m / pixel->coverage);
}

void bd_reference_picture_store(struct bd_image *const layers[BD_LAYER_COUNT], uint32_t x_px,
                                uint32_t y_px, const struct bd_reference_pixel *pixel)
{
    const struct target target = {layers, x_px, y_px};
    for (uint32_t half = 0; half < 2; half++)
        store_half(&target, pixel, half, half ? BD_LAYER_HALF_B : BD_LAYER_HALF_A);
    store_light(&target, pixel);
    store_guides(&target, pixel);
}
