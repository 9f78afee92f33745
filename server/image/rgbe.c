#include "image/rgbe.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define LINE_MAX       256 // bytes of a head's line that are looked at
#define RUNS_WIDTH_MIN 8   // rows in planes with runs go from here
#define RUNS_WIDTH_MAX 32767
#define RUN_MIN        128 // a count above is a run of count - RUN_MIN

struct input {
    const uint8_t *at;
    size_t left;
};

struct head {
    uint32_t width_px, height_px;
    bool is_upwards, is_leftwards;
    double exposure;
};

static enum bd_err refuse(struct bd_err_detail *detail, const char *why)
{
    return bd_err_set(detail, BD_ERR_BAD_INPUT, "hdr", "cannot read Radiance picture: %s", why);
}

bool bd_rgbe_is(const void *bytes, size_t size_bytes)
{
    return size_bytes >= 2 && memcmp(bytes, "#?", 2) == 0;
}

static const uint8_t *take(struct input *in, size_t bytes)
{
    if (bytes > in->left) return NULL;
    const uint8_t *at = in->at;
    in->at += bytes;
    in->left -= bytes;
    return at;
}

// The next line, cut at LINE_MAX - 1 bytes; false if no line ends in what is left.
static bool take_line(struct input *in, char out[LINE_MAX])
{
    const uint8_t *end = in->left > 0 ? memchr(in->at, '\n', in->left) : NULL;
    if (!end) return false;
    const size_t length = (size_t)(end - in->at);
    snprintf(out, LINE_MAX, "%.*s", (int)(length < LINE_MAX ? length : LINE_MAX - 1),
             (const char *)in->at);
    take(in, length + 1);
    const size_t kept = strlen(out);
    if (kept > 0 && out[kept - 1] == '\r') out[kept - 1] = 0;
    return true;
}

static enum bd_err read_variable(const char *line, struct head *head, struct bd_err_detail *detail)
{
    if (strncmp(line, "FORMAT=", 7) == 0 && strcmp(line + 7, "32-bit_rle_rgbe") != 0)
        return bd_err_set(detail, BD_ERR_UNSUPPORTED, "hdr",
                          "Radiance pictures of FORMAT %.40s are not read; 32-bit_rle_rgbe is",
                          line + 7);
    if (strncmp(line, "EXPOSURE=", 9) != 0) return BD_ERR_OK;
    head->exposure *= strtod(line + 9, NULL);
    if (!(head->exposure > 1e-30 && head->exposure < 1e30))
        return refuse(detail, "EXPOSURE is not from 1e-30 to 1e30");
    return BD_ERR_OK;
}

static enum bd_err read_head(struct input *in, uint32_t side_px_max, struct head *head,
                             struct bd_err_detail *detail)
{
    char line[LINE_MAX];
    enum bd_err err = BD_ERR_OK;
    head->exposure = 1;
    do {
        if (!take_line(in, line)) return refuse(detail, "its head ends early");
        err = read_variable(line, head, detail);
    } while (!err && line[0]);
    if (err) return err;
    if (!take_line(in, line)) return refuse(detail, "its head ends early");
    char y_sign, x_sign, rest;
    long long height, width;
    if (sscanf(line, "%cX %9lld %cY %9lld", &x_sign, &width, &y_sign, &height) == 4)
        return bd_err_set(detail, BD_ERR_UNSUPPORTED, "hdr",
                          "Radiance pictures on their side are not read");
    if (sscanf(line, "%cY %9lld %cX %9lld%c", &y_sign, &height, &x_sign, &width, &rest) != 4 ||
        (y_sign != '-' && y_sign != '+') || (x_sign != '-' && x_sign != '+') || width < 1 ||
        height < 1)
        return refuse(detail, "the line of its size is not -Y HEIGHT +X WIDTH");
    if (width > side_px_max || height > side_px_max)
        return bd_err_set(detail, BD_ERR_LIMIT, "hdr",
                          "Radiance picture of %lldx%lld; at most %u "
                          "a side",
                          width, height, side_px_max);
    // No row takes less than one pixel.
    if ((uint64_t)height * 4 > in->left)
        return bd_err_set(detail, BD_ERR_BAD_INPUT, "hdr",
                          "Radiance picture of %lldx%lld in %zu bytes is truncated", width, height,
                          in->left);
    head->width_px = (uint32_t)width;
    head->height_px = (uint32_t)height;
    head->is_upwards = y_sign == '+';
    head->is_leftwards = x_sign == '-';
    return BD_ERR_OK;
}

