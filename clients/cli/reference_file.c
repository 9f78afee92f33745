#include "clients/cli/reference_file.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "image/layers.h"
#include "image/light_filter.h"

#define ENTRY_MAX      24
#define FILE_BYTES_MAX (UINT64_C(64) << 30) // our own files: what the daemon can answer, and more

static const float depth_of_nothing_m = 1e10f;

// Layers of light: the halves hold the last three, the first is their sum.
enum light { BEAUTY, DIRECT, INDIRECT, EMISSION, LIGHT_COUNT };
static const char *const light_names[LIGHT_COUNT] = {"beauty", "direct", "indirect", "emission"};
// Those that come with a variance.
#define VARIED_COUNT (INDIRECT + 1)
static const char *const variance_names[VARIED_COUNT] = {"variance", "direct_variance",
                                                         "indirect_variance"};

// Of one pixel, over all its samples.
struct sums {
    double light[BD_HALF_COUNT][LIGHT_COUNT][3];
    double deviation[VARIED_COUNT][3]; // sum of squared differences from the mean
    double albedo[3], normal[3], depth_m, coverage;
};

struct bd_cli_reference_file {
    uint32_t width_px, height_px, spp;
    bool filters;
    struct sums *pixels;
    size_t entry_count;
    struct bd_manifest_entry entries[ENTRY_MAX]; // owned text
    char *parameters;                            // without those that the file decides on
};

struct bd_cli_reference_file *bd_cli_reference_file_create(void)
{
    struct bd_cli_reference_file *file = calloc(1, sizeof *file);
    BD_ASSERT(file);
    return file;
}

static void free_entries(struct bd_cli_reference_file *file)
{
    for (size_t i = 0; i < file->entry_count; i++) {
        free((char *)file->entries[i].key);
        free((char *)file->entries[i].value);
    }
    file->entry_count = 0;
    free(file->parameters);
    file->parameters = NULL;
}

void bd_cli_reference_file_destroy(struct bd_cli_reference_file **file)
{
    if (!*file) return;
    free_entries(*file);
    free((*file)->pixels);
    free(*file);
    *file = NULL;
}

uint32_t bd_cli_reference_file_spp(const struct bd_cli_reference_file *file)
{
    return file->spp;
}

void bd_cli_reference_file_size(const struct bd_cli_reference_file *file, uint32_t *width_px,
                                uint32_t *height_px)
{
    *width_px = file->width_px;
    *height_px = file->height_px;
}

bool bd_cli_reference_file_filters(const struct bd_cli_reference_file *file)
{
    return file->filters;
}

void bd_cli_reference_file_set_filters(struct bd_cli_reference_file *file, bool filters)
{
    file->filters = filters;
}

// --- the manifest ---------------------------------------------------------------------------

// The number behind `key=` in "KEY=VALUE KEY=VALUE"; false if there is none.
static bool find_count(const char *parameters, const char *key, uint32_t *out)
{
    size_t length = strlen(key);
    for (const char *at = parameters; at; at = strchr(at, ' ')) {
        at += *at == ' ';
        if (strncmp(at, key, length) != 0 || at[length] != '=') continue;
        *out = (uint32_t)strtoul(at + length + 1, NULL, 10);
        return true;
    }
    return false;
}

static void write_spp(const struct bd_cli_reference_file *file, char text[BD_CLI_OWN_MAX])
{
    snprintf(text, BD_CLI_OWN_MAX, "%u", file->spp);
}

static void write_first_sample(const struct bd_cli_reference_file *file, char text[BD_CLI_OWN_MAX])
{
    (void)file;
    snprintf(text, BD_CLI_OWN_MAX, "0");
}

static void write_noise_filter(const struct bd_cli_reference_file *file, char text[BD_CLI_OWN_MAX])
{
    snprintf(text, BD_CLI_OWN_MAX, "%s", file->filters ? "on" : "off");
}

// Parameters that the file decides on, and what a user has instead.
struct own {
    const char *key, *instead;
    void (*write)(const struct bd_cli_reference_file *file, char text[BD_CLI_OWN_MAX]);
};
static const struct own owns[] = {
    {"spp", "--spp says how many samples the file is to have", write_spp},
    {"first_sample", "--spp says how many samples the file is to have", write_first_sample},
    {"noise_filter", "--filter-noise says whether the file is filtered", write_noise_filter},
};
#define OWN_KEY_MAX 32
#define OWN_COUNT   (sizeof owns / sizeof *owns)

