// What predicts the squared error of a pixel, from the frame and a first look at the truth.
//
// Every feature is a squared radiance (or a squared radiance where an edge is, and 0 elsewhere),
// and enters by its share of the frame's sum: the mixture needs no unit. What choosing by it gains:
// tests/bench/results/NOTES.md.

#include <math.h>
#include <stdlib.h>

#include "reference/check_plan.h"
#include "reference/check_scout.h"
#include "reference/check_ties.h"

enum feature {
    FEATURE_CONSTANT,
    FEATURE_LUMINANCE, // the pixel's own square
    FEATURE_INDIRECT,  // that of its indirect light
    FEATURE_CONTRAST,  // largest squared difference to a neighbour
    FEATURE_INDIRECT_CONTRAST,
    FEATURE_INDIRECT_GRAIN, // median instead of largest
    FEATURE_SPIKE,          // excess of indirect light over the median of its neighbours
    FEATURE_EDGE,           // 1 where depth, normal or albedo jump
    FEATURE_EDGE_LUMINANCE, // brightest neighbour's square there
    FEATURE_LEVEL,          // luminance where it was shaded coarsely
    FEATURE_SURPRISE,       // what a first look found there
    FEATURE_SURPRISE_AROUND,
    FEATURE_LONE, // smallest squared difference to a neighbour: a bright speck that stands alone
    FEATURE_TIE,  // brightest square around, where the reference sees another surface
    FEATURE_COUNT,
};

static const double feature_share[FEATURE_COUNT] = {
    [FEATURE_CONSTANT] = 0.20,
    [FEATURE_LUMINANCE] = 0.15,
    [FEATURE_INDIRECT] = 0.10,
    [FEATURE_CONTRAST] = 0.15,
    [FEATURE_INDIRECT_CONTRAST] = 0.15,
    [FEATURE_INDIRECT_GRAIN] = 0.05,
    [FEATURE_SPIKE] = 0.05,
    [FEATURE_EDGE] = 0.05,
    [FEATURE_EDGE_LUMINANCE] = 0.10,
    [FEATURE_LEVEL] = 0.15,
    [FEATURE_SURPRISE] = 0.30,
    [FEATURE_SURPRISE_AROUND] = 0.50,
    [FEATURE_LONE] = 0.20,
    [FEATURE_TIE] = 0.50,
};

// An edge: neighbours' depths differ by more than this share of the nearer one, or their normals by
// more than this chord (algorithms.md A1), or their albedos by more than this length.
#define EDGE_DEPTH  0.1f
#define EDGE_NORMAL 0.5f
#define EDGE_ALBEDO 0.2f

#define NEIGHBOUR_COUNT 8

// The pixel itself where a neighbour would be outside of the picture.
struct neighbours {
    uint32_t x[NEIGHBOUR_COUNT], y[NEIGHBOUR_COUNT];
};

static struct neighbours neighbours_of(uint32_t x, uint32_t y, uint32_t width, uint32_t height)
{
    struct neighbours around;
    uint32_t k = 0;
    for (int dy = -1; dy <= 1; dy++) {
        for (int dx = -1; dx <= 1; dx++) {
            if (dx == 0 && dy == 0) continue;
            bool inside = (x > 0 || dx >= 0) && (x + 1 < width || dx <= 0) && (y > 0 || dy >= 0) &&
                          (y + 1 < height || dy <= 0);
            around.x[k] = inside ? (uint32_t)((int64_t)x + dx) : x;
            around.y[k++] = inside ? (uint32_t)((int64_t)y + dy) : y;
        }
    }
    return around;
}

static bool is_finite(const float *rgb)
{
    return isfinite(rgb[0]) && isfinite(rgb[1]) && isfinite(rgb[2]);
}

static double square(const float *rgb)
{
    return ((double)rgb[0] * rgb[0] + (double)rgb[1] * rgb[1] + (double)rgb[2] * rgb[2]) / 3;
}

static double square_difference(const float *a, const float *b)
{
    const float d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    return square(d);
}

static double mean(const float *rgb)
{
    return ((double)rgb[0] + rgb[1] + rgb[2]) / 3;
}

static void sort_eight(double values[NEIGHBOUR_COUNT])
{
    for (int i = 1; i < NEIGHBOUR_COUNT; i++) {
        double value = values[i];
        int at = i;
        for (; at > 0 && values[at - 1] > value; at--) values[at] = values[at - 1];
        values[at] = value;
    }
}

static double median(double values[NEIGHBOUR_COUNT])
{
    sort_eight(values);
    return (values[NEIGHBOUR_COUNT / 2 - 1] + values[NEIGHBOUR_COUNT / 2]) / 2;
}

static void indirect_features(const struct bd_image *indirect, uint32_t x, uint32_t y,
                              const struct neighbours *around, double out[FEATURE_COUNT])
{
    const float *here = bd_image_at(indirect, x, y);
    if (!is_finite(here)) return;
    double differences[NEIGHBOUR_COUNT], means[NEIGHBOUR_COUNT];
    for (int k = 0; k < NEIGHBOUR_COUNT; k++) {
        const float *there = bd_image_at(indirect, around->x[k], around->y[k]);
        if (!is_finite(there)) there = here;
        differences[k] = square_difference(here, there);
        means[k] = mean(there);
        out[FEATURE_INDIRECT_CONTRAST] = fmax(out[FEATURE_INDIRECT_CONTRAST], differences[k]);
    }
    double excess = fmax(mean(here) - median(means), 0);
    out[FEATURE_INDIRECT] = square(here);
    out[FEATURE_INDIRECT_GRAIN] = median(differences);
    out[FEATURE_SPIKE] = excess * excess;
}

