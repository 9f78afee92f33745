#include "image/error_map.h"

#include <math.h>
#include <stdlib.h>

#include "image/tonemap.h"

const uint8_t bd_error_map_nonfinite[3] = {0, 255, 0};

static const uint8_t background[3] = {24, 24, 24}, ink[3] = {230, 230, 230};

// --- colours --------------------------------------------------------------------------------

static double xyz_of_lab(double f)
{
    const double delta = 6.0 / 29.0;
    return f > delta ? f * f * f : 3 * delta * delta * (f - 4.0 / 29.0);
}

// A spiral through CIE L*C*h: lightness 3 to 97 evenly, hue from violet over red to yellow, as much
// chroma as stays within sRGB all the way.
static void spiral(double t, uint8_t rgb[3])
{
    const double pi = acos(-1);
    double lightness = 3 + 94 * t, chroma = 62 * pow(sin(pi * t), 0.7);
    double hue = (285 + 170 * t) * pi / 180;
    double y = (lightness + 16) / 116;
    double x = xyz_of_lab(y + chroma * cos(hue) / 500) * 0.95047;
    double z = xyz_of_lab(y - chroma * sin(hue) / 200) * 1.08883;
    y = xyz_of_lab(y);
    // IEC 61966-2-1.
    rgb[0] = bd_srgb8((float)(3.2406 * x - 1.5372 * y - 0.4986 * z));
    rgb[1] = bd_srgb8((float)(-0.9689 * x + 1.8758 * y + 0.0415 * z));
    rgb[2] = bd_srgb8((float)(0.0557 * x - 0.2040 * y + 1.0570 * z));
}

static double decades(void)
{
    return log10(BD_ERROR_MAP_HIGH / BD_ERROR_MAP_LOW);
}

void bd_error_map_colour(double relative, uint8_t rgb[3])
{
    double t = log10(relative / BD_ERROR_MAP_LOW) / decades(); // 0: minus infinity
    spiral(fmin(fmax(t, 0), 1), rgb);
}

// --- the margin -----------------------------------------------------------------------------

// In units of the font's pixels.
enum {
    GAP = 4,
    LINE = BD_GLYPH_HEIGHT_PX + GAP,
    BAR_WIDTH = 12,
    TITLE_LETTERS = 10,
    MARGIN_WIDTH = TITLE_LETTERS * BD_GLYPH_WIDTH_PX + 2 * GAP,
    HEIGHT_LEAST = 10 * LINE,
};

static uint32_t text_scale(uint32_t height_px)
{
    uint32_t scale = height_px / 256;
    return scale < 1 ? 1 : (scale > 8 ? 8 : scale);
}

struct bar {
    uint32_t scale, x_px, top_px, height_px;
};

// `y_px` is from the bar's top, where the largest error is.
static void draw_bar(const struct bd_canvas *canvas, const struct bar *bar)
{
    for (uint32_t y_px = 0; y_px < bar->height_px; y_px++) {
        uint8_t rgb[3];
        spiral(1 - (double)y_px / (bar->height_px - 1), rgb);
        bd_canvas_fill(canvas, bar->x_px, bar->top_px + y_px, BAR_WIDTH * bar->scale, 1, rgb);
    }
}

static void draw_labels(const struct bd_canvas *canvas, const struct bar *bar)
{
    static const char *const labels[] = {"10", "1", "0.1", "0.01", "0.001"};
    const uint32_t count = sizeof labels / sizeof labels[0], scale = bar->scale;
    for (uint32_t i = 0; i < count; i++) {
        uint32_t y_px = bar->top_px + i * (bar->height_px - 1) / (count - 1);
        uint32_t x_px = bar->x_px + BAR_WIDTH * scale;
        bd_canvas_fill(canvas, x_px, y_px, 3 * scale, scale, ink);
        bd_canvas_text(canvas, x_px + 5 * scale, y_px - BD_GLYPH_HEIGHT_PX / 2 * scale, scale,
                       labels[i], ink);
    }
}

static void draw_margin(const struct bd_canvas *canvas, uint32_t left_px, uint32_t scale)
{
    struct bar bar = {.scale = scale, .x_px = left_px + GAP * scale, .top_px = 2 * LINE * scale};
    uint32_t legend_px = canvas->height_px - LINE * scale;
    bar.height_px = legend_px - LINE * scale - bar.top_px;
    bd_canvas_text(canvas, bar.x_px, GAP * scale, scale, "|I-R|/MEAN", ink);
    draw_bar(canvas, &bar);
    draw_labels(canvas, &bar);
    bd_canvas_fill(canvas, bar.x_px, legend_px, BAR_WIDTH * scale, BD_GLYPH_HEIGHT_PX * scale,
                   bd_error_map_nonfinite);
    bd_canvas_text(canvas, bar.x_px + (BAR_WIDTH + 5) * scale, legend_px, scale, "NAN INF", ink);
}

// --- the map --------------------------------------------------------------------------------

static void draw_errors(const struct bd_metric_input *input, double mean,
                        const struct bd_canvas *canvas)
{
    const struct bd_image *image = input->image[0];
    for (uint32_t y = 0; y < image->height_px; y++) {
        for (uint32_t x = 0; x < image->width_px; x++) {
            double error = bd_metric_pixel_error(input, (size_t)y * image->width_px + x);
            uint8_t rgb[3] = {bd_error_map_nonfinite[0], bd_error_map_nonfinite[1],
                              bd_error_map_nonfinite[2]};
            if (isfinite(error)) bd_error_map_colour(error > 0 ? error / fabs(mean) : 0, rgb);
            bd_canvas_fill(canvas, x, y, 1, 1, rgb);
        }
    }
}

enum bd_err bd_error_map(const struct bd_metric_input *input, double mean, struct bd_canvas *out,
                         struct bd_err_detail *detail)
{
    const struct bd_image *image = input->image[0];
    uint32_t scale = text_scale(image->height_px);
    *out = (struct bd_canvas){.width_px = image->width_px + MARGIN_WIDTH * scale,
                              .height_px = image->height_px};
    if (out->height_px < HEIGHT_LEAST * scale) out->height_px = HEIGHT_LEAST * scale;
    out->rgb8 = malloc((size_t)out->width_px * out->height_px * 3);
    if (!out->rgb8) return bd_err_set(detail, BD_ERR_NO_MEMORY, "map", "no memory for a map");
    bd_canvas_fill(out, 0, 0, out->width_px, out->height_px, background);
    draw_errors(input, mean, out);
    draw_margin(out, image->width_px, scale);
    return BD_ERR_OK;
}