static const struct own *find_own(const char *parameter)
{
    const size_t length = strcspn(parameter, "=");
    for (size_t i = 0; i < OWN_COUNT; i++)
        if (strlen(owns[i].key) == length && strncmp(owns[i].key, parameter, length) == 0)
            return &owns[i];
    return NULL;
}

const char *bd_cli_reference_file_decides(const char *parameter)
{
    const struct own *own = find_own(parameter);
    return own ? own->instead : NULL;
}

bool bd_cli_reference_file_own(const struct bd_cli_reference_file *file, const char *key,
                               char text[BD_CLI_OWN_MAX])
{
    const struct own *own = find_own(key);
    if (own) own->write(file, text);
    return own != NULL;
}

bool bd_cli_parameters_filter(const char *parameters)
{
    return strstr(parameters, "noise_filter=on") != NULL;
}

// Words of files of earlier versions, and those of today.
static const char *renamed(const char *word)
{
    if (strcmp(word, "indirect_visibility=off") == 0) return "indirect_visibility=none";
    if (strcmp(word, "indirect_visibility=on") == 0) return "indirect_visibility=rays";
    return word;
}

// In today's words, for which twice the room is enough.
static char *without_own(const char *parameters)
{
    char *copy = strdup(parameters), *out = calloc(2, strlen(parameters) + 1);
    BD_ASSERT(copy && out);
    char *rest = NULL;
    for (char *word = strtok_r(copy, " ", &rest); word; word = strtok_r(NULL, " ", &rest)) {
        if (bd_cli_reference_file_decides(word)) continue;
        if (out[0]) strcat(out, " ");
        strcat(out, renamed(word));
    }
    free(copy);
    return out;
}

// The exposure is a picture's and not the light's; `type` is the form of the file, not an entry.
static bool is_kept(const char *key)
{
    return strcmp(key, "exposure_stops") != 0 && strcmp(key, "type") != 0;
}

static void take_entries(struct bd_cli_reference_file *file, const struct bd_exr *exr)
{
    free_entries(file);
    for (size_t i = 0; i < exr->attribute_count && file->entry_count < ENTRY_MAX; i++) {
        if (!is_kept(exr->attributes[i].key)) continue;
        char *key = strdup(exr->attributes[i].key), *value = strdup(exr->attributes[i].value);
        BD_ASSERT(key && value);
        file->entries[file->entry_count++] = (struct bd_manifest_entry){key, value};
    }
    const char *parameters = bd_exr_attribute(exr, "parameters");
    file->filters = bd_cli_parameters_filter(parameters);
    file->parameters = without_own(parameters);
}

const char *bd_cli_reference_file_says(const struct bd_cli_reference_file *file, const char *key)
{
    if (strcmp(key, "parameters") == 0) return file->parameters ? file->parameters : "";
    for (size_t i = 0; i < file->entry_count; i++)
        if (strcmp(file->entries[i].key, key) == 0) return file->entries[i].value;
    return "";
}

// --- adding a piece -------------------------------------------------------------------------

// Planes of a piece, by what they hold.
struct piece {
    uint32_t spp;
    const float *light[BD_HALF_COUNT][LIGHT_COUNT][3];
    const float *variance[VARIED_COUNT][3];
    const float *albedo[3], *normal[3], *normal_length, *depth, *coverage;
};

static enum bd_err find(const struct bd_exr *exr, const char *layer, const char *letters,
                        const float **planes, struct bd_err_detail *detail)
{
    for (size_t c = 0; letters[c]; c++) {
        char name[BD_EXR_CHANNEL_NAME_MAX + 2];
        snprintf(name, sizeof name, "%s%s%c", layer, layer[0] ? "." : "", letters[c]);
        planes[c] = bd_exr_channel(exr, name);
        if (!planes[c])
            return bd_err_set(detail, BD_ERR_BAD_INPUT, name, "no channel %s in it", name);
    }
    return BD_ERR_OK;
}

static enum bd_err find_planes(const struct bd_exr *exr, struct piece *piece,
                               struct bd_err_detail *detail)
{
    enum bd_err err = find(exr, "", "A", &piece->coverage, detail);
    for (int h = 0; h < BD_HALF_COUNT; h++)
        for (int l = 0; !err && l < LIGHT_COUNT; l++) {
            char name[BD_EXR_CHANNEL_NAME_MAX];
            bd_layer_half_name((enum bd_half)h, light_names[l], name);
            err = find(exr, name, "RGB", piece->light[h][l], detail);
        }
    for (int v = 0; !err && v < VARIED_COUNT; v++)
        err = find(exr, variance_names[v], "RGB", piece->variance[v], detail);
    if (!err) err = find(exr, "albedo", "RGB", piece->albedo, detail);
    if (!err) err = find(exr, "normal", "XYZ", piece->normal, detail);
    if (!err) err = find(exr, "normal_length", "Y", &piece->normal_length, detail);
    return err ? err : find(exr, "depth", "Z", &piece->depth, detail);
}

