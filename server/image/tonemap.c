#include "image/tonemap.h"

#include <math.h>
#include <pthread.h>
#include <string.h>

#include "base/assert.h"

static const char *const names[BD_TONEMAP_COUNT] = {BD_TONEMAP_WORDS};

const char *bd_tonemap_name(enum bd_tonemap tonemap)
{
    BD_ASSERT_CMP(tonemap, <, BD_TONEMAP_COUNT);
    return names[tonemap];
}

bool bd_tonemap_from_name(const char *name, enum bd_tonemap *out)
{
    for (int i = 0; i < BD_TONEMAP_COUNT; i++) {
        if (strcmp(names[i], name) != 0) continue;
        *out = (enum bd_tonemap)i;
        return true;
    }
    return false;
}

// Exposure.

// One logarithm for hundreds of samples.
#define PRODUCT_LEAST 0x1p-900

static void add_sample(struct bd_exposure_sum *sum, const float *sample, uint32_t channel_count)
{
    if (channel_count == 4 && !(sample[3] > 0)) return;
    // In double: scaling by a power of two then changes nothing but the exponent, short of
    // subnormal floats.
    double luminance = channel_count == 1
                           ? (double)sample[0]
                           : 0.2126 * sample[0] + 0.7152 * sample[1] + 0.0722 * sample[2];
    if (!isfinite(luminance) || !(luminance > 0)) return;
    int exponent;
    const double mantissa = frexp(luminance, &exponent);
    sum->product = sum->product > 0 ? sum->product * mantissa : mantissa;
    sum->exponents += exponent;
    sum->count++;
    if (sum->product < PRODUCT_LEAST) {
        sum->mantissas += log2(sum->product);
        sum->product = 1;
    }
}

// 0 where nothing was added.
float bd_exposure_of(const struct bd_exposure_sum *sum)
{
    if (!sum->count) return 0;
    // mean of exponents = whole + rest / count, with 0 <= rest < count.
    int64_t whole = sum->exponents / sum->count;
    int64_t rest = sum->exponents % sum->count;
    if (rest < 0) {
        whole--;
        rest += sum->count;
    }
    double count = (double)sum->count;
    const double mantissas = sum->mantissas + log2(sum->product);
    double fraction = log2(0.18) - mantissas / count - (double)rest / count;
    double stops = floor(fraction * 1024) / 1024 - (double)whole;
    return (float)fmin(fmax(stops, -BD_EXPOSURE_STOPS_MAX), BD_EXPOSURE_STOPS_MAX);
}

void bd_exposure_add_row(struct bd_exposure_sum *sum, const struct bd_image *image, uint32_t row)
{
    const float *pixel = image->pixels + (size_t)row * image->width_px * image->channel_count;
    for (uint32_t x = 0; x < image->width_px; x++, pixel += image->channel_count)
        add_sample(sum, pixel, image->channel_count);
}

float bd_exposure_auto(const struct bd_image *image)
{
    struct bd_exposure_sum sum = {0};
    for (uint32_t row = 0; row < image->height_px; row++) bd_exposure_add_row(&sum, image, row);
    return bd_exposure_of(&sum);
}

float bd_exposure_auto_lit(const struct bd_image *direct, const struct bd_image *emission,
                           const struct bd_image *all)
{
    struct bd_exposure_sum sum = {0};
    size_t pixel_count = (size_t)direct->width_px * direct->height_px;
    for (size_t p = 0; p < pixel_count; p++) {
        float rgb[3];
        for (int c = 0; c < 3; c++) {
            rgb[c] = direct->pixels[p * direct->channel_count + c];
            if (emission) rgb[c] += emission->pixels[p * emission->channel_count + c];
        }
        add_sample(&sum, rgb, 3);
    }
    return sum.count ? bd_exposure_of(&sum) : fminf(bd_exposure_auto(all), 0);
}

// Curves.

static float clamp01(float v)
{
    return v > 0 ? (v < 1 ? v : 1) : 0; // NaN: 0
}

static void apply_neutral(float c[3])
{
    const float f90 = 0.04f; // what a dielectric of index 1.5 reflects at normal incidence
    const float start = 0.8f - f90;
    const float desaturation = 0.15f;
    float least = fminf(c[0], fminf(c[1], c[2]));
    float offset = least < 2 * f90 ? least - least * least / (4 * f90) : f90;
    for (int i = 0; i < 3; i++) c[i] -= offset;
    float peak = fmaxf(c[0], fmaxf(c[1], c[2]));
    if (peak < start) return;
    float room = 1 - start;
    float compressed = 1 - room * room / (peak + room - start);
    float white = 1 - 1 / (desaturation * (peak - compressed) + 1);
    for (int i = 0; i < 3; i++) {
        float scaled = c[i] * (compressed / peak);
        c[i] = scaled + (compressed - scaled) * white;
    }
}

