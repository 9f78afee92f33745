#include "image/metric.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "image/metric_display.h"
#include "image/metric_sums.h"
#include "image/ssim.h"

static const struct {
    const char *name, *what;
    enum bd_metric_goal goal;
} rows[BD_METRIC_COUNT] = {
#define X(name, text, goal, what) [BD_METRIC_##name] = {text, what, BD_GOAL_##goal},
    BD_METRIC_MAP(X)
#undef X
};

const char *bd_metric_name(enum bd_metric metric)
{
    BD_ASSERT_CMP(metric, <, BD_METRIC_COUNT);
    return rows[metric].name;
}

const char *bd_metric_what(enum bd_metric metric)
{
    BD_ASSERT_CMP(metric, <, BD_METRIC_COUNT);
    return rows[metric].what;
}

enum bd_metric_goal bd_metric_goal(enum bd_metric metric)
{
    BD_ASSERT_CMP(metric, <, BD_METRIC_COUNT);
    return rows[metric].goal;
}

bool bd_metric_from_name(const char *name, enum bd_metric *out)
{
    for (int i = 0; i < BD_METRIC_COUNT; i++) {
        if (strcmp(rows[i].name, name) != 0) continue;
        *out = (enum bd_metric)i;
        return true;
    }
    return false;
}

double bd_metric_pixel_error(const struct bd_metric_input *input, size_t p)
{
    struct bd_metric_pixel pixel = bd_metric_pixel_at(input, p);
    return bd_metric_pixel_is_finite(&pixel) ? bd_metric_pixel_mean_error(&pixel) : (double)NAN;
}

// --- what is refused ------------------------------------------------------------------------

static bool same_shape(const struct bd_image *a, const struct bd_image *b)
{
    return a->width_px == b->width_px && a->height_px == b->height_px &&
           a->channel_count == b->channel_count;
}

static enum bd_err shapes_differ(const char *field, const char *what, const struct bd_image *a,
                                 const struct bd_image *b, struct bd_err_detail *detail)
{
    return bd_err_set(detail, BD_ERR_USAGE, field, "%s: %ux%ux%u and %ux%ux%u", what, a->width_px,
                      a->height_px, a->channel_count, b->width_px, b->height_px, b->channel_count);
}

static enum bd_err check_shapes(const struct bd_metric_input *input, struct bd_err_detail *detail)
{
    const struct bd_image *const *reference = input->reference, *const *image = input->image;
    if (!same_shape(reference[0], reference[1]))
        return shapes_differ("reference", "the reference's halves differ", reference[0],
                             reference[1], detail);
    if (!same_shape(image[0], image[1]))
        return shapes_differ("image", "the image's halves differ", image[0], image[1], detail);
    if (!same_shape(reference[0], image[0]))
        return shapes_differ("image", "reference and image differ", reference[0], image[0], detail);
    return BD_ERR_OK;
}

static enum bd_err check_reference(const struct bd_metric_input *input,
                                   struct bd_err_detail *detail)
{
    const struct bd_image *a = input->reference[0], *b = input->reference[1];
    size_t count = (size_t)a->width_px * a->height_px * a->channel_count, bad = 0, first = 0;
    for (size_t i = 0; i < count; i++) {
        if (isfinite(a->pixels[i]) && isfinite(b->pixels[i])) continue;
        if (!bad++) first = i / a->channel_count;
    }
    if (!bad) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_BAD_INPUT, "reference",
                      "the reference has %zu samples that are NaN or infinite, the first in "
                      "pixel %zu,%zu: nothing can be measured against it",
                      bad, first % a->width_px, first / a->width_px);
}

// --- measuring ------------------------------------------------------------------------------

struct measuring {
    const struct bd_metric_input *input;
    struct bd_metric_scale scale;
    struct bd_metric_display display; // empty unless asked for
    double *sums;                     // [tile][BD_TERM_COUNT]
    struct bd_tiled_value *relative;  // of finite pixels
    uint32_t margin_px;               // where SSIM counts
    struct bd_metrics *out;
};