// Chan, Golub and LeVeque 1979: sums of squared differences of two sets add up to that of their
// union, with a term for the difference of their means.
static void add_deviation(double *deviation, double sum, double count, double piece_mean,
                          double piece_variance, double piece_count)
{
    *deviation += piece_variance * piece_count * (piece_count - 1);
    if (count == 0) return;
    double difference = piece_mean - sum / count;
    *deviation += difference * difference * count * piece_count / (count + piece_count);
}

static void add_light(struct sums *sums, const struct piece *piece, size_t i, double count)
{
    double n = piece->spp, half = 0.5 * n;
    for (int v = 0; v < VARIED_COUNT; v++)
        for (int c = 0; c < 3; c++) {
            double mean = 0.5 * ((double)piece->light[BD_HALF_A][v][c][i] +
                                 (double)piece->light[BD_HALF_B][v][c][i]);
            add_deviation(&sums->deviation[v][c],
                          sums->light[BD_HALF_A][v][c] + sums->light[BD_HALF_B][v][c], count, mean,
                          (double)piece->variance[v][c][i], n);
        }
    for (int h = 0; h < BD_HALF_COUNT; h++)
        for (int l = 0; l < LIGHT_COUNT; l++)
            for (int c = 0; c < 3; c++)
                sums->light[h][l][c] += half * (double)piece->light[h][l][c][i];
}

static void add_guides(struct sums *sums, const struct piece *piece, size_t i)
{
    double n = piece->spp, met = n * (double)piece->coverage[i];
    double length = met * (double)piece->normal_length[i];
    for (int c = 0; c < 3; c++) {
        sums->albedo[c] += n * (double)piece->albedo[c][i];
        sums->normal[c] += length * (double)piece->normal[c][i];
    }
    if (met > 0) sums->depth_m += met * (double)piece->depth[i];
    sums->coverage += met;
}

static enum bd_err check_count(const struct bd_cli_reference_file *file, const struct bd_exr *exr,
                               uint32_t *spp, struct bd_err_detail *detail)
{
    const char *parameters = bd_exr_attribute(exr, "parameters");
    uint32_t first = 0;
    if (!parameters || !find_count(parameters, "spp", spp) ||
        !find_count(parameters, "first_sample", &first))
        return bd_err_set(detail, BD_ERR_BAD_INPUT, "parameters", "its manifest counts no samples");
    if (*spp < 2 || *spp % 2 || first != file->spp)
        return bd_err_set(detail, BD_ERR_BAD_INPUT, "parameters",
                          "samples %u to %u do not follow %u that are there", first, first + *spp,
                          file->spp);
    if (file->spp && (exr->width_px != file->width_px || exr->height_px != file->height_px))
        return bd_err_set(detail, BD_ERR_BAD_INPUT, "size", "%ux%u pixels instead of %ux%u",
                          exr->width_px, exr->height_px, file->width_px, file->height_px);
    return BD_ERR_OK;
}

static enum bd_err make_pixels(struct bd_cli_reference_file *file, const struct bd_exr *exr,
                               struct bd_err_detail *detail)
{
    if (file->pixels) return BD_ERR_OK;
    file->width_px = exr->width_px;
    file->height_px = exr->height_px;
    file->pixels = calloc((size_t)exr->width_px * exr->height_px, sizeof *file->pixels);
    if (file->pixels) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_NO_MEMORY, "size", "no memory for the sums of %ux%u pixels",
                      exr->width_px, exr->height_px);
}

static enum bd_err add_exr(struct bd_cli_reference_file *file, const struct bd_exr *exr,
                           struct bd_err_detail *detail)
{
    struct piece piece = {0};
    enum bd_err err = check_count(file, exr, &piece.spp, detail);
    if (!err) err = find_planes(exr, &piece, detail);
    if (!err) err = make_pixels(file, exr, detail);
    if (err) return err;
    for (size_t i = 0; i < (size_t)file->width_px * file->height_px; i++) {
        add_light(&file->pixels[i], &piece, i, file->spp);
        add_guides(&file->pixels[i], &piece, i);
    }
    if (file->spp == 0) take_entries(file, exr);
    file->spp += piece.spp;
    return BD_ERR_OK;
}