// Matrices as rows of what they multiply.
static void multiply(const float m[3][3], float c[3])
{
    float v[3] = {c[0], c[1], c[2]};
    for (int i = 0; i < 3; i++) c[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
}

static float agx_sigmoid(float x)
{
    float x2 = x * x, x4 = x2 * x2;
    return 15.5f * x4 * x2 - 40.14f * x4 * x + 31.96f * x4 - 6.868f * x2 * x + 0.4298f * x2 +
           0.1191f * x - 0.00232f;
}

static void apply_agx(float c[3])
{
    static const float rec2020_from_srgb[3][3] = {
        {0.6274f, 0.3293f, 0.0433f}, {0.0691f, 0.9195f, 0.0113f}, {0.0164f, 0.0880f, 0.8956f}};
    static const float srgb_from_rec2020[3][3] = {{1.6605f, -0.5876f, -0.0728f},
                                                  {-0.1246f, 1.1329f, -0.0083f},
                                                  {-0.0182f, -0.1006f, 1.1187f}};
    static const float inset[3][3] = {{0.856627153f, 0.0951212405f, 0.0482516061f},
                                      {0.137318973f, 0.761241991f, 0.101439036f},
                                      {0.111898213f, 0.0767994186f, 0.811302368f}};
    static const float outset[3][3] = {{1.12710058f, -0.110606643f, -0.0164939387f},
                                       {-0.141329763f, 1.15782370f, -0.0164939387f},
                                       {-0.141329763f, -0.110606643f, 1.25193641f}};
    // 16.5 stops: from 10 below to 6.5 above middle grey.
    const float ev_min = -12.47393f, ev_max = 4.026069f;
    multiply(rec2020_from_srgb, c);
    multiply(inset, c);
    for (int i = 0; i < 3; i++) {
        float ev = log2f(fmaxf(c[i], 1e-10f));
        c[i] = agx_sigmoid(clamp01((ev - ev_min) / (ev_max - ev_min)));
    }
    multiply(outset, c);
    for (int i = 0; i < 3; i++) c[i] = powf(fmaxf(c[i], 0), 2.2f);
    multiply(srgb_from_rec2020, c);
}

void bd_tonemap_apply(enum bd_tonemap tonemap, float exposure_scale, const float rgb[3],
                      float out[3])
{
    for (int i = 0; i < 3; i++) {
        float v = rgb[i] * exposure_scale;
        // Infinity becomes a large number, so that no curve makes a NaN of it.
        out[i] = v > 0 ? fminf(v, 1e30f) : 0;
    }
    switch (tonemap) {
    case BD_TONEMAP_NEUTRAL:
        apply_neutral(out);
        break;
    case BD_TONEMAP_AGX:
        apply_agx(out);
        break;
    case BD_TONEMAP_LINEAR:
        break;
    case BD_TONEMAP_COUNT:
        BD_ASSERT(!"no such tone map");
    }
    for (int i = 0; i < 3; i++) out[i] = clamp01(out[i]);
}

// The transfer function. Its 255 thresholds are exact; a table finds the right one in a step or
// two, which is ten times faster than three powers a pixel.

#define BUCKETS 4096

static float code_threshold[257]; // code i is for samples in [threshold[i], threshold[i + 1])
static uint8_t first_code[BUCKETS + 1];
static pthread_once_t srgb_once = PTHREAD_ONCE_INIT;

static double linear_from_srgb(double s)
{
    return s <= 0.04045 ? s / 12.92 : pow((s + 0.055) / 1.055, 2.4);
}

static void build_srgb_tables(void)
{
    code_threshold[0] = 0;
    for (int i = 1; i < 256; i++) code_threshold[i] = (float)linear_from_srgb((i - 0.5) / 255);
    code_threshold[256] = INFINITY;
    int code = 0;
    for (int b = 0; b <= BUCKETS; b++) {
        while ((float)b / BUCKETS >= code_threshold[code + 1]) code++;
        first_code[b] = (uint8_t)code;
    }
}

static uint8_t srgb8_of(float linear)
{
    float v = clamp01(linear);
    uint32_t code = first_code[(uint32_t)(v * BUCKETS)];
    while (v >= code_threshold[code + 1]) code++;
    return (uint8_t)code;
}

uint8_t bd_srgb8(float linear)
{
    pthread_once(&srgb_once, build_srgb_tables);
    return srgb8_of(linear);
}

void bd_tonemap_image(const struct bd_image *image, enum bd_tonemap tonemap, float stops,
                      uint8_t *rgb8)
{
    pthread_once(&srgb_once, build_srgb_tables);
    float scale = exp2f(stops);
    size_t pixel_count = (size_t)image->width_px * image->height_px;
    bool grey = image->channel_count == 1;
    for (size_t p = 0; p < pixel_count; p++) {
        const float *sample = image->pixels + p * image->channel_count;
        const float rgb[3] = {sample[0], sample[grey ? 0 : 1], sample[grey ? 0 : 2]};
        float mapped[3];
        bd_tonemap_apply(tonemap, scale, rgb, mapped);
        for (int i = 0; i < 3; i++) rgb8[3 * p + (size_t)i] = srgb8_of(mapped[i]);
    }
}
