#include "vpl_pixels.h"

#include <math.h>
#include <stdlib.h>

#include "base/assert.h"
#include "base/hash.h"

// From one pixel to the next: what multires_gather calls a jump by default.
#define DEPTH_RATIO_MAX  1.05
#define NORMAL_CHORD_MAX 0.25

struct candidate {
    uint32_t x, y;
    uint64_t place; // along the curve
    double edge, contrast, probability;
};

static uint64_t spread_bits(uint64_t v)
{
    uint64_t out = 0;
    for (int bit = 0; bit < 32; bit++) out |= (v >> bit & 1) << (2 * bit);
    return out;
}

static int by_place(const void *a, const void *b)
{
    uint64_t left = ((const struct candidate *)a)->place;
    uint64_t right = ((const struct candidate *)b)->place;
    return (left > right) - (left < right);
}

static bool jumps(const struct vpl_picture *p, size_t a, size_t b)
{
    if (p->lit[a] != p->lit[b]) return true;
    double near = fmin(p->depth[a], p->depth[b]), far = fmax(p->depth[a], p->depth[b]), chord2 = 0;
    for (int c = 0; c < 3; c++) {
        double d = p->normals[a][c] - p->normals[b][c];
        chord2 += d * d;
    }
    return far > DEPTH_RATIO_MAX * near || chord2 > NORMAL_CHORD_MAX * NORMAL_CHORD_MAX;
}

static double difference(const struct vpl_picture *p, size_t a, size_t b)
{
    double most = 0;
    if (!p->lit[b]) return 0;
    for (int c = 0; c < 3; c++)
        most = fmax(most, fabs((double)p->irradiance[a][c] - (double)p->irradiance[b][c]));
    return most;
}

static struct candidate look_at(const struct vpl_picture *p, uint32_t x, uint32_t y)
{
    struct candidate c = {.x = x, .y = y, .place = spread_bits(x) | spread_bits(y) << 1};
    size_t at = (size_t)y * p->width_px + x;
    for (uint32_t ny = y ? y - 1 : 0; ny <= y + 1 && ny < p->height_px; ny++)
        for (uint32_t nx = x ? x - 1 : 0; nx <= x + 1 && nx < p->width_px; nx++) {
            size_t neighbour = (size_t)ny * p->width_px + nx;
            if (jumps(p, at, neighbour)) c.edge = 1;
            c.contrast = fmax(c.contrast, difference(p, at, neighbour));
        }
    return c;
}

// Probabilities that add up to `count`, none above 1: what is above goes to the others.
static void set_probabilities(struct candidate *candidates, uint32_t total, uint32_t count)
{
    double edges = 0, contrasts = 0;
    for (uint32_t i = 0; i < total; i++) {
        edges += candidates[i].edge;
        contrasts += candidates[i].contrast;
    }
    for (uint32_t i = 0; i < total; i++) {
        struct candidate *c = &candidates[i];
        c->probability = count *
                         (1.0 / total + (edges > 0 ? c->edge / edges : 0) +
                          (contrasts > 0 ? c->contrast / contrasts : 0)) /
                         3;
    }
    for (int round = 0; round < 64; round++) {
        double full = 0, rest = 0;
        for (uint32_t i = 0; i < total; i++) {
            if (candidates[i].probability >= 1)
                full += candidates[i].probability = 1;
            else
                rest += candidates[i].probability;
        }
        double scale = rest > 0 ? (count - full) / rest : 1;
        if (scale < 1 + 1e-12) break;
        for (uint32_t i = 0; i < total; i++)
            if (candidates[i].probability < 1)
                candidates[i].probability = fmin(1, candidates[i].probability * scale);
    }
}

struct vpl_pixel *vpl_pixels_choose(const struct vpl_picture *p, uint32_t count, uint64_t seed,
                                    uint32_t *chosen)
{
    size_t pixels = (size_t)p->width_px * p->height_px;
    struct candidate *candidates = malloc((pixels + 1) * sizeof *candidates);
    struct vpl_pixel *out = malloc((count + 1) * sizeof *out);
    BD_ASSERT(candidates && out);
    uint32_t total = 0;
    for (uint32_t y = 0; y < p->height_px; y++)
        for (uint32_t x = 0; x < p->width_px; x++)
            if (p->lit[(size_t)y * p->width_px + x]) candidates[total++] = look_at(p, x, y);
    qsort(candidates, total, sizeof *candidates, by_place);
    if (count < total)
        set_probabilities(candidates, total, count);
    else
        for (uint32_t i = 0; i < total; i++) candidates[i].probability = 1;
    // One place in each unit of summed probability, the same in all: no pixel is met twice.
    double place = (double)(bd_hash64(&seed, sizeof seed, 0) >> 11) * 0x1p-53, sum = 0;
    *chosen = 0;
    for (uint32_t i = 0; i < total && *chosen < count; i++) {
        sum += candidates[i].probability;
        if (candidates[i].probability < 1 && sum <= place + *chosen) continue;
        out[(*chosen)++] =
            (struct vpl_pixel){candidates[i].x, candidates[i].y, candidates[i].probability};
    }
    free(candidates);
    return out;
}
