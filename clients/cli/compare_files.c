// `bounce compare`: its files read, and brought to what can be compared.

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/text.h"
#include "clients/cli/compare.h"
#include "clients/cli/files.h"
#include "clients/cli/reference_file.h"
#include "image/layers.h"
#include "image/shown.h"

// A reference of 3840 x 2160 has 1.8 GiB of planes; what a file may hold is its owner's decision.
static const struct bd_exr_limits limits = {.side_px_max = 32768,
                                            .size_bytes_max = (uint64_t)8 << 30};

static void note(struct bd_cli_compare_files *files, const char *text)
{
    if (files->note_count == BD_CLI_COMPARE_NOTE_MAX) return;
    char *place = files->notes[files->note_count++];
    snprintf(place, sizeof files->notes[0], "%s", text);
    bd_text_make_plain(place); // it may quote the files, and cut what it quotes
}

// A file of either kind: light, or what a display shows.
struct picture {
    struct bd_exr **exr; // where it goes
    bool shown;
};

// --- reading --------------------------------------------------------------------------------

static enum bd_err read_all(int fd, const char *path, uint64_t size_bytes, struct bd_bytes *out,
                            struct bd_err_detail *detail)
{
    out->data = malloc(size_bytes ? size_bytes : 1);
    if (!out->data)
        return bd_err_set(detail, BD_ERR_NO_MEMORY, path, "%.200s: no memory for it", path);
    while (out->size_bytes < size_bytes) {
        ssize_t got = read(fd, out->data + out->size_bytes, size_bytes - out->size_bytes);
        if (got < 0 && errno == EINTR) continue;
        if (got < 0)
            return bd_err_set(detail, BD_ERR_IO, path, "%.200s: %s", path, strerror(errno));
        if (got == 0) break;
        out->size_bytes += (size_t)got;
    }
    return BD_ERR_OK;
}

static enum bd_err decode(const char *path, const struct bd_bytes *bytes, struct picture *out,
                          struct bd_err_detail *detail)
{
    struct bd_err_detail inner = {0};
    out->shown = bd_shown_is(bytes->data, bytes->size_bytes);
    enum bd_err err = (out->shown ? bd_shown_read : bd_exr_read)(bytes->data, bytes->size_bytes,
                                                                 &limits, out->exr, &inner);
    if (!err) return BD_ERR_OK;
    return bd_err_set(detail, err, path, "%.200s: %s", path, inner.message);
}

static enum bd_err open_picture(const char *path, struct picture *out, struct bd_err_detail *detail)
{
    uint64_t size_bytes;
    int fd = bd_cli_open_regular(path, &size_bytes, detail);
    if (fd < 0) return detail->err;
    struct bd_bytes bytes = {0};
    enum bd_err err = read_all(fd, path, size_bytes, &bytes, detail);
    close(fd);
    if (!err) err = decode(path, &bytes, out, detail);
    bd_bytes_finish(&bytes);
    return err;
}

static enum bd_err open_golden(const char *path, struct picture *out, struct bd_err_detail *detail)
{
    if (access(path, F_OK) && (errno == ENOENT || errno == ENOTDIR))
        return bd_err_set(detail, BD_ERR_NO_GOLDEN, "reference",
                          "%.200s: there is no such reference", path);
    return open_picture(path, out, detail);
}

// --- pictures as they are shown ---------------------------------------------------------------

// How a side was shown, in words.
static void note_showing(struct bd_cli_compare_files *files, const char *side,
                         const struct picture *picture, const struct bd_showing *showing,
                         bool is_said)
{
    char text[256], how[96];
    snprintf(how, sizeof how, "%+.4g stops, curve %s", (double)showing->stops,
             bd_tonemap_name(showing->tonemap));
    if (!picture->shown)
        snprintf(text, sizeof text, "%s holds light: it is shown with %s%s", side, how,
                 is_said ? ", as the other side was" : "; the other side does not say how it was");
    else
        snprintf(text, sizeof text, "%s is decoded from sRGB to linear, 0 to 1%s%s%s", side,
                 is_said ? " (it was shown with " : "", is_said ? how : "", is_said ? ")" : "");
    note(files, text);
}

