#include "image/metric_display.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "image/display.h"
#include "image/metric_sums.h"
#include "image/ssim.h"

enum side { REFERENCE, IMAGE, SIDE_COUNT };

struct pictures {
    struct bd_image *linear[SIDE_COUNT]; // scene-linear means of the halves
    struct bd_image *shown[SIDE_COUNT];  // display-linear, then sRGB-coded
    float *luma[SIDE_COUNT];
};

static enum bd_err no_memory(struct bd_err_detail *detail)
{
    return bd_err_set(detail, BD_ERR_NO_MEMORY, "metric", "no memory to measure with");
}

static size_t pixel_count_of(const struct bd_metric_input *input)
{
    return (size_t)input->image[0]->width_px * input->image[0]->height_px;
}

static void close_pictures(struct pictures *pictures)
{
    for (int s = 0; s < SIDE_COUNT; s++) {
        bd_image_destroy(&pictures->linear[s]);
        bd_image_destroy(&pictures->shown[s]);
        free(pictures->luma[s]);
    }
}

static enum bd_err open_pictures(const struct bd_metric_input *input, struct pictures *pictures,
                                 struct bd_err_detail *detail)
{
    uint32_t width_px = input->image[0]->width_px, height_px = input->image[0]->height_px;
    *pictures = (struct pictures){0};
    for (int s = 0; s < SIDE_COUNT; s++) {
        pictures->linear[s] = bd_image_create(width_px, height_px, 3);
        pictures->shown[s] = bd_image_create(width_px, height_px, 3);
        pictures->luma[s] = malloc(pixel_count_of(input) * sizeof(float));
        if (pictures->linear[s] && pictures->shown[s] && pictures->luma[s]) continue;
        close_pictures(pictures);
        return no_memory(detail);
    }
    return BD_ERR_OK;
}

static void load_pictures(const struct bd_metric_input *input, struct pictures *pictures)
{
    for (size_t p = 0; p < pixel_count_of(input); p++) {
        struct bd_metric_pixel pixel = bd_metric_pixel_at(input, p);
        const float *const *shown =
            bd_metric_pixel_is_finite(&pixel) ? pixel.image : pixel.reference;
        for (size_t c = 0; c < 3; c++) {
            pictures->linear[REFERENCE]->pixels[3 * p + c] =
                0.5f * pixel.reference[0][c] + 0.5f * pixel.reference[1][c];
            pictures->linear[IMAGE]->pixels[3 * p + c] = 0.5f * shown[0][c] + 0.5f * shown[1][c];
        }
    }
}

// From display-linear to sRGB-coded, and to luma of the coded values (BT.709), as a viewer's
// greyscale has it.
static void code(struct bd_image *shown, float *luma)
{
    size_t count = (size_t)shown->width_px * shown->height_px;
    for (size_t p = 0; p < count; p++) {
        float *rgb = shown->pixels + 3 * p;
        for (int c = 0; c < 3; c++) rgb[c] = bd_display_srgb(rgb[c]);
        luma[p] = (float)bd_display_luminance(rgb);
    }
}

static void measure_squares(const struct pictures *pictures, size_t count, float *square)
{
    for (size_t p = 0; p < count; p++) {
        float sum = 0;
        for (size_t c = 0; c < 3; c++) {
            float difference = pictures->shown[IMAGE]->pixels[3 * p + c] -
                               pictures->shown[REFERENCE]->pixels[3 * p + c];
            sum += difference * difference;
        }
        square[p] = sum / 3;
    }
}

// What is shown already, kept to what a display has.
static void clamp(const struct bd_image *image, struct bd_image *out)
{
    size_t count = (size_t)3 * image->width_px * image->height_px;
    for (size_t i = 0; i < count; i++) out->pixels[i] = fminf(fmaxf(image->pixels[i], 0), 1);
}

static enum bd_err measure_planes(const struct bd_metric_input *input, struct pictures *pictures,
                                  struct bd_metric_display *out, struct bd_err_detail *detail)
{
    struct bd_luminance_range range;
    if (!bd_luminance_range(pictures->linear[REFERENCE], &range)) return no_memory(detail);
    out->exposure = range.high > 0 && !input->shown ? 1 / range.high : 1;
    out->hdr_exposures = bd_flip_exposures(range.median, range.max);
    for (int s = 0; s < SIDE_COUNT; s++) {
        if (input->shown)
            clamp(pictures->linear[s], pictures->shown[s]);
        else
            bd_display_image(pictures->linear[s], out->exposure, pictures->shown[s]);
    }
    enum bd_err err = bd_flip_ldr(pictures->shown[REFERENCE], pictures->shown[IMAGE], input->ppd,
                                  out->flip, detail);
    if (!err && input->shown)
        memset(out->hdr_flip, 0, pixel_count_of(input) * sizeof *out->hdr_flip);
    else if (!err)
        err = bd_flip_hdr(pictures->linear[REFERENCE], pictures->linear[IMAGE], input->ppd,
                          &out->hdr_exposures, out->hdr_flip, detail);
    if (err) return err;
    for (int s = 0; s < SIDE_COUNT; s++) code(pictures->shown[s], pictures->luma[s]);
    measure_squares(pictures, pixel_count_of(input), out->square);
    struct bd_plane_size size = {input->image[0]->width_px, input->image[0]->height_px};
    return bd_ssim(pictures->luma[REFERENCE], pictures->luma[IMAGE], size, out->ssim, detail);
}

enum bd_err bd_metric_display_measure(const struct bd_metric_input *input,
                                      struct bd_metric_display *out, struct bd_err_detail *detail)
{
    size_t count = pixel_count_of(input);
    *out = (struct bd_metric_display){
        .square = malloc(count * sizeof(float)),
        .ssim = malloc(count * sizeof(float)),
        .flip = malloc(count * sizeof(float)),
        .hdr_flip = malloc(count * sizeof(float)),
    };
    enum bd_err err = BD_ERR_OK;
    struct pictures pictures = {0};
    if (!out->square || !out->ssim || !out->flip || !out->hdr_flip)
        err = no_memory(detail);
    else
        err = open_pictures(input, &pictures, detail);
    if (!err) {
        load_pictures(input, &pictures);
        err = measure_planes(input, &pictures, out, detail);
        close_pictures(&pictures);
    }
    if (err) bd_metric_display_finish(out);
    return err;
}

void bd_metric_display_finish(struct bd_metric_display *display)
{
    free(display->square);
    free(display->ssim);
    free(display->flip);
    free(display->hdr_flip);
    *display = (struct bd_metric_display){0};
}