enum bd_err bd_cli_reference_file_add(struct bd_cli_reference_file *file, const void *bytes,
                                      size_t size_bytes, struct bd_err_detail *detail)
{
    const struct bd_exr_limits limits = {.side_px_max = bd_exr_limits_default.side_px_max,
                                         .size_bytes_max = FILE_BYTES_MAX};
    struct bd_exr *exr = NULL;
    enum bd_err err = bd_exr_read(bytes, size_bytes, &limits, &exr, detail);
    if (!err) err = add_exr(file, exr, detail);
    bd_exr_destroy(&exr);
    return err;
}

// --- the whole ------------------------------------------------------------------------------

// Layers in the making: each image with its name.
struct picture {
    const struct bd_cli_reference_file *file;
    size_t count;
    struct bd_named_layer layers[24];
    struct bd_image *images[24];
    char names[24][BD_EXR_CHANNEL_NAME_MAX];
};

static struct bd_image *add_layer(struct picture *picture, const char *name, uint32_t channels)
{
    size_t at = picture->count;
    BD_ASSERT_CMP(at, <, sizeof picture->images / sizeof picture->images[0]);
    picture->images[at] =
        bd_image_create(picture->file->width_px, picture->file->height_px, channels);
    if (!picture->images[at]) return NULL;
    snprintf(picture->names[at], sizeof picture->names[at], "%s", name);
    picture->layers[at] = (struct bd_named_layer){picture->names[at], picture->images[at]};
    picture->count++;
    return picture->images[at];
}

static bool add_light_layers(struct picture *picture)
{
    const struct bd_cli_reference_file *file = picture->file;
    size_t pixels = (size_t)file->width_px * file->height_px;
    for (int l = 0; l < LIGHT_COUNT; l++) {
        uint32_t channels = l == BEAUTY ? 4 : 3;
        struct bd_image *image = add_layer(picture, light_names[l], channels);
        for (size_t i = 0; image && i < pixels; i++) {
            const struct sums *sums = &file->pixels[i];
            float *out = image->pixels + i * channels;
            for (int c = 0; c < 3; c++)
                out[c] = (float)((sums->light[BD_HALF_A][l][c] + sums->light[BD_HALF_B][l][c]) /
                                 file->spp);
            if (l == BEAUTY) out[3] = (float)(sums->coverage / file->spp);
        }
        if (!image) return false;
    }
    return true;
}

static bool add_half_layers(struct picture *picture)
{
    const struct bd_cli_reference_file *file = picture->file;
    size_t pixels = (size_t)file->width_px * file->height_px;
    for (int h = 0; h < BD_HALF_COUNT; h++)
        for (int l = 0; l < LIGHT_COUNT; l++) {
            char name[BD_EXR_CHANNEL_NAME_MAX];
            bd_layer_half_name((enum bd_half)h, light_names[l], name);
            struct bd_image *image = add_layer(picture, name, 3);
            if (!image) return false;
            for (size_t i = 0; i < 3 * pixels; i++)
                image->pixels[i] =
                    (float)(file->pixels[i / 3].light[h][l][i % 3] / (0.5 * file->spp));
        }
    return true;
}

static bool add_variance_layers(struct picture *picture)
{
    const struct bd_cli_reference_file *file = picture->file;
    size_t pixels = (size_t)file->width_px * file->height_px;
    double n = file->spp;
    for (int v = 0; v < VARIED_COUNT; v++) {
        struct bd_image *image = add_layer(picture, variance_names[v], 3);
        if (!image) return false;
        for (size_t i = 0; i < 3 * pixels; i++)
            image->pixels[i] = (float)(file->pixels[i / 3].deviation[v][i % 3] / (n * (n - 1)));
    }
    return true;
}

static bool add_guide_layers(struct picture *picture)
{
    const struct bd_cli_reference_file *file = picture->file;
    struct bd_image *albedo = add_layer(picture, "albedo", 3);
    struct bd_image *normal = add_layer(picture, "normal", 3);
    struct bd_image *length = add_layer(picture, "normal_length", 1);
    struct bd_image *depth = add_layer(picture, "depth", 1);
    if (!albedo || !normal || !length || !depth) return false;
    for (size_t i = 0; i < (size_t)file->width_px * file->height_px; i++) {
        const struct sums *s = &file->pixels[i];
        const double *n = s->normal;
        double norm = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        for (int c = 0; c < 3; c++) {
            albedo->pixels[3 * i + (size_t)c] = (float)(s->albedo[c] / file->spp);
            normal->pixels[3 * i + (size_t)c] = norm > 0 ? (float)(n[c] / norm) : 0;
        }
        length->pixels[i] = s->coverage > 0 ? (float)(norm / s->coverage) : 0;
        depth->pixels[i] = s->coverage > 0 ? (float)(s->depth_m / s->coverage) : depth_of_nothing_m;
    }
    return true;
}