// Where one side is a PNG or JPEG, what a display shows is compared: the other, if it holds light,
// is shown likewise.
static enum bd_err show_both(const struct bd_cli_compare *compare, const struct picture *reference,
                             const struct picture *image, struct bd_cli_compare_files *files,
                             struct bd_err_detail *detail)
{
    const struct picture *sides[] = {reference, image};
    const char *const names[] = {"REFERENCE", "IMAGE"};
    const char *const paths[] = {compare->reference, compare->image};
    struct bd_showing showing[2];
    bool is_said[2];
    for (int s = 0; s < 2; s++) is_said[s] = bd_showing_of(*sides[s]->exr, &showing[s]);
    for (int s = 0; s < 2; s++) {
        int how = sides[s]->shown ? s : !s;
        note_showing(files, names[s], sides[s], &showing[how], is_said[how]);
        struct bd_err_detail inner = {0};
        enum bd_err err =
            sides[s]->shown ? BD_ERR_OK : bd_show_exr(*sides[s]->exr, &showing[how], &inner);
        if (err) return bd_err_set(detail, err, "layer", "%.200s: %s", paths[s], inner.message);
    }
    bool differ = showing[0].stops < showing[1].stops || showing[0].stops > showing[1].stops ||
                  showing[0].tonemap != showing[1].tonemap;
    if (sides[0]->shown && sides[1]->shown && is_said[0] && is_said[1] && differ)
        note(files, "exposure or tone curve differ: that is error as well (--exposure STOPS of "
                    "bounce render holds it)");
    return BD_ERR_OK;
}

// --- what must agree ------------------------------------------------------------------------

static enum bd_err check_size(const char *path_a, const struct bd_exr *a, const char *path_b,
                              const struct bd_exr *b, struct bd_err_detail *detail)
{
    if (a->width_px == b->width_px && a->height_px == b->height_px) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_DIFFERS, "size",
                      "sizes differ: %.150s is %ux%u, %.150s is %ux%u", path_a, a->width_px,
                      a->height_px, path_b, b->width_px, b->height_px);
}

static enum bd_err check_filter(const struct bd_cli_compare *compare,
                                struct bd_cli_compare_files *files, struct bd_err_detail *detail)
{
    const char *reference = bd_exr_attribute(files->reference, "filter");
    const char *image = bd_exr_attribute(files->image, "filter");
    if (!reference || !image) {
        if (reference || image)
            note(files, reference ? "IMAGE does not say its pixel filter"
                                  : "REFERENCE does not say its pixel filter");
        return BD_ERR_OK;
    }
    if (strcmp(reference, image) == 0) return BD_ERR_OK;
    char text[200];
    snprintf(text, sizeof text, "pixel filters differ: REFERENCE %.60s, IMAGE %.60s", reference,
             image);
    if (!compare->ignore_filter)
        return bd_err_set(detail, BD_ERR_DIFFERS, "filter", "%s (--ignore filter compares anyway)",
                          text);
    note(files, text);
    return BD_ERR_OK;
}

static void check_scene(struct bd_cli_compare_files *files)
{
    const char *reference = bd_exr_attribute(files->reference, "scene");
    const char *image = bd_exr_attribute(files->image, "scene");
    if (!reference || !image || strcmp(reference, image) == 0) return;
    char text[256];
    snprintf(text, sizeof text, "scenes differ: REFERENCE %.90s, IMAGE %.90s", reference, image);
    note(files, text);
}

static bool is_attribute(const struct bd_exr *exr, const char *key, const char *value)
{
    const char *text = bd_exr_attribute(exr, key);
    return text && value && strcmp(text, value) == 0;
}

// Halves of a filtered file are its light as it was traced: as a reference that is what is wanted;
// as a picture it is not what is shown.
static bool is_filtered(const struct bd_exr *exr)
{
    const char *parameters = bd_exr_attribute(exr, "parameters");
    return is_attribute(exr, "technique", "reference") && parameters &&
           bd_cli_parameters_filter(parameters);
}

static void check_noise_filter(struct bd_cli_compare_files *files)
{
    if (is_filtered(files->reference) && !bd_exr_channel(files->reference, "half_a.R"))
        note(files, "REFERENCE is filtered and has no halves: what the filter took away counts as "
                    "error");
}

// A path-traced picture without halves may be made of the very samples that the reference is made
// of: its noise is then the reference's, and looks like agreement. With halves, (I1 - A)(I2 - B)
// does not mind: only 1 and 2 must be independent.
static void check_seed(struct bd_cli_compare_files *files)
{
    if (is_attribute(files->image, "technique", "reference") &&
        is_attribute(files->reference, "technique", "reference") &&
        is_attribute(files->image, "seed", bd_exr_attribute(files->reference, "seed")) &&
        !bd_exr_channel(files->image, "half_a.R"))
        note(files, "IMAGE was traced with REFERENCE's seed and has no halves: noise that both "
                    "share looks like agreement");
}

// One file twice shares its noise with itself, which would then be taken for truth.
static enum bd_err check_half(const struct bd_cli_compare *compare, struct bd_err_detail *detail)
{
    struct stat a, b;
    if (stat(compare->reference, &a) == 0 && stat(compare->half, &b) == 0 && a.st_dev == b.st_dev &&
        a.st_ino == b.st_ino)
        return bd_err_set(detail, BD_ERR_USAGE, "half",
                          "--half %.150s: the same file as REFERENCE; halves must not share "
                          "their noise",
                          compare->half);
    return BD_ERR_OK;
}

