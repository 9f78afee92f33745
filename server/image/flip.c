#include "image/flip.h"

#include <math.h>
#include <pthread.h>
#include <stdlib.h>

#include "base/assert.h"
#include "image/display.h"
#include "image/filter.h"

// The paper's constants: exponents of colour and feature differences, the knee of the colour
// difference's remapping, and the width in degrees of the eye's edge detector.
#define COLOUR_EXPONENT  0.7f
#define FEATURE_EXPONENT 0.5f
#define KNEE_AT          0.4f
#define KNEE_VALUE       0.95f
#define DETECTOR_DEGREES 0.082

// Its contrast sensitivity, a sum of a * sqrt(pi / b) * exp(-pi^2 x^2 / b), x in degrees.
#define ACHROMATIC_B  0.0047
#define RED_GREEN_B   0.0053
#define BLUE_YELLOW_1 34.1, 0.04
#define BLUE_YELLOW_2 13.5, 0.025
#define LARGEST_B     0.04

// --- colour ---------------------------------------------------------------------------------

// From linear sRGB to CIE XYZ over that of white, so that grey is x = y = z. Rows.
static const float xyz_from_rgb[3][3] = {
    {0.433895389f, 0.376242373f, 0.189862239f},
    {0.212636822f, 0.715182982f, 0.0721801965f},
    {0.0177524232f, 0.109465629f, 0.872781948f},
};

// The inverse, by cofactors.
static void invert(const float m[3][3], float out[3][3])
{
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            int a = (j + 1) % 3, b = (j + 2) % 3, c = (i + 1) % 3, d = (i + 2) % 3;
            out[i][j] =
                (float)((double)m[a][c] * (double)m[b][d] - (double)m[a][d] * (double)m[b][c]);
        }
    }
    float determinant = m[0][0] * out[0][0] + m[0][1] * out[1][0] + m[0][2] * out[2][0];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) out[i][j] /= determinant;
}

static void transform(const float m[3][3], const float in[3], float out[3])
{
    for (int i = 0; i < 3; i++) out[i] = m[i][0] * in[0] + m[i][1] * in[1] + m[i][2] * in[2];
}

static float lab_curve(float t)
{
    const float delta = 6.0f / 29.0f;
    return t > delta * delta * delta ? cbrtf(t) : t / (3 * delta * delta) + 4.0f / 29.0f;
}

// L*a*b* with chroma scaled by lightness (Hunt: colours look weaker in the dark).
static void hunt_lab(const float rgb[3], float lab[3])
{
    float xyz[3];
    transform(xyz_from_rgb, rgb, xyz);
    float x = lab_curve(xyz[0]), y = lab_curve(xyz[1]), z = lab_curve(xyz[2]);
    lab[0] = 116 * y - 16;
    lab[1] = 0.01f * lab[0] * 500 * (x - y);
    lab[2] = 0.01f * lab[0] * 200 * (y - z);
}

static float colour_distance(const float a[3], const float b[3])
{
    float u = a[1] - b[1], v = a[2] - b[2];
    return powf(fabsf(a[0] - b[0]) + sqrtf(u * u + v * v), COLOUR_EXPONENT);
}

// The largest distance there is: between green and blue.
static float colour_distance_max(void)
{
    float green[3], blue[3];
    hunt_lab((const float[3]){0, 1, 0}, green);
    hunt_lab((const float[3]){0, 0, 1}, blue);
    return colour_distance(green, blue);
}

// --- filters --------------------------------------------------------------------------------

struct filters {
    struct bd_kernel achromatic, red_green, blue_yellow[2];
    float blue_yellow_share[2];
    // Of the detectors: a Gaussian across, its first and second derivative along, each with
    // positive weights that sum to 1 and negative ones that sum to -1.
    struct bd_kernel across, edge, point;
    float rgb_from_xyz[3][3];
};

// The kernel of one exp(-pi^2 x^2 / b), and its share of the whole in two dimensions.
static double sensitivity(double a, double b, double ppd, struct bd_kernel *out)
{
    const double pi = acos(-1);
    int radius = (int)ceil(3 * sqrt(LARGEST_B / (2 * pi * pi)) * ppd);
    double sum = bd_kernel_gaussian(sqrt(b / 2) / pi * ppd, radius, out);
    return a * sqrt(pi / b) * sum * sum;
}

static void balance(struct bd_kernel *kernel)
{
    double positive = 0, negative = 0;
    for (int i = 0; i <= 2 * kernel->radius; i++) {
        double weight = (double)kernel->weights[i];
        *(weight > 0 ? &positive : &negative) += fabs(weight);
    }
    for (int i = 0; i <= 2 * kernel->radius; i++) {
        double weight = (double)kernel->weights[i];
        kernel->weights[i] = (float)(weight / (weight > 0 ? positive : negative));
    }
}

