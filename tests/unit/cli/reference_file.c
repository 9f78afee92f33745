// The file of `bounce reference`: pieces add up to the whole, and what is no piece is refused.

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "clients/cli/reference_file.h"
#include "image/layers.h"
#include "tests/unit/cmocka_all.h"

#define WIDTH  3
#define HEIGHT 2
#define PIXELS (WIDTH * HEIGHT)
#define LAYERS 19

static uint32_t random_state;

static double uniform(void)
{
    random_state = random_state * 1664525 + 1013904223;
    return (random_state >> 8) * 0x1p-24;
}

// Samples of every pixel, made up once: 0 to 39 can be traced in any ranges.
#define SAMPLES 40
struct sample {
    double light[3][3]; // direct, indirect, emission
    bool meets;
    double albedo[3], normal[3], depth;
};
static struct sample samples[SAMPLES][PIXELS];

static void make_samples(void)
{
    random_state = 7;
    for (int s = 0; s < SAMPLES; s++)
        for (int p = 0; p < PIXELS; p++) {
            struct sample *sample = &samples[s][p];
            *sample = (struct sample){.meets = p != 0 && (p == 1 || uniform() < 0.7)};
            for (int k = 0; k < 9; k++) sample->light[k / 3][k % 3] = exp(8 * uniform() - 4);
            double x = uniform() - 0.5, z = sqrt(1 - x * x);
            if (!sample->meets) continue;
            for (int c = 0; c < 3; c++) sample->albedo[c] = uniform();
            sample->normal[0] = x;
            sample->normal[2] = z;
            sample->depth = 1 + uniform();
        }
}

static const struct {
    const char *name;
    uint32_t channels;
} layers[LAYERS] = {
    {"beauty", 4}, {"direct", 3}, {"indirect", 3}, {"emission", 3}, {"half_a", 3},
    {"half_a.direct", 3}, {"half_a.indirect", 3}, {"half_a.emission", 3}, {"half_b", 3},
    {"half_b.direct", 3}, {"half_b.indirect", 3}, {"half_b.emission", 3}, {"variance", 3},
    {"direct_variance", 3}, {"indirect_variance", 3}, {"albedo", 3}, {"normal", 3},
    {"normal_length", 1}, {"depth", 1},
};

// Of light l (0 = beauty) in sample s.
static double light_of(const struct sample *s, int l, int c)
{
    return l ? s->light[l - 1][c] : s->light[0][c] + s->light[1][c] + s->light[2][c];
}

// Mean over samples of one half (0, 1) or both (2); even samples are half A's.
static double mean(int first, int count, int p, int l, int c, int half)
{
    double sum = 0;
    int n = 0;
    for (int s = first; s < first + count; s++) {
        if (half < 2 && s % 2 != half) continue;
        sum += light_of(&samples[s][p], l, c);
        n++;
    }
    return sum / n;
}

static double variance(int first, int count, int p, int l, int c)
{
    double m = mean(first, count, p, l, c, 2), sum = 0;
    for (int s = first; s < first + count; s++) {
        double difference = light_of(&samples[s][p], l, c) - m;
        sum += difference * difference;
    }
    return sum / count / (count - 1);
}

static void guides(int first, int count, int p, double *coverage, double albedo[3],
                   double normal[3], double *length, double *depth)
{
    double n[3] = {0, 0, 0};
    int met = 0;
    *depth = 0;
    for (int c = 0; c < 3; c++) albedo[c] = 0;
    for (int s = first; s < first + count; s++) {
        met += samples[s][p].meets;
        *depth += samples[s][p].depth;
        for (int c = 0; c < 3; c++) {
            albedo[c] += samples[s][p].albedo[c] / count;
            n[c] += samples[s][p].normal[c];
        }
    }
    double norm = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (int c = 0; c < 3; c++) normal[c] = norm > 0 ? n[c] / norm : 0;
    *length = met ? norm / met : 0;
    *depth = met ? *depth / met : 1e10;
    *coverage = (double)met / count;
}

// What the daemon answers for a range of samples.
static double value(int first, int count, int p, int layer, int c)
{
    double coverage, albedo[3], normal[3], length, depth;
    guides(first, count, p, &coverage, albedo, normal, &length, &depth);
    if (layer == 0 && c == 3) return coverage;
    if (layer < 4) return mean(first, count, p, layer, c, 2);
    if (layer < 8) return mean(first, count, p, layer - 4, c, 0);
    if (layer < 12) return mean(first, count, p, layer - 8, c, 1);
    if (layer < 15) return variance(first, count, p, layer - 12, c);
    if (layer == 15) return albedo[c];
    if (layer == 16) return normal[c];
    return layer == 17 ? length : depth;
}