// One of a row's four planes, every fourth byte of `out`.
static bool read_plane(struct input *in, uint32_t width_px, uint8_t *out)
{
    for (uint32_t x = 0; x < width_px;) {
        const uint8_t *count = take(in, 1);
        if (!count || *count == 0) return false;
        const bool is_run = *count > RUN_MIN;
        const uint32_t length = is_run ? *count - RUN_MIN : *count;
        const uint8_t *from = take(in, is_run ? 1 : length);
        if (!from || length > width_px - x) return false;
        for (uint32_t i = 0; i < length; i++) out[4 * (size_t)x++] = from[is_run ? 0 : i];
    }
    return true;
}

// Pixels one by one; 1, 1, 1, n repeats the one before n times, and directly behind another such
// n * 256 times, and so on.
static bool read_pixels(struct input *in, uint32_t width_px, uint8_t *out)
{
    uint32_t shift = 0;
    for (uint32_t x = 0; x < width_px;) {
        const uint8_t *pixel = take(in, 4);
        if (!pixel) return false;
        const bool is_run = pixel[0] == 1 && pixel[1] == 1 && pixel[2] == 1;
        if (!is_run) {
            memcpy(out + 4 * (size_t)x++, pixel, 4);
            shift = 0;
            continue;
        }
        const uint64_t length = (uint64_t)pixel[3] << shift;
        if (x == 0 || shift > 24 || length > width_px - x) return false;
        for (uint64_t i = 0; i < length; i++, x++)
            memcpy(out + 4 * (size_t)x, out + 4 * (size_t)(x - 1), 4);
        shift += 8;
    }
    return true;
}

static bool read_row(struct input *in, uint32_t width_px, uint8_t *out)
{
    const uint8_t *at = in->at;
    const bool is_in_planes = width_px >= RUNS_WIDTH_MIN && width_px <= RUNS_WIDTH_MAX &&
                              in->left >= 4 && at[0] == 2 && at[1] == 2 &&
                              (uint32_t)(at[2] << 8 | at[3]) == width_px;
    if (!is_in_planes) return read_pixels(in, width_px, out);
    take(in, 4);
    for (int plane = 0; plane < 4; plane++)
        if (!read_plane(in, width_px, out + plane)) return false;
    return true;
}

static void convert_row(const uint8_t *row, const struct head *head, float *out)
{
    for (uint32_t x = 0; x < head->width_px; x++) {
        const uint8_t *from = row + 4 * (size_t)(head->is_leftwards ? head->width_px - 1 - x : x);
        const double step = from[3] ? ldexp(1 / head->exposure, from[3] - 136) : 0;
        for (int c = 0; c < 3; c++) out[3 * (size_t)x + (size_t)c] = (float)((from[c] + .5) * step);
    }
}

enum bd_err bd_rgbe_read(const void *bytes, size_t size_bytes, uint32_t side_px_max,
                         struct bd_image **out, struct bd_err_detail *detail)
{
    *out = NULL;
    if (!bd_rgbe_is(bytes, size_bytes)) return refuse(detail, "it does not begin with #?");
    struct input in = {bytes, size_bytes};
    struct head head = {0};
    enum bd_err err = read_head(&in, side_px_max, &head, detail);
    if (err) return err;
    struct bd_image *image = bd_image_create(head.width_px, head.height_px, 3);
    uint8_t *row = malloc(4 * (size_t)head.width_px);
    if (!image || !row)
        err = bd_err_set(detail, BD_ERR_NO_MEMORY, "hdr", "no memory for the Radiance picture");
    for (uint32_t y = 0; !err && y < head.height_px; y++) {
        if (!read_row(&in, head.width_px, row))
            err = bd_err_set(detail, BD_ERR_BAD_INPUT, "hdr",
                             "cannot read Radiance picture: row %u is damaged or missing", y);
        else
            convert_row(row, &head,
                        bd_image_at(image, 0, head.is_upwards ? head.height_px - 1 - y : y));
    }
    free(row);
    if (err)
        bd_image_destroy(&image);
    else
        *out = image;
    return err;
}