static void make_detectors(double ppd, struct filters *out)
{
    double sigma = 0.5 * DETECTOR_DEGREES * ppd;
    int radius = (int)ceil(3 * sigma);
    bd_kernel_gaussian(sigma, radius, &out->across);
    out->edge.radius = out->point.radius = radius;
    for (int x = -radius; x <= radius; x++) {
        double u = x / sigma, gaussian = exp(-u * u / 2);
        out->edge.weights[x + radius] = (float)(-u * gaussian);
        out->point.weights[x + radius] = (float)((u * u - 1) * gaussian);
    }
    balance(&out->edge);
    balance(&out->point);
}

static void make_filters(double ppd, struct filters *out)
{
    sensitivity(1, ACHROMATIC_B, ppd, &out->achromatic);
    sensitivity(1, RED_GREEN_B, ppd, &out->red_green);
    double first = sensitivity(BLUE_YELLOW_1, ppd, &out->blue_yellow[0]);
    double second = sensitivity(BLUE_YELLOW_2, ppd, &out->blue_yellow[1]);
    out->blue_yellow_share[0] = (float)(first / (first + second));
    out->blue_yellow_share[1] = (float)(second / (first + second));
    make_detectors(ppd, out);
    invert(xyz_from_rgb, out->rgb_from_xyz);
}

// --- one picture ----------------------------------------------------------------------------

// Opponent colours without the paper's scales and offsets, which a filter of sum 1 lets through:
// y, x - y and y - z. Later L*, a*, b* in the same planes.
enum { OPPONENT_Y, OPPONENT_RG, OPPONENT_BY, EDGE, POINT, SCRATCH_1, SCRATCH_2, PLANE_COUNT };

struct side {
    const struct filters *filters;
    const struct bd_image *picture;
    double exposure; // 0: `picture` is display-linear as it is
    struct bd_plane_size size;
    float *planes[PLANE_COUNT];
};

static void load_opponent(struct side *side)
{
    size_t count = side->size.width_px * side->size.height_px;
    for (size_t p = 0; p < count; p++) {
        float rgb[3], xyz[3];
        for (int c = 0; c < 3; c++) {
            float sample = side->picture->pixels[3 * p + (size_t)c];
            rgb[c] = side->exposure > 0 ? bd_display_curve((float)(side->exposure * (double)sample))
                                        : sample;
        }
        transform(xyz_from_rgb, rgb, xyz);
        side->planes[OPPONENT_Y][p] = xyz[1];
        side->planes[OPPONENT_RG][p] = xyz[0] - xyz[1];
        side->planes[OPPONENT_BY][p] = xyz[1] - xyz[2];
    }
}

// The length of the gradient that a detector sees along x and along y.
static void detect(struct side *side, const struct bd_kernel *along, float *out)
{
    const struct bd_kernel *across = &side->filters->across;
    size_t count = side->size.width_px * side->size.height_px;
    float *scratch = side->planes[SCRATCH_1], *second = side->planes[SCRATCH_2];
    bd_filter_rows(side->planes[OPPONENT_Y], side->size, along, scratch);
    bd_filter_columns(scratch, side->size, across, out);
    bd_filter_rows(side->planes[OPPONENT_Y], side->size, across, scratch);
    bd_filter_columns(scratch, side->size, along, second);
    for (size_t p = 0; p < count; p++) out[p] = sqrtf(out[p] * out[p] + second[p] * second[p]);
}

static void blur_blue_yellow(struct side *side)
{
    size_t count = side->size.width_px * side->size.height_px;
    float *plane = side->planes[OPPONENT_BY], *second = side->planes[SCRATCH_2];
    const struct filters *filters = side->filters;
    bd_filter_both(plane, side->size, &filters->blue_yellow[1], side->planes[SCRATCH_1], second);
    bd_filter_both(plane, side->size, &filters->blue_yellow[0], side->planes[SCRATCH_1], plane);
    for (size_t p = 0; p < count; p++)
        plane[p] =
            filters->blue_yellow_share[0] * plane[p] + filters->blue_yellow_share[1] * second[p];
}

static void opponent_to_lab(struct side *side)
{
    size_t count = side->size.width_px * side->size.height_px;
    for (size_t p = 0; p < count; p++) {
        float y = side->planes[OPPONENT_Y][p], rgb[3], lab[3];
        const float xyz[3] = {y + side->planes[OPPONENT_RG][p], y,
                              y - side->planes[OPPONENT_BY][p]};
        transform(side->filters->rgb_from_xyz, xyz, rgb);
        for (int c = 0; c < 3; c++) rgb[c] = fminf(fmaxf(rgb[c], 0), 1);
        hunt_lab(rgb, lab);
        for (int c = 0; c < 3; c++) side->planes[OPPONENT_Y + c][p] = lab[c];
    }
}

static void *see(void *user)
{
    struct side *side = user;
    load_opponent(side);
    detect(side, &side->filters->edge, side->planes[EDGE]);
    detect(side, &side->filters->point, side->planes[POINT]);
    float *scratch = side->planes[SCRATCH_1];
    bd_filter_both(side->planes[OPPONENT_Y], side->size, &side->filters->achromatic, scratch,
                   side->planes[OPPONENT_Y]);
    bd_filter_both(side->planes[OPPONENT_RG], side->size, &side->filters->red_green, scratch,
                   side->planes[OPPONENT_RG]);
    blur_blue_yellow(side);
    opponent_to_lab(side);
    return NULL;
}