static struct bd_bytes piece_with(int first, int count, const char *parameters, int layer_count)
{
    struct bd_image *images[LAYERS];
    struct bd_named_layer named[LAYERS];
    for (int l = 0; l < layer_count; l++) {
        images[l] = bd_image_create(WIDTH, HEIGHT, layers[l].channels);
        for (int p = 0; p < PIXELS; p++)
            for (uint32_t c = 0; c < layers[l].channels; c++)
                images[l]->pixels[(uint32_t)p * layers[l].channels + c] =
                    (float)value(first, count, p, l, (int)c);
        named[l] = (struct bd_named_layer){layers[l].name, images[l]};
    }
    struct bd_exr_plane planes[BD_EXR_CHANNEL_MAX];
    memset(planes, 0, sizeof planes);
    const struct bd_manifest_entry entries[] = {{"scene", "sha256:0"},
                                                {"parameters", parameters},
                                                {"seed", "9"},
                                                {"exposure_stops", "-1"}};
    struct bd_exr_picture picture = {.width_px = WIDTH,
                                     .height_px = HEIGHT,
                                     .planes = planes,
                                     .manifest = {entries, 4},
                                     .raw = true};
    struct bd_bytes bytes = {0};
    assert_int_equal(bd_layers_to_planes(named, (size_t)layer_count, planes, &picture.plane_count,
                                         NULL),
                     BD_ERR_OK);
    assert_int_equal(bd_exr_write(&picture, &bytes, NULL), BD_ERR_OK);
    for (int l = 0; l < layer_count; l++) bd_image_destroy(&images[l]);
    return bytes;
}

static struct bd_bytes piece(int first, int count)
{
    char parameters[120];
    snprintf(parameters, sizeof parameters, "brdf=full spp=%d first_sample=%d filter=box", count,
             first);
    return piece_with(first, count, parameters, LAYERS);
}

static void add(struct bd_cli_reference_file *file, struct bd_bytes bytes)
{
    struct bd_err_detail detail = {0};
    if (bd_cli_reference_file_add(file, bytes.data, bytes.size_bytes, &detail))
        fail_msg("%s", detail.message);
    bd_bytes_finish(&bytes);
}

static struct bd_bytes encoded(const struct bd_cli_reference_file *file)
{
    struct bd_bytes bytes = {0};
    struct bd_err_detail detail = {0};
    if (bd_cli_reference_file_encode(file, &bytes, &detail)) fail_msg("%s", detail.message);
    return bytes;
}

// Every plane of the bytes is what the samples 0 to count - 1 say.
static void assert_is_whole(const struct bd_bytes *bytes, int count)
{
    struct bd_exr *exr = NULL;
    assert_int_equal(
        bd_exr_read(bytes->data, bytes->size_bytes, &bd_exr_limits_default, &exr, NULL), BD_ERR_OK);
    assert_int_equal(exr->channel_count, 54);
    for (int l = 0; l < LAYERS; l++) {
        static const char *const letters[] = {"RGBA", "XYZ", "Y", "Z"};
        const char *of = letters[l == 16 ? 1 : l == 17 ? 2 : l == 18 ? 3 : 0];
        for (uint32_t c = 0; c < layers[l].channels; c++) {
            char name[80];
            snprintf(name, sizeof name, "%s%s%c", l ? layers[l].name : "", l ? "." : "", of[c]);
            const float *plane = bd_exr_channel(exr, name);
            if (!plane) fail_msg("no %s", name);
            for (int p = 0; p < PIXELS; p++) {
                double expected = value(0, count, p, l, (int)c);
                if (fabs((double)plane[p] - expected) > 2e-6 * (fabs(expected) + 1e-3))
                    fail_msg("%s of pixel %d: %.9g, not %.9g", name, p, (double)plane[p], expected);
            }
        }
    }
    bd_exr_destroy(&exr);
}

static void pieces_add_up_to_the_whole(void **state)
{
    (void)state;
    static const int cuts[][6] = {{2, 0}, {40, 0}, {2, 2, 2, 34, 0}, {10, 6, 4, 20, 0}};
    for (size_t i = 0; i < sizeof cuts / sizeof cuts[0]; i++) {
        struct bd_cli_reference_file *file = bd_cli_reference_file_create();
        int done = 0;
        for (int k = 0; cuts[i][k]; done += cuts[i][k++]) add(file, piece(done, cuts[i][k]));
        assert_int_equal(bd_cli_reference_file_spp(file), done);
        struct bd_bytes bytes = encoded(file);
        assert_is_whole(&bytes, done);
        bd_bytes_finish(&bytes);
        bd_cli_reference_file_destroy(&file);
    }
}