// Over the finite pixels, as the sums are.
static struct bd_metric_scale measure_scale(const struct bd_metric_input *input)
{
    struct bd_metric_scale scale = {0};
    size_t count = (size_t)input->image[0]->width_px * input->image[0]->height_px, finite = 0;
    for (size_t p = 0; p < count; p++) {
        struct bd_metric_pixel pixel = bd_metric_pixel_at(input, p);
        if (!bd_metric_pixel_is_finite(&pixel)) continue;
        for (uint32_t c = 0; c < pixel.channel_count; c++) {
            double r = 0.5 * ((double)pixel.reference[0][c] + (double)pixel.reference[1][c]);
            scale.mean += r / pixel.channel_count;
            scale.max = fmax(scale.max, fabs(r));
        }
        finite++;
    }
    scale.mean = finite ? fabs(scale.mean / (double)finite) : 0;
    return scale;
}

static void add_display(struct measuring *m, size_t p, uint32_t x, uint32_t y, double *sums)
{
    const struct bd_image *image = m->input->image[0];
    sums[BD_TERM_DISPLAY_SQUARE] += (double)m->display.square[p];
    sums[BD_TERM_FLIP] += (double)m->display.flip[p];
    sums[BD_TERM_HDR_FLIP] += (double)m->display.hdr_flip[p];
    if (x < m->margin_px || y < m->margin_px || x + m->margin_px >= image->width_px ||
        y + m->margin_px >= image->height_px)
        return;
    sums[BD_TERM_SSIM] += (double)m->display.ssim[p];
    sums[BD_TERM_SSIM_PIXELS] += 1;
}

static void set_value(struct bd_metrics *out, enum bd_metric metric, double value)
{
    out->figures[metric] = (struct bd_figure){value, value, value};
    out->states[metric] = BD_METRIC_VALUE_ONLY;
}

static double max_abs_of(const struct bd_metric_pixel *pixel)
{
    double most = 0;
    for (uint32_t c = 0; c < pixel->channel_count; c++) {
        double i = 0.5 * ((double)pixel->image[0][c] + (double)pixel->image[1][c]);
        double r = 0.5 * ((double)pixel->reference[0][c] + (double)pixel->reference[1][c]);
        most = fmax(most, fabs(i - r));
    }
    return most;
}

// One walk over the pixels: sums, list of relative errors, largest ones, count of non-finite ones.
static void walk(struct measuring *m)
{
    const struct bd_image *image = m->input->image[0];
    struct bd_metrics *out = m->out;
    double max_abs = 0, max_rel = 0;
    size_t nonfinite = 0;
    for (size_t p = 0; p < (size_t)image->width_px * image->height_px; p++) {
        struct bd_metric_pixel pixel = bd_metric_pixel_at(m->input, p);
        if (!bd_metric_pixel_is_finite(&pixel)) {
            nonfinite++;
            continue;
        }
        uint32_t x = (uint32_t)(p % image->width_px), y = (uint32_t)(p / image->width_px);
        size_t tile = bd_tiles_at(&out->tiles, x, y);
        double *sums = m->sums + tile * BD_TERM_COUNT;
        double relative = bd_metric_add(&pixel, &m->scale, sums);
        if (m->input->display) add_display(m, p, x, y, sums);
        m->relative[out->pixel_count++] = (struct bd_tiled_value){(float)relative, (uint32_t)tile};
        max_rel = fmax(max_rel, relative);
        max_abs = fmax(max_abs, max_abs_of(&pixel));
    }
    set_value(out, BD_METRIC_NONFINITE, (double)nonfinite);
    if (!out->pixel_count) return;
    set_value(out, BD_METRIC_MAX_REL, max_rel);
    set_value(out, BD_METRIC_MAX_ABS, max_abs);
}

static int descending(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x < y) - (x > y);
}

// The error above which half of all error lies. Sorts.
static double weighted_median(float *errors, size_t count)
{
    double total = 0, seen = 0;
    for (size_t p = 0; p < count; p++) total += (double)errors[p];
    qsort(errors, count, sizeof *errors, descending);
    size_t p = 0;
    while (p + 1 < count && (seen += (double)errors[p]) < 0.5 * total) p++;
    return (double)errors[p];
}

