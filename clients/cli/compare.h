// `bounce compare`, in parts: what was asked, what the files hold, what is said of them.
//
// Thread: main.

#ifndef BD_CLI_COMPARE_H
#define BD_CLI_COMPARE_H

#include <jansson.h>
#include <stdbool.h>
#include <stdint.h>

#include "base/err.h"
#include "image/exr.h"
#include "image/metric.h"

#define BD_CLI_COMPARE_LAYER_MAX     16
#define BD_CLI_COMPARE_TOLERANCE_MAX 64
#define BD_CLI_COMPARE_NOTE_MAX      8

// --- compare_options.c ----------------------------------------------------------------------

struct bd_cli_tolerance {
    const char *text; // NAME=VALUE, NAME.high=VALUE or NAME.low=VALUE; borrowed from argv
    enum bd_metric metric;
    bool at_end; // of the interval's worse end, not of the value
    double limit;
};

struct bd_cli_compare {
    const char *reference, *image;
    const char *half; // the reference's second half in a file of its own, NULL = none
    const char *map;  // PNG to write, NULL = none
    const char *layers[BD_CLI_COMPARE_LAYER_MAX];
    uint32_t layer_count; // at least 1
    struct bd_cli_tolerance tolerances[BD_CLI_COMPARE_TOLERANCE_MAX];
    uint32_t tolerance_count;
    double ppd;
    bool ignore_filter, json, quiet, help;
};

// Decodes the words behind `bounce compare`. BD_ERR_USAGE names the option and what it allows.
BD_MUST_CHECK
enum bd_err bd_cli_parse_compare(const char *const *words, int count, struct bd_cli_compare *out,
                                 struct bd_err_detail *detail);

// --- compare_tolerances.c -------------------------------------------------------------------

// Tells `tell` of each tolerance that a layer's figures miss. Where there is any tolerance at all,
// a pixel that is NaN or infinite is one too many, unless `nonfinite` has a tolerance of its own.
// BD_ERR_USAGE if one is of a figure that cannot be measured here.
BD_MUST_CHECK
enum bd_err bd_cli_tolerances_check(const struct bd_cli_compare *compare, const char *layer,
                                    const struct bd_metrics *metrics,
                                    void (*tell)(void *user, const char *what), void *user,
                                    struct bd_err_detail *detail);

// --- compare_files.c ------------------------------------------------------------------------

struct bd_cli_region {
    uint32_t x_px, y_px, width_px, height_px;
};

struct bd_cli_compare_files {
    struct bd_exr *reference, *half, *image; // `half` may be NULL
    bool shown; // what a display shows is compared, not light: one of them is a PNG or JPEG
    struct bd_cli_region
        region; // what every file shows: all of it, unless its manifest names a part
    char notes[BD_CLI_COMPARE_NOTE_MAX][256];
    uint32_t note_count;
};

// Reads the files, and refuses pairs that cannot be compared: BD_ERR_NO_GOLDEN if the reference (or
// its half) is not there, BD_ERR_DIFFERS for sizes, filters and regions that do not meet; what is
// merely worth knowing is a note. Finish `out` either way.
BD_MUST_CHECK
enum bd_err bd_cli_compare_open(const struct bd_cli_compare *compare,
                                struct bd_cli_compare_files *out, struct bd_err_detail *detail);
void bd_cli_compare_close(struct bd_cli_compare_files *files);

// One layer of both sides, cut to the region, their halves where they have them.
struct bd_cli_compare_layer {
    struct bd_metric_input input;
    struct bd_image *owned[4];
};

// BD_ERR_DIFFERS if only one side has the layer, or with another number of channels;
// BD_ERR_NOT_FOUND if neither has it. Finish `out` either way.
BD_MUST_CHECK
enum bd_err bd_cli_compare_layer_open(const struct bd_cli_compare *compare,
                                      const struct bd_cli_compare_files *files, const char *layer,
                                      struct bd_cli_compare_layer *out,
                                      struct bd_err_detail *detail);
void bd_cli_compare_layer_close(struct bd_cli_compare_layer *layer);

// --- compare_print.c ------------------------------------------------------------------------

void bd_cli_compare_print(const struct bd_cli_compare *compare,
                          const struct bd_cli_compare_files *files, const char *layer,
                          const struct bd_cli_compare_layer *pictures,
                          const struct bd_metrics *metrics);

// Adds the layer's figures to an object: the report itself, or of several layers that of the
// layer's name in its `layers`. null stands for infinite and for what cannot be said. False if
// there is no memory.
bool bd_cli_compare_json(json_t *object, const struct bd_cli_compare_files *files,
                         const char *layer, const struct bd_cli_compare_layer *pictures,
                         const struct bd_metrics *metrics);

#endif