// --- regions --------------------------------------------------------------------------------

// Cuts `region` down to what the file's manifest says was traced; the rest of it is black.
static enum bd_err cut_region(const char *path, const struct bd_exr *exr,
                              struct bd_cli_region *region, struct bd_err_detail *detail)
{
    const char *text = exr ? bd_exr_attribute(exr, "region") : NULL;
    if (!text) return BD_ERR_OK;
    uint32_t x, y, width, height;
    char rest;
    bool numbers = strspn(text, "0123456789,") == strlen(text) && strlen(text) < 44 &&
                   sscanf(text, "%u,%u,%u,%u%c", &x, &y, &width, &height, &rest) == 4;
    if (!numbers || x > exr->width_px || width > exr->width_px - x || y > exr->height_px ||
        height > exr->height_px - y)
        return bd_err_set(detail, BD_ERR_BAD_INPUT, "region",
                          "%.150s: its region %.60s is no X,Y,WIDTH,HEIGHT within %ux%u", path,
                          text, exr->width_px, exr->height_px);
    uint32_t right = x + width, bottom = y + height;
    if (right > region->x_px + region->width_px) right = region->x_px + region->width_px;
    if (bottom > region->y_px + region->height_px) bottom = region->y_px + region->height_px;
    if (x > region->x_px) region->x_px = x;
    if (y > region->y_px) region->y_px = y;
    region->width_px = right > region->x_px ? right - region->x_px : 0;
    region->height_px = bottom > region->y_px ? bottom - region->y_px : 0;
    return BD_ERR_OK;
}

static enum bd_err find_region(const struct bd_cli_compare *compare,
                               struct bd_cli_compare_files *files, struct bd_err_detail *detail)
{
    struct bd_cli_region *region = &files->region;
    *region = (struct bd_cli_region){0, 0, files->image->width_px, files->image->height_px};
    enum bd_err err = cut_region(compare->reference, files->reference, region, detail);
    if (!err) err = cut_region(compare->half, files->half, region, detail);
    if (!err) err = cut_region(compare->image, files->image, region, detail);
    if (err || (region->width_px && region->height_px)) return err;
    return bd_err_set(detail, BD_ERR_DIFFERS, "region",
                      "regions differ: REFERENCE and IMAGE have no pixel in common");
}

static enum bd_err crop(struct bd_image **image, const struct bd_cli_region *region,
                        struct bd_err_detail *detail)
{
    const struct bd_image *whole = *image;
    if (!whole || (whole->width_px == region->width_px && whole->height_px == region->height_px))
        return BD_ERR_OK;
    struct bd_image *part =
        bd_image_create(region->width_px, region->height_px, whole->channel_count);
    if (!part) return bd_err_set(detail, BD_ERR_NO_MEMORY, "region", "no memory for a region");
    size_t row_bytes = (size_t)region->width_px * whole->channel_count * sizeof *part->pixels;
    for (uint32_t y = 0; y < region->height_px; y++)
        memcpy(bd_image_at(part, 0, y), bd_image_at(whole, region->x_px, region->y_px + y),
               row_bytes);
    bd_image_destroy(image);
    *image = part;
    return BD_ERR_OK;
}

enum bd_err bd_cli_compare_open(const struct bd_cli_compare *compare,
                                struct bd_cli_compare_files *out, struct bd_err_detail *detail)
{
    *out = (struct bd_cli_compare_files){0};
    struct picture reference = {.exr = &out->reference}, half = {.exr = &out->half},
                   image = {.exr = &out->image};
    enum bd_err err = open_golden(compare->reference, &reference, detail);
    if (!err && compare->half) err = open_golden(compare->half, &half, detail);
    if (!err && compare->half) err = check_half(compare, detail);
    if (!err) err = open_picture(compare->image, &image, detail);
    out->shown = reference.shown || image.shown || half.shown;
    if (!err && out->shown && compare->half)
        err = bd_err_set(detail, BD_ERR_USAGE, "half",
                         "--half: halves are of light; a PNG or JPEG shows none");
    if (!err && out->shown) err = show_both(compare, &reference, &image, out, detail);
    if (!err)
        err = check_size(compare->reference, out->reference, compare->image, out->image, detail);
    if (!err && out->half)
        err = check_size(compare->reference, out->reference, compare->half, out->half, detail);
    if (!err) err = find_region(compare, out, detail);
    if (!err) err = check_filter(compare, out, detail);
    if (!err) check_scene(out);
    if (!err) check_noise_filter(out);
    if (!err) check_seed(out);
    return err;
}

void bd_cli_compare_close(struct bd_cli_compare_files *files)
{
    bd_exr_destroy(&files->reference);
    bd_exr_destroy(&files->half);
    bd_exr_destroy(&files->image);
}