// Its own first.
static char *all_parameters(const struct bd_cli_reference_file *file)
{
    const size_t own_max = OWN_COUNT * (OWN_KEY_MAX + BD_CLI_OWN_MAX);
    char *all = calloc(1, own_max + strlen(file->parameters) + 1), *at = all;
    BD_ASSERT(all);
    for (size_t i = 0; i < OWN_COUNT; i++) {
        char value[BD_CLI_OWN_MAX];
        owns[i].write(file, value);
        at += sprintf(at, "%s=%s ", owns[i].key, value);
    }
    strcpy(at, file->parameters);
    return all;
}

static enum bd_err write(const struct picture *picture, struct bd_bytes *out,
                         struct bd_err_detail *detail)
{
    const struct bd_cli_reference_file *file = picture->file;
    struct bd_exr_plane planes[BD_EXR_CHANNEL_MAX];
    memset(planes, 0, sizeof planes);
    struct bd_manifest_entry entries[ENTRY_MAX];
    struct bd_exr_picture exr = {.width_px = file->width_px,
                                 .height_px = file->height_px,
                                 .planes = planes,
                                 .manifest = {entries, file->entry_count}};
    char *parameters = all_parameters(file);
    for (size_t i = 0; i < file->entry_count; i++) {
        entries[i] = file->entries[i];
        if (strcmp(entries[i].key, "parameters") == 0) entries[i].value = parameters;
    }
    enum bd_err err =
        bd_layers_to_planes(picture->layers, picture->count, planes, &exr.plane_count, detail);
    if (!err) err = bd_exr_write(&exr, out, detail);
    free(parameters);
    return err;
}

static struct bd_image *layer_named(const struct picture *picture, const char *name)
{
    for (size_t i = 0; i < picture->count; i++)
        if (strcmp(picture->names[i], name) == 0) return picture->images[i];
    BD_ASSERT(!"a layer that is not made");
    return NULL;
}

static enum bd_err filter_layer(const struct picture *picture, enum light light,
                                struct bd_err_detail *detail)
{
    struct bd_light_filter_inputs inputs = {
        .albedo = layer_named(picture, "albedo"),
        .normal = layer_named(picture, "normal"),
        .depth = layer_named(picture, "depth"),
    };
    for (int h = 0; h < BD_HALF_COUNT; h++) {
        char name[BD_EXR_CHANNEL_NAME_MAX];
        bd_layer_half_name((enum bd_half)h, light_names[light], name);
        inputs.half[h] = layer_named(picture, name);
    }
    return bd_light_filter_run(&inputs, layer_named(picture, light_names[light]), detail);
}

static enum bd_err filter_light(const struct picture *picture, struct bd_err_detail *detail)
{
    enum bd_err err = filter_layer(picture, DIRECT, detail);
    if (!err) err = filter_layer(picture, INDIRECT, detail);
    if (err) return err;
    const struct bd_image *const parts[] = {layer_named(picture, light_names[DIRECT]),
                                            layer_named(picture, light_names[INDIRECT]),
                                            layer_named(picture, light_names[EMISSION])};
    bd_light_add_up(parts, layer_named(picture, light_names[BEAUTY]));
    return BD_ERR_OK;
}

enum bd_err bd_cli_reference_file_encode(const struct bd_cli_reference_file *file,
                                         struct bd_bytes *out, struct bd_err_detail *detail)
{
    BD_ASSERT_CMP(file->spp, >, 0u);
    struct picture picture = {.file = file};
    bool made = add_light_layers(&picture) && add_half_layers(&picture) &&
                add_variance_layers(&picture) && add_guide_layers(&picture);
    enum bd_err err = made ? BD_ERR_OK
                           : bd_err_set(detail, BD_ERR_NO_MEMORY, "size",
                                        "no memory for the layers of %ux%u pixels", file->width_px,
                                        file->height_px);
    if (!err && file->filters) err = filter_light(&picture, detail);
    if (!err) err = write(&picture, out, detail);
    for (size_t i = 0; i < picture.count; i++) bd_image_destroy(&picture.images[i]);
    return err;
}