// Written, read back and gone on with.
static void a_file_is_one_more_piece(void **state)
{
    (void)state;
    struct bd_cli_reference_file *file = bd_cli_reference_file_create();
    add(file, piece(0, 4));
    add(file, piece(4, 10));
    for (int round = 0; round < 2; round++) {
        struct bd_bytes bytes = encoded(file);
        bd_cli_reference_file_destroy(&file);
        file = bd_cli_reference_file_create();
        add(file, bytes);
        int spp = (int)bd_cli_reference_file_spp(file);
        assert_int_equal(spp, round ? 20 : 14);
        add(file, piece(spp, round ? 20 : 6));
    }
    struct bd_bytes bytes = encoded(file);
    assert_is_whole(&bytes, 40);
    bd_bytes_finish(&bytes);
    assert_string_equal(bd_cli_reference_file_says(file, "parameters"), "brdf=full filter=box");
    assert_string_equal(bd_cli_reference_file_says(file, "seed"), "9");
    assert_string_equal(bd_cli_reference_file_says(file, "exposure_stops"), "");
    bd_cli_reference_file_destroy(&file);
}

// Its light is another one, its halves are what was traced: it grows to the same whole.
static void a_filtered_file_grows_to_the_whole(void **state)
{
    (void)state;
    struct bd_cli_reference_file *file = bd_cli_reference_file_create();
    add(file, piece(0, 14));
    assert_false(bd_cli_reference_file_filters(file));
    bd_cli_reference_file_set_filters(file, true);
    struct bd_bytes bytes = encoded(file);
    struct bd_exr *exr = NULL;
    assert_int_equal(bd_exr_read(bytes.data, bytes.size_bytes, &bd_exr_limits_default, &exr, NULL),
                     BD_ERR_OK);
    assert_non_null(strstr(bd_exr_attribute(exr, "parameters"), "noise_filter=on"));
    bd_exr_destroy(&exr);
    bd_cli_reference_file_destroy(&file);
    file = bd_cli_reference_file_create();
    add(file, bytes);
    assert_true(bd_cli_reference_file_filters(file));
    assert_string_equal(bd_cli_reference_file_says(file, "parameters"), "brdf=full filter=box");
    add(file, piece(14, 26));
    bd_cli_reference_file_set_filters(file, false);
    bytes = encoded(file);
    assert_is_whole(&bytes, 40);
    bd_bytes_finish(&bytes);
    bd_cli_reference_file_destroy(&file);
}

static void assert_refused(struct bd_cli_reference_file *file, struct bd_bytes bytes, size_t size,
                           const char *word)
{
    struct bd_err_detail detail = {0};
    uint32_t spp = bd_cli_reference_file_spp(file);
    assert_int_equal(bd_cli_reference_file_add(file, bytes.data, size, &detail), BD_ERR_BAD_INPUT);
    if (!strstr(detail.message, word)) fail_msg("\"%s\" in \"%s\"?", word, detail.message);
    assert_int_equal(bd_cli_reference_file_spp(file), spp);
    bd_bytes_finish(&bytes);
}

static void what_is_no_next_piece_is_refused(void **state)
{
    (void)state;
    struct bd_cli_reference_file *file = bd_cli_reference_file_create();
    struct bd_bytes bytes = piece(0, 4);
    assert_refused(file, bytes, bytes.size_bytes / 2, "");
    bytes = piece(2, 4);
    assert_refused(file, bytes, bytes.size_bytes, "do not follow");
    bytes = piece_with(0, 4, "filter=box", LAYERS);
    assert_refused(file, bytes, bytes.size_bytes, "counts no samples");
    bytes = piece_with(0, 4, "spp=3 first_sample=0", LAYERS);
    assert_refused(file, bytes, bytes.size_bytes, "do not follow");
    bytes = piece_with(0, 4, "spp=4 first_sample=0", LAYERS - 1);
    assert_refused(file, bytes, bytes.size_bytes, "depth.Z");
    bytes = piece_with(0, 4, "spp=4 first_sample=0", 12);
    assert_refused(file, bytes, bytes.size_bytes, "variance.R");
    add(file, piece(0, 4));
    bytes = piece(0, 4);
    assert_refused(file, bytes, bytes.size_bytes, "do not follow");
    bd_cli_reference_file_destroy(&file);
}

int main(void)
{
    make_samples();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pieces_add_up_to_the_whole),
        cmocka_unit_test(a_filtered_file_grows_to_the_whole),
        cmocka_unit_test(a_file_is_one_more_piece),
        cmocka_unit_test(what_is_no_next_piece_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
