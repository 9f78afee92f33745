// reference SCENE.glb OUT.exr WxH CAMERA SAMPLES [KEY=VALUE]...
//
// One picture by the path tracer, without daemon and command line: beauty, direct, indirect,
// emission, albedo, normal and depth into an EXR; prints time, rays and noise.
//
//   bounces=N|inf visibility=0|1 lights=BITS filter=point|box alpha=mask|coverage clamp=B lambert=0|1
//   senders=0|1 transmission=0|1 vertices=0|1 seed=N threads=N

#include <math.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/pool.h"
#include "image/encode.h"
#include "reference/reference.h"
#include "scene/import/import.h"
#include "tests/tools/load_scene.h"

struct options {
    struct bd_integrand integrand;
    uint64_t seed;
    uint32_t threads, samples;
    struct bd_reference_view view;
};

struct picture {
    const struct options *options;
    const struct bd_reference *reference;
    struct bd_reference_pixel *pixels;
    _Atomic uint64_t ray_count;
};

static bool read_option(const char *text, struct options *o)
{
    struct bd_integrand *i = &o->integrand;
    const char *value = strchr(text, '=');
    if (!value++) return false;
    double number = atof(value);
    size_t length = (size_t)(value - text);
    bool inf = strcmp(value, "inf") == 0;
#define IS(key) (length == sizeof key && strncmp(text, key "=", length) == 0)
    if (IS("bounces")) return i->bounces_max = inf ? BD_BOUNCES_UNLIMITED : (uint32_t)number, true;
    if (IS("visibility")) return i->indirect_visibility = number != 0, true;
    if (IS("lights")) return i->lights = (uint32_t)number, true;
    if (IS("filter"))
        return i->filter = strcmp(value, "box") == 0 ? BD_FILTER_BOX : BD_FILTER_POINT, true;
    if (IS("alpha"))
        return i->alpha = strcmp(value, "mask") == 0 ? BD_ALPHA_AS_MASK : BD_ALPHA_AS_COVERAGE,
               true;
    if (IS("clamp")) return i->clamp_per_m2 = inf ? INFINITY : number, true;
    if (IS("lambert")) return i->lambert = number != 0, true;
    if (IS("senders")) return i->lambert_senders = number != 0, true;
    if (IS("transmission")) return i->transmission = number != 0, true;
    if (IS("vertices")) return i->light_vertices = number != 0, true;
    if (IS("seed")) return o->seed = (uint64_t)number, true;
    if (IS("threads")) return o->threads = (uint32_t)number, true;
#undef IS
    return false;
}

static void trace_row(void *user, uint32_t row)
{
    struct picture *p = user;
    const struct options *o = p->options;
    uint64_t before = bd_reference_ray_count();
    for (uint32_t x = 0; x < o->view.width_px; x++)
        bd_reference_trace(p->reference, &o->integrand, &o->view, o->seed, x, row, 0, o->samples,
                           &p->pixels[(size_t)row * o->view.width_px + x]);
    atomic_fetch_add(&p->ray_count, bd_reference_ray_count() - before);
}

// --- layers -------------------------------------------------------------------------------------

enum layer { BEAUTY, DIRECT, INDIRECT, EMISSION, ALBEDO, NORMAL, DEPTH, LAYER_COUNT };
static const char *const layer_names[LAYER_COUNT] = {"beauty", "direct", "indirect", "emission",
                                                     "albedo", "normal", "depth"};

static double part(const struct bd_reference_pixel *p, enum bd_reference_part part, int k)
{
    double count = (double)p->sample_count[0] + p->sample_count[1];
    return (p->sum[0][part][k] + p->sum[1][part][k]) / count;
}