struct bd_check_surface bd_check_surface_at(const struct bd_check_frame *frame, uint32_t x_px,
                                            uint32_t y_px)
{
    struct bd_check_surface out = {0};
    if (frame->depth) out.depth_m = *bd_image_at(frame->depth, x_px, y_px);
    for (int k = 0; k < 3; k++) {
        if (frame->normal) out.normal[k] = bd_image_at(frame->normal, x_px, y_px)[k];
        if (frame->albedo) out.albedo[k] = bd_image_at(frame->albedo, x_px, y_px)[k];
    }
    return out;
}

bool bd_check_is_other_surface(const struct bd_check_surface *a, const struct bd_check_surface *b)
{
    return fabsf(a->depth_m - b->depth_m) > EDGE_DEPTH * fminf(a->depth_m, b->depth_m) ||
           3 * square_difference(a->normal, b->normal) > (double)(EDGE_NORMAL * EDGE_NORMAL) ||
           3 * square_difference(a->albedo, b->albedo) > (double)(EDGE_ALBEDO * EDGE_ALBEDO);
}

static bool is_edge(const struct bd_check_frame *frame, uint32_t x, uint32_t y,
                    const struct neighbours *around)
{
    const struct bd_check_surface here = bd_check_surface_at(frame, x, y);
    for (int k = 0; k < NEIGHBOUR_COUNT; k++) {
        const struct bd_check_surface there =
            bd_check_surface_at(frame, around->x[k], around->y[k]);
        if (bd_check_is_other_surface(&here, &there)) return true;
    }
    return false;
}

bool bd_check_is_edge(const struct bd_check_frame *frame, uint32_t x_px, uint32_t y_px)
{
    const struct neighbours around =
        neighbours_of(x_px, y_px, frame->beauty->width_px, frame->beauty->height_px);
    return is_edge(frame, x_px, y_px, &around);
}

// All zero where beauty is not finite: such pixels are not measured.
static void features_at(const struct bd_check_frame *frame, uint32_t x, uint32_t y,
                        double out[FEATURE_COUNT])
{
    for (int f = 0; f < FEATURE_COUNT; f++) out[f] = 0;
    const struct bd_image *beauty = frame->beauty;
    const float *here = bd_image_at(beauty, x, y);
    if (!is_finite(here)) return;
    struct neighbours around = neighbours_of(x, y, beauty->width_px, beauty->height_px);
    double brightest = square(here), nearest = INFINITY;
    out[FEATURE_CONSTANT] = 1;
    out[FEATURE_LUMINANCE] = brightest;
    for (int k = 0; k < NEIGHBOUR_COUNT; k++) {
        const float *there = bd_image_at(beauty, around.x[k], around.y[k]);
        if (!is_finite(there)) continue;
        double difference = square_difference(here, there);
        bool is_itself = around.x[k] == x && around.y[k] == y;
        out[FEATURE_CONTRAST] = fmax(out[FEATURE_CONTRAST], difference);
        if (!is_itself) nearest = fmin(nearest, difference);
        brightest = fmax(brightest, square(there));
    }
    if (isfinite(nearest)) out[FEATURE_LONE] = nearest;
    if (frame->indirect) indirect_features(frame->indirect, x, y, &around, out);
    if (is_edge(frame, x, y, &around)) {
        out[FEATURE_EDGE] = 1;
        out[FEATURE_EDGE_LUMINANCE] = brightest;
    }
    if (frame->surprise) {
        const double *surprise = bd_check_surprise_at(frame->surprise, x, y);
        out[FEATURE_SURPRISE] = surprise[0];
        out[FEATURE_SURPRISE_AROUND] = surprise[1];
    }
    if (frame->ties && frame->ties->differs[(size_t)y * beauty->width_px + x])
        out[FEATURE_TIE] = brightest;
    if (frame->level)
        out[FEATURE_LEVEL] = (double)*bd_image_at(frame->level, x, y) * out[FEATURE_LUMINANCE];
}

float bd_check_contrast(const struct bd_image *beauty, uint32_t index)
{
    const struct bd_check_frame frame = {.beauty = beauty};
    double features[FEATURE_COUNT];
    features_at(&frame, index % beauty->width_px, index / beauty->width_px, features);
    return (float)features[FEATURE_CONTRAST];
}

// What each feature counts for, so that the scores add up to 1 over the frame.
static void weigh_features(const double total[FEATURE_COUNT], double weight[FEATURE_COUNT])
{
    double share = 0;
    for (int f = 0; f < FEATURE_COUNT; f++)
        if (total[f] > 0) share += feature_share[f];
    for (int f = 0; f < FEATURE_COUNT; f++)
        weight[f] = total[f] > 0 ? feature_share[f] / share / total[f] : 0;
}

float *bd_check_scores(const struct bd_check_frame *frame)
{
    uint32_t width = frame->beauty->width_px, height = frame->beauty->height_px;
    float *scores = malloc((size_t)width * height * sizeof *scores);
    if (!scores) return NULL;
    double features[FEATURE_COUNT], total[FEATURE_COUNT] = {0}, weight[FEATURE_COUNT];
    for (uint32_t y = 0; y < height; y++) {
        for (uint32_t x = 0; x < width; x++) {
            features_at(frame, x, y, features);
            for (int f = 0; f < FEATURE_COUNT; f++) total[f] += features[f];
        }
    }
    weigh_features(total, weight);
    for (uint32_t y = 0; y < height; y++) {
        for (uint32_t x = 0; x < width; x++) {
            features_at(frame, x, y, features);
            double score = 0;
            for (int f = 0; f < FEATURE_COUNT; f++) score += weight[f] * features[f];
            scores[(size_t)y * width + x] = (float)score;
        }
    }
    return scores;
}
