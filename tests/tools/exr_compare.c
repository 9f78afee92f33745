// exr_compare IMAGE.exr LAYER REFERENCE_1.exr REFERENCE_2.exr
//
// One layer of an image against two independent halves of a reference (image/metric.h), as one
// line of JSON. Exit code as bounce's: 0, 2 for usage, 4 for files that cannot be read.

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#include "image/exr.h"
#include "image/layers.h"
#include "image/metric.h"

static enum bd_err read_all(FILE *file, struct bd_bytes *out)
{
    uint8_t chunk[65536];
    size_t got;
    while ((got = fread(chunk, 1, sizeof chunk, file)) > 0) {
        enum bd_err err = bd_bytes_put(out, out->size_bytes, chunk, got);
        if (err) return err;
    }
    return ferror(file) ? BD_ERR_IO : BD_ERR_OK;
}

static enum bd_err load_layer(const char *path, const char *layer, struct bd_image **out,
                              struct bd_fault *fault)
{
    FILE *file = fopen(path, "rb");
    if (!file) return bd_fault_set(fault, BD_ERR_IO, path, "cannot be opened");
    struct bd_bytes bytes = {0};
    enum bd_err err = read_all(file, &bytes);
    fclose(file);
    struct bd_exr *exr = NULL;
    if (err)
        bd_fault_set(fault, err, path, "cannot be read");
    else
        err = bd_exr_read(bytes.data, bytes.size_bytes, &bd_exr_limits_default, &exr, fault);
    bd_bytes_finish(&bytes);
    if (err) return err;
    err = bd_layer_from_exr(exr, layer, out, fault);
    bd_exr_destroy(&exr);
    return err;
}

// JSON has no infinity: null stands for what cannot be said.
static void print_number(const char *key, double value, const char *end)
{
    if (value - value == 0)
        printf("\"%s\": %.9g%s", key, value, end);
    else
        printf("\"%s\": null%s", key, end);
}

static void print_metric(const char *layer, const struct bd_metric *metric)
{
    printf("{\"layer\": \"%s\", ", layer);
    print_number("rel_rmse", metric->rel_rmse, ", ");
    print_number("mean_square", metric->mean_square, ", ");
    print_number("signed_error", metric->signed_error, ", ");
    print_number("noise_floor", metric->noise_floor, ", ");
    print_number("max_abs", metric->max_abs, ", ");
    print_number("mean_image", metric->mean_image, ", ");
    print_number("mean_reference", metric->mean_reference, ", ");
    printf("\"samples\": %" PRIu64 ", \"nonfinite\": %" PRIu64 "}\n", metric->sample_count,
           metric->nonfinite_count);
}

int main(int argc, char **argv)
{
    if (argc != 5) {
        fputs("usage: exr_compare IMAGE.exr LAYER REFERENCE_1.exr REFERENCE_2.exr\n", stderr);
        return 2;
    }
    const char *const paths[3] = {argv[1], argv[3], argv[4]};
    struct bd_image *images[3] = {0};
    struct bd_fault fault = {0};
    enum bd_err err = BD_ERR_OK;
    const char *path = argv[1];
    for (int i = 0; !err && i < 3; i++) {
        path = paths[i];
        err = load_layer(path, argv[2], &images[i], &fault);
    }
    struct bd_metric metric;
    if (!err) err = bd_metric_measure(images[0], images[1], images[2], &metric, &fault);
    if (!err) print_metric(argv[2], &metric);
    if (err) fprintf(stderr, "exr_compare: %s: %s\n", path, fault.message);
    for (int i = 0; i < 3; i++) bd_image_destroy(&images[i]);
    return bd_err_exit_code(err);
}