static float layer_value(const struct bd_reference_pixel *p, enum layer layer, int k)
{
    double met = p->coverage > 0 ? p->coverage : 1;
    switch (layer) {
    case BEAUTY:
        return (float)(part(p, BD_PART_DIRECT, k) + part(p, BD_PART_INDIRECT, k) +
                       part(p, BD_PART_EMISSION, k));
    case DIRECT:
        return (float)part(p, BD_PART_DIRECT, k);
    case INDIRECT:
        return (float)part(p, BD_PART_INDIRECT, k);
    case EMISSION:
        return (float)part(p, BD_PART_EMISSION, k);
    case ALBEDO:
        return (float)(p->albedo[k] / met);
    case NORMAL:
        return (float)(p->normal[k] / met);
    case DEPTH:
        return (float)(p->depth_m / met);
    case LAYER_COUNT:
        break;
    }
    return 0;
}

static enum bd_err write_picture(const char *path, const struct picture *picture,
                                 struct bd_err_detail *detail)
{
    const struct bd_reference_view *view = &picture->options->view;
    struct bd_named_layer layers[LAYER_COUNT];
    struct bd_encode_request request = bd_encode_request_default;
    const char *dot = strrchr(path, '.');
    if (!dot || !bd_encode_format_from_name(dot + 1, &request.format))
        return bd_err_set(detail, BD_ERR_USAGE, path, "must end in .exr, .png or .jpg");
    for (int l = 0; l < LAYER_COUNT; l++) {
        int channels = l == DEPTH ? 1 : 3;
        struct bd_image *image =
            bd_image_create(view->width_px, view->height_px, (uint32_t)channels);
        if (!image) abort();
        for (size_t i = 0; i < (size_t)view->width_px * view->height_px; i++)
            for (int k = 0; k < channels; k++)
                image->pixels[i * (size_t)channels + (size_t)k] =
                    layer_value(&picture->pixels[i], (enum layer)l, k);
        layers[l] = (struct bd_named_layer){layer_names[l], image};
    }
    struct bd_encoded encoded;
    const struct bd_manifest manifest = {0};
    enum bd_err err = bd_encode(&request, layers, LAYER_COUNT, &manifest, &encoded, detail);
    for (int l = 0; l < LAYER_COUNT; l++) {
        struct bd_image *image = (struct bd_image *)layers[l].image;
        bd_image_destroy(&image);
    }
    if (err) return err;
    FILE *file = fopen(path, "wb");
    if (!file ||
        fwrite(encoded.bytes.data, 1, encoded.bytes.size_bytes, file) != encoded.bytes.size_bytes)
        err = bd_err_set(detail, BD_ERR_IO, path, "cannot be written");
    if (file) fclose(file);
    bd_bytes_finish(&encoded.bytes);
    return err;
}

// Root of the mean squared error of the pixels' means over the mean, from the samples' variance.
static double relative_noise(const struct picture *picture, enum bd_reference_part which)
{
    const struct bd_reference_view *view = &picture->options->view;
    double mean = 0, variance = 0;
    size_t count = (size_t)view->width_px * view->height_px;
    for (size_t i = 0; i < count; i++)
        for (int k = 0; k < 3; k++) {
            const struct bd_reference_pixel *p = &picture->pixels[i];
            double n = (double)p->sample_count[0] + p->sample_count[1];
            double m = part(p, which, k);
            mean += m / (3 * (double)count);
            variance += (p->square_sum[which][k] / n - m * m) / n / (3 * (double)count);
        }
    return mean > 0 ? sqrt(fmax(variance, 0)) / mean : 0;
}

// Mean over the picture of half the difference of the halves, squared, without the samples' own
// variance: what stratification makes of them.
static double relative_halves(const struct picture *picture, enum bd_reference_part which)
{
    const struct bd_reference_view *view = &picture->options->view;
    double mean = 0, square = 0;
    size_t count = (size_t)view->width_px * view->height_px;
    for (size_t i = 0; i < count; i++)
        for (int k = 0; k < 3; k++) {
            const struct bd_reference_pixel *p = &picture->pixels[i];
            double a = p->sum[0][which][k] / p->sample_count[0];
            double b = p->sum[1][which][k] / p->sample_count[1];
            mean += (a + b) / 2, square += (a - b) * (a - b) / 4;
        }
    mean /= 3 * (double)count, square /= 3 * (double)count;
    return mean > 0 ? sqrt(square) / mean : 0;
}