static bool is_present(const struct bd_metric_input *input, const struct bd_metrics *out,
                       enum bd_metric metric)
{
    if (metric == BD_METRIC_HDR_FLIP) return input->display && !input->shown;
    if (metric == BD_METRIC_PSNR || metric == BD_METRIC_SSIM || metric == BD_METRIC_FLIP)
        return input->display;
    if (metric == BD_METRIC_NOISE_FLOOR || metric == BD_METRIC_MAPE_FLOOR ||
        metric == BD_METRIC_SMAPE_FLOOR)
        return out->reference_debiased || out->image_debiased;
    return true;
}

static enum bd_err find_intervals(struct measuring *m, struct bd_err_detail *detail)
{
    static const double levels[2] = {0.99, 0.999};
    _Static_assert(BD_METRIC_P999 == BD_METRIC_P99 + 1, "one call finds both");
    struct bd_metrics *out = m->out;
    size_t tile_count = bd_tiles_count(&out->tiles);
    struct bd_statistics statistics = {BD_TERM_COUNT, BD_METRIC_SUM_COUNT, bd_metric_evaluate,
                                       &m->scale};
    enum bd_err err = bd_bootstrap(&statistics, m->sums, tile_count, out->figures, detail);
    if (!err)
        err = bd_bootstrap_quantiles(m->relative, out->pixel_count, tile_count, levels, 2,
                                     &out->figures[BD_METRIC_P99], detail);
    if (err) return err;
    for (int i = 0; i < BD_METRIC_SUM_COUNT; i++)
        if (is_present(m->input, out, (enum bd_metric)i)) out->states[i] = BD_METRIC_WITH_INTERVAL;
    return BD_ERR_OK;
}

static enum bd_err measure(struct measuring *m, struct bd_err_detail *detail)
{
    const struct bd_image *image = m->input->image[0];
    size_t pixel_count = (size_t)image->width_px * image->height_px;
    m->scale = measure_scale(m->input);
    m->margin_px =
        image->width_px > 2 * BD_SSIM_MARGIN_PX && image->height_px > 2 * BD_SSIM_MARGIN_PX
            ? BD_SSIM_MARGIN_PX
            : 0;
    enum bd_err err = BD_ERR_OK;
    if (m->input->display) err = bd_metric_display_measure(m->input, &m->display, detail);
    if (err) return err;
    walk(m);
    if (!m->out->pixel_count) return BD_ERR_OK;
    if (m->input->display) m->out->display_stops = log2(m->display.exposure);
    if (m->input->display && !m->input->shown) {
        m->out->hdr_exposures = m->display.hdr_exposures;
        set_value(m->out, BD_METRIC_HDR_FLIP_MEDIAN,
                  weighted_median(m->display.hdr_flip, pixel_count));
    }
    return find_intervals(m, detail);
}

enum bd_err bd_metrics_measure(const struct bd_metric_input *input, struct bd_metrics *out,
                               struct bd_err_detail *detail)
{
    enum bd_err err = check_shapes(input, detail);
    if (!err) err = check_reference(input, detail);
    if (err) return err;
    const struct bd_image *image = input->image[0];
    BD_ASSERT(!input->display || image->channel_count == 3);
    *out = (struct bd_metrics){
        .tiles = bd_tiles_of(image->width_px, image->height_px),
        .reference_debiased = input->reference[0] != input->reference[1],
        .image_debiased = input->image[0] != input->image[1],
    };
    size_t pixel_count = (size_t)image->width_px * image->height_px;
    struct measuring m = {
        .input = input,
        .sums = calloc(bd_tiles_count(&out->tiles) * BD_TERM_COUNT, sizeof(double)),
        .relative = malloc(pixel_count * sizeof(struct bd_tiled_value)),
        .out = out,
    };
    if (m.sums && m.relative)
        err = measure(&m, detail);
    else
        err = bd_err_set(detail, BD_ERR_NO_MEMORY, "metric", "no memory to measure with");
    bd_metric_display_finish(&m.display);
    free(m.sums);
    free(m.relative);
    return err;
}