// --- layers ---------------------------------------------------------------------------------

// Both halves of a layer where a file has them, and none of them otherwise.
static void open_halves(const struct bd_exr *exr, const char *layer, struct bd_image *out[2])
{
    for (int half = 0; half < BD_HALF_COUNT; half++) {
        char name[BD_EXR_CHANNEL_NAME_MAX];
        bd_layer_half_name((enum bd_half)half, layer, name);
        if (bd_layer_from_exr(exr, name, &out[half], NULL)) break;
    }
    if (out[0] && out[1]) return;
    bd_image_destroy(&out[0]);
    bd_image_destroy(&out[1]);
}

static bool has_layer(const struct bd_exr *exr, const char *layer)
{
    struct bd_image *image = NULL;
    bool has = bd_layer_from_exr(exr, layer, &image, NULL) == BD_ERR_OK;
    bd_image_destroy(&image);
    return has;
}

static enum bd_err open_plain(const char *path, const struct bd_exr *exr,
                              const struct bd_exr *other, const char *layer, struct bd_image **out,
                              struct bd_err_detail *detail)
{
    struct bd_err_detail inner = {0};
    enum bd_err err = bd_layer_from_exr(exr, layer, out, &inner);
    if (!err) return BD_ERR_OK;
    if (err == BD_ERR_NOT_FOUND && has_layer(other, layer)) err = BD_ERR_DIFFERS;
    return bd_err_set(detail, err, "layer", "%.150s: %s", path, inner.message);
}

// `out` gets two halves or one picture.
static enum bd_err open_side(const char *path, const struct bd_exr *exr, const struct bd_exr *other,
                             const char *layer, struct bd_image *out[2],
                             struct bd_err_detail *detail)
{
    open_halves(exr, layer, out);
    return out[0] ? BD_ERR_OK : open_plain(path, exr, other, layer, &out[0], detail);
}

static enum bd_err open_second_half(const struct bd_cli_compare *compare,
                                    const struct bd_cli_compare_files *files, const char *layer,
                                    struct bd_image *out[2], struct bd_err_detail *detail)
{
    if (!files->half) return BD_ERR_OK;
    if (out[1])
        return bd_err_set(detail, BD_ERR_USAGE, "half",
                          "--half: %.150s holds two halves of %.40s already", compare->reference,
                          layer);
    return open_plain(compare->half, files->half, files->reference, layer, &out[1], detail);
}

static enum bd_err check_channels(const char *layer, struct bd_image *const owned[4],
                                  struct bd_err_detail *detail)
{
    for (int i = 1; i < 4; i++)
        if (owned[i] && owned[i]->channel_count != owned[0]->channel_count)
            return bd_err_set(detail, BD_ERR_DIFFERS, "layer",
                              "layer %.40s has %u channels in REFERENCE, %u elsewhere", layer,
                              owned[0]->channel_count, owned[i]->channel_count);
    return BD_ERR_OK;
}

enum bd_err bd_cli_compare_layer_open(const struct bd_cli_compare *compare,
                                      const struct bd_cli_compare_files *files, const char *layer,
                                      struct bd_cli_compare_layer *out,
                                      struct bd_err_detail *detail)
{
    *out = (struct bd_cli_compare_layer){0};
    if (files->shown && strcmp(layer, "beauty") != 0)
        return bd_err_set(detail, BD_ERR_DIFFERS, "layer",
                          "layer %.40s: a PNG or JPEG has no layers, only what it shows; leave "
                          "--layer out",
                          layer);
    struct bd_image **reference = out->owned, **image = out->owned + 2;
    enum bd_err err =
        open_side(compare->reference, files->reference, files->image, layer, reference, detail);
    if (!err) err = open_second_half(compare, files, layer, reference, detail);
    if (!err && is_filtered(files->image))
        err = open_plain(compare->image, files->image, files->reference, layer, &image[0], detail);
    else if (!err)
        err = open_side(compare->image, files->image, files->reference, layer, image, detail);
    if (!err) err = check_channels(layer, out->owned, detail);
    for (int i = 0; !err && i < 4; i++) err = crop(&out->owned[i], &files->region, detail);
    if (err) return err;
    out->input = (struct bd_metric_input){
        .reference = {reference[0], reference[1] ? reference[1] : reference[0]},
        .image = {image[0], image[1] ? image[1] : image[0]},
        .display = image[0]->channel_count == 3 && strcmp(layer, "normal") != 0,
        .shown = files->shown,
        .ppd = compare->ppd,
    };
    return BD_ERR_OK;
}

void bd_cli_compare_layer_close(struct bd_cli_compare_layer *layer)
{
    for (int i = 0; i < 4; i++) bd_image_destroy(&layer->owned[i]);
}
