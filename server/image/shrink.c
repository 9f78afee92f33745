#include "image/shrink.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "image/tonemap.h"

// Linear light in 16 bits: the darkest code but black is 20, so that one code alone comes back as
// itself.
#define LINEAR_ONE 65535u

static void fill_linear(uint32_t linear[256])
{
    for (int i = 0; i < 256; i++) {
        double s = i / 255.0;
        double light = s <= 0.04045 ? s / 12.92 : pow((s + 0.055) / 1.055, 2.4);
        linear[i] = (uint32_t)lround(light * LINEAR_ONE);
    }
}

// What source texels `first` to `last` share with one texel of the result, along one axis. Lengths
// are in units of which a source texel has `to` and a texel of the result `from`.
struct cover {
    uint32_t first, last;
    uint64_t begin, end;
    uint32_t to;
};

static struct cover cover_of(uint32_t at, uint32_t from, uint32_t to)
{
    const uint64_t begin = (uint64_t)at * from, end = begin + from;
    return (struct cover){(uint32_t)(begin / to), (uint32_t)((end - 1) / to), begin, end, to};
}

static uint64_t weight_of(const struct cover *cover, uint32_t texel)
{
    const uint64_t begin = (uint64_t)texel * cover->to, end = begin + cover->to;
    return (end < cover->end ? end : cover->end) - (begin > cover->begin ? begin : cover->begin);
}

struct sums {
    const struct bd_texels *from, *to;
    enum bd_texel_kind kind;
    uint32_t linear[256];
    uint64_t *row; // four a source column: the rows that a row of the result covers, added up
};

static void add_row(struct sums *sums, const uint8_t *texels, uint64_t weight)
{
    const bool is_color = sums->kind == BD_TEXEL_COLOR;
    for (size_t x = 0; x < sums->from->width_px; x++) {
        const uint8_t *texel = texels + 4 * x;
        uint64_t *sum = sums->row + 4 * x;
        for (int c = 0; c < 3; c++)
            sum[c] += weight * (is_color ? sums->linear[texel[c]] : texel[c]);
        sum[3] += weight * texel[3];
    }
}

static void add_rows(struct sums *sums, const struct cover *rows)
{
    memset(sums->row, 0, 4 * sizeof *sums->row * sums->from->width_px);
    for (uint32_t y = rows->first; y <= rows->last; y++)
        add_row(sums, sums->from->rgba + 4 * (size_t)y * sums->from->width_px, weight_of(rows, y));
}

static uint8_t rounded(uint64_t sum, uint64_t area)
{
    return (uint8_t)((sum + area / 2) / area);
}

// A code c stands for 2 c / 255 - 1. Opposite directions leave none: then straight up.
static void store_normal(const uint64_t sum[4], uint64_t area, uint8_t out[4])
{
    double n[3], length2 = 0;
    for (int c = 0; c < 3; c++) {
        n[c] = 2 * (double)sum[c] - 255 * (double)area;
        length2 += n[c] * n[c];
    }
    if (length2 == 0) n[2] = length2 = 1;
    for (int c = 0; c < 3; c++) out[c] = (uint8_t)lround((n[c] / sqrt(length2) + 1) * 127.5);
    out[3] = rounded(sum[3], area);
}

static void store_color(const uint64_t sum[4], uint64_t area, uint8_t out[4])
{
    for (int c = 0; c < 3; c++)
        out[c] = bd_srgb8((float)((double)sum[c] / ((double)area * LINEAR_ONE)));
    out[3] = rounded(sum[3], area);
}

static void store(enum bd_texel_kind kind, const uint64_t sum[4], uint64_t area, uint8_t out[4])
{
    switch (kind) {
    case BD_TEXEL_COLOR:
        store_color(sum, area, out);
        break;
    case BD_TEXEL_NORMAL:
        store_normal(sum, area, out);
        break;
    case BD_TEXEL_DATA:
        for (int c = 0; c < 4; c++) out[c] = rounded(sum[c], area);
        break;
    }
}

static void finish_row(const struct sums *sums, uint8_t *out)
{
    const uint32_t from = sums->from->width_px, to = sums->to->width_px;
    const uint64_t area = (uint64_t)from * sums->from->height_px;
    for (uint32_t x = 0; x < to; x++) {
        const struct cover columns = cover_of(x, from, to);
        uint64_t sum[4] = {0};
        for (uint32_t i = columns.first; i <= columns.last; i++) {
            const uint64_t weight = weight_of(&columns, i), *row = sums->row + 4 * (size_t)i;
            for (int c = 0; c < 4; c++) sum[c] += weight * row[c];
        }
        store(sums->kind, sum, area, out + 4 * (size_t)x);
    }
}

bool bd_shrink(const struct bd_texels *from, enum bd_texel_kind kind, const struct bd_texels *to)
{
    BD_ASSERT(to->width_px > 0 && to->width_px <= from->width_px);
    BD_ASSERT(to->height_px > 0 && to->height_px <= from->height_px);
    struct sums sums = {.from = from, .to = to, .kind = kind};
    sums.row = malloc(4 * sizeof *sums.row * from->width_px);
    if (!sums.row) return false;
    fill_linear(sums.linear);
    for (uint32_t y = 0; y < to->height_px; y++) {
        const struct cover rows = cover_of(y, from->height_px, to->height_px);
        add_rows(&sums, &rows);
        finish_row(&sums, to->rgba + 4 * (size_t)y * to->width_px);
    }
    free(sums.row);
    return true;
}