static void print_means(const struct picture *picture)
{
    static const char *const names[BD_PART_COUNT] = {"direct", "indirect", "emission"};
    const struct bd_reference_view *view = &picture->options->view;
    size_t count = (size_t)view->width_px * view->height_px;
    uint64_t nonfinite = 0;
    for (size_t i = 0; i < count; i++) nonfinite += picture->pixels[i].nonfinite_count;
    for (int w = 0; w < BD_PART_COUNT; w++) {
        double mean = 0;
        for (size_t i = 0; i < count; i++)
            for (int k = 0; k < 3; k++)
                mean += part(&picture->pixels[i], (enum bd_reference_part)w, k);
        printf("%-9s mean %.6g, noise %.2f %% by samples, %.2f %% by halves\n", names[w],
               mean / (3 * (double)count),
               100 * relative_noise(picture, (enum bd_reference_part)w),
               100 * relative_halves(picture, (enum bd_reference_part)w));
    }
    printf("non-finite samples %llu\n", (unsigned long long)nonfinite);
}

static enum bd_err run(struct picture *picture, struct bd_scene *scene, const char *path,
                       struct bd_err_detail *detail)
{
    const struct options *o = picture->options;
    struct bd_reference *reference = NULL;
    uint64_t start = bd_clock_ns();
    enum bd_err err = bd_reference_create(scene, o->threads, NULL, NULL, &reference, detail);
    if (err) return err;
    double built_ms = bd_ms_since(start);
    picture->reference = reference;
    picture->pixels =
        calloc((size_t)o->view.width_px * o->view.height_px, sizeof *picture->pixels);
    struct bd_pool *pool = bd_pool_create(o->threads);
    err = bd_pool_run(pool, o->view.height_px, trace_row, NULL, picture);
    double traced_ms = bd_ms_since(start) - built_ms;
    printf("built in %.0f ms, traced in %.0f ms, %.2f M rays, %.2f M rays/s\n", built_ms, traced_ms,
           (double)picture->ray_count * 1e-6,
           (double)picture->ray_count * 1e-3 / traced_ms);
    print_means(picture);
    if (!err) err = write_picture(path, picture, detail);
    bd_pool_destroy(&pool);
    free(picture->pixels);
    bd_reference_destroy(&reference);
    return err;
}

static enum bd_err read_arguments(int argc, char **argv, const struct bd_scene *scene,
                                  struct options *o, struct bd_err_detail *detail)
{
    int32_t camera = bd_scene_find_camera(scene, argv[4]);
    if (camera == BD_NONE) return bd_err_set(detail, BD_ERR_USAGE, argv[4], "no such camera");
    o->view.camera = (uint32_t)camera;
    o->samples = ((uint32_t)atoi(argv[5]) + 1) / 2;
    if (sscanf(argv[3], "%ux%u", &o->view.width_px, &o->view.height_px) != 2)
        return bd_err_set(detail, BD_ERR_USAGE, "size", "%s: must be WxH", argv[3]);
    for (int i = 6; i < argc; i++)
        if (!read_option(argv[i], o))
            return bd_err_set(detail, BD_ERR_USAGE, argv[i], "is no option");
    return BD_ERR_OK;
}

int main(int argc, char **argv)
{
    if (argc < 6) {
        fprintf(stderr, "usage: reference SCENE OUT WxH CAMERA SAMPLES [KEY=VALUE]...\n");
        return 2;
    }
    struct bd_err_detail detail = {0};
    struct options options = {.integrand = bd_integrand_full};
    struct picture picture = {.options = &options};
    struct bd_scene *scene = NULL;
    enum bd_err err = import_scene(argv[1], &scene, &detail);
    if (!err) err = read_arguments(argc, argv, scene, &options, &detail);
    if (!err) err = run(&picture, scene, argv[2], &detail);
    bd_scene_release(&scene);
    if (err) fprintf(stderr, "reference: %s: %s\n", detail.field, detail.message);
    return bd_err_exit_code(err);
}