// --- two pictures ---------------------------------------------------------------------------

static float pixel_error(const struct side sides[2], size_t p, float distance_max)
{
    float lab[2][3];
    for (int s = 0; s < 2; s++)
        for (int c = 0; c < 3; c++) lab[s][c] = sides[s].planes[OPPONENT_Y + c][p];
    float distance = colour_distance(lab[0], lab[1]), knee = KNEE_AT * distance_max;
    float colour = distance < knee
                       ? KNEE_VALUE / knee * distance
                       : KNEE_VALUE + (distance - knee) / (distance_max - knee) * (1 - KNEE_VALUE);
    float edge = fabsf(sides[0].planes[EDGE][p] - sides[1].planes[EDGE][p]);
    float point = fabsf(sides[0].planes[POINT][p] - sides[1].planes[POINT][p]);
    float feature = powf(fmaxf(edge, point) * sqrtf(0.5f), FEATURE_EXPONENT);
    return colour > 0 ? fminf(powf(colour, 1 - feature), 1) : 0;
}

struct pair {
    struct filters filters;
    struct side sides[2];
    float *memory;
};

static enum bd_err open_pair(const struct bd_image *reference, const struct bd_image *image,
                             double ppd, struct pair *pair, struct bd_err_detail *detail)
{
    BD_ASSERT(reference->channel_count == 3 && image->channel_count == 3);
    BD_ASSERT(reference->width_px == image->width_px && reference->height_px == image->height_px);
    BD_ASSERT(ppd >= BD_FLIP_PPD_MIN && ppd <= BD_FLIP_PPD_MAX);
    size_t count = (size_t)reference->width_px * reference->height_px;
    pair->memory = malloc(count * 2 * PLANE_COUNT * sizeof *pair->memory);
    if (!pair->memory) return bd_err_set(detail, BD_ERR_NO_MEMORY, "flip", "no memory for FLIP");
    make_filters(ppd, &pair->filters);
    for (size_t s = 0; s < 2; s++) {
        pair->sides[s] = (struct side){.filters = &pair->filters,
                                       .picture = s ? image : reference,
                                       .size = {reference->width_px, reference->height_px}};
        for (size_t i = 0; i < PLANE_COUNT; i++)
            pair->sides[s].planes[i] = pair->memory + (s * PLANE_COUNT + i) * count;
    }
    return BD_ERR_OK;
}

// `error` keeps what is larger there already.
static void raise_errors(struct pair *pair, double exposure, float *error)
{
    const float distance_max = colour_distance_max();
    pair->sides[0].exposure = pair->sides[1].exposure = exposure;
    pthread_t other;
    bool together = pthread_create(&other, NULL, see, &pair->sides[1]) == 0;
    see(&pair->sides[0]);
    if (together)
        pthread_join(other, NULL);
    else
        see(&pair->sides[1]);
    size_t count = pair->sides[0].size.width_px * pair->sides[0].size.height_px;
    for (size_t p = 0; p < count; p++)
        error[p] = fmaxf(error[p], pixel_error(pair->sides, p, distance_max));
}

static void clear(const struct bd_image *like, float *error)
{
    size_t count = (size_t)like->width_px * like->height_px;
    for (size_t p = 0; p < count; p++) error[p] = 0;
}

enum bd_err bd_flip_ldr(const struct bd_image *reference, const struct bd_image *image, double ppd,
                        float *error, struct bd_err_detail *detail)
{
    struct pair pair;
    enum bd_err err = open_pair(reference, image, ppd, &pair, detail);
    if (err) return err;
    clear(reference, error);
    raise_errors(&pair, 0, error);
    free(pair.memory);
    return BD_ERR_OK;
}

struct bd_flip_exposures bd_flip_exposures(double median, double max)
{
    struct bd_flip_exposures exposures = {.count = 2};
    if (!(max > 0)) return exposures;
    double bright = bd_display_curve_inverse(0.85);
    exposures.start = log2(bright / max);
    exposures.stop = log2(bright / (median > 0 ? median : max));
    exposures.count =
        (uint32_t)fmin(fmax(2, ceil(exposures.stop - exposures.start)), BD_FLIP_EXPOSURE_MAX);
    return exposures;
}

enum bd_err bd_flip_hdr(const struct bd_image *reference, const struct bd_image *image, double ppd,
                        const struct bd_flip_exposures *exposures, float *error,
                        struct bd_err_detail *detail)
{
    BD_ASSERT_CMP(exposures->count, >=, 2u);
    struct pair pair;
    enum bd_err err = open_pair(reference, image, ppd, &pair, detail);
    if (err) return err;
    clear(reference, error);
    double step = (exposures->stop - exposures->start) / (exposures->count - 1);
    for (uint32_t i = 0; i < exposures->count; i++)
        raise_errors(&pair, exp2(exposures->start + i * step), error);
    free(pair.memory);
    return BD_ERR_OK;
}
