// `bounce compare`.

#include <signal.h>
#include <stdio.h>
#include <stdlib.h>

#include "clients/cli/commands.h"
#include "clients/cli/compare.h"
#include "clients/cli/help.h"
#include "clients/cli/output.h"
#include "clients/cli/print.h"
#include "image/error_map.h"
#include "image/png.h"

struct comparing {
    const struct bd_cli_compare *asked;
    struct bd_cli_compare_files files;
    json_t *report; // NULL unless --json
    json_t *missed; // of the report: a line for each tolerance that is missed
    uint32_t misses;
};

static enum bd_err no_memory(struct bd_err_detail *detail)
{
    return bd_err_set(detail, BD_ERR_NO_MEMORY, "", "no memory for the answer");
}

static void tell_miss(void *user, const char *what)
{
    struct comparing *comparing = user;
    fprintf(stderr, "bounce: %s\n", what);
    if (comparing->missed) json_array_append_new(comparing->missed, json_string(what));
    comparing->misses++;
}

static enum bd_err write_map(const struct bd_cli_compare *asked,
                             const struct bd_cli_compare_layer *pictures,
                             const struct bd_metrics *metrics, struct bd_err_detail *detail)
{
    struct bd_canvas canvas;
    struct bd_bytes bytes = {0};
    enum bd_err err = bd_error_map(
        &pictures->input, metrics->figures[BD_METRIC_MEAN_REFERENCE].value, &canvas, detail);
    if (err) return err;
    struct bd_pixels8 pixels = {canvas.width_px, canvas.height_px, 3, canvas.rgb8};
    err = bd_png_encode(&pixels, &(struct bd_manifest){0}, &bytes, detail);
    if (!err) err = bd_cli_output_write(asked->map, bytes.data, bytes.size_bytes, detail);
    bd_bytes_finish(&bytes);
    free(canvas.rgb8);
    return err;
}

// Where a layer's figures go: the report itself if it is the only one, else an object of its own.
static json_t *place_of(struct comparing *comparing, const char *layer)
{
    if (comparing->asked->layer_count == 1) return comparing->report;
    json_t *layers = json_object_get(comparing->report, "layers");
    json_t *object = json_object();
    return json_object_set_new(layers, layer, object) == 0 ? object : NULL;
}

static enum bd_err say(struct comparing *comparing, const char *layer,
                       const struct bd_cli_compare_layer *pictures,
                       const struct bd_metrics *metrics, struct bd_err_detail *detail)
{
    if (!comparing->report) {
        bd_cli_compare_print(comparing->asked, &comparing->files, layer, pictures, metrics);
        return BD_ERR_OK;
    }
    json_t *object = place_of(comparing, layer);
    if (object && bd_cli_compare_json(object, &comparing->files, layer, pictures, metrics))
        return BD_ERR_OK;
    return no_memory(detail);
}

// Puts file and layer before what is wrong with the reference's pixels.
static enum bd_err measure(const struct bd_cli_compare *asked, const char *layer,
                           const struct bd_cli_compare_layer *pictures, struct bd_metrics *metrics,
                           struct bd_err_detail *detail)
{
    struct bd_err_detail inner = {0};
    enum bd_err err = bd_metrics_measure(&pictures->input, metrics, &inner);
    if (!err) return BD_ERR_OK;
    return bd_err_set(detail, err, inner.field, "%.150s, layer %s: %s", asked->reference, layer,
                      inner.message);
}

static enum bd_err compare_layer(struct comparing *comparing, const char *layer,
                                 struct bd_err_detail *detail)
{
    struct bd_cli_compare_layer pictures;
    struct bd_metrics metrics;
    const struct bd_cli_compare *asked = comparing->asked;
    enum bd_err err = bd_cli_compare_layer_open(asked, &comparing->files, layer, &pictures, detail);
    if (!err) err = measure(asked, layer, &pictures, &metrics, detail);
    if (!err) err = bd_cli_tolerances_check(asked, layer, &metrics, tell_miss, comparing, detail);
    if (!err && asked->map) err = write_map(asked, &pictures, &metrics, detail);
    if (!err) err = say(comparing, layer, &pictures, &metrics, detail);
    bd_cli_compare_layer_close(&pictures);
    return err;
}

static enum bd_err open_report(struct comparing *comparing, struct bd_err_detail *detail)
{
    const struct bd_cli_compare *asked = comparing->asked;
    if (!asked->json) return BD_ERR_OK;
    comparing->report = json_pack("{s:s, s:s, s:[], s:[]}", "reference", asked->reference, "image",
                                  asked->image, "notes", "missed");
    comparing->missed = json_object_get(comparing->report, "missed");
    if (!comparing->report) return no_memory(detail);
    if (asked->layer_count > 1 && json_object_set_new(comparing->report, "layers", json_object()))
        return no_memory(detail);
    json_t *notes = json_object_get(comparing->report, "notes");
    for (uint32_t i = 0; i < comparing->files.note_count; i++)
        if (json_array_append_new(notes, json_string(comparing->files.notes[i])))
            return no_memory(detail);
    return BD_ERR_OK;
}

static enum bd_err compare_all(struct comparing *comparing, struct bd_err_detail *detail)
{
    const struct bd_cli_compare *asked = comparing->asked;
    enum bd_err err = asked->map ? bd_cli_output_check(asked->map, detail) : BD_ERR_OK;
    if (!err) err = bd_cli_compare_open(asked, &comparing->files, detail);
    for (uint32_t i = 0; !err && !asked->quiet && i < comparing->files.note_count; i++)
        bd_cli_print_line(stderr, "bounce: note: %s", comparing->files.notes[i]);
    if (!err) err = open_report(comparing, detail);
    for (uint32_t i = 0; !err && i < asked->layer_count; i++)
        err = compare_layer(comparing, asked->layers[i], detail);
    if (!err && comparing->report &&
        !bd_cli_print_json_line(stdout, comparing->report, JSON_INDENT(2) | JSON_REAL_PRECISION(9)))
        err = bd_err_set(detail, BD_ERR_NO_MEMORY, "", "no memory for the report");
    return err;
}

int bd_cmd_compare(const char *const *words, int count)
{
    struct bd_cli_compare asked;
    struct bd_err_detail detail = {0};
    enum bd_err err = bd_cli_parse_compare(words, count, &asked, &detail);
    if (!err && asked.help) return bd_help_compare();
    // Nothing here waits for a daemon that would have to be told: Ctrl-C simply ends it.
    signal(SIGINT, SIG_DFL);
    signal(SIGTERM, SIG_DFL);
    struct comparing comparing = {.asked = &asked};
    if (!err) err = compare_all(&comparing, &detail);
    bd_cli_compare_close(&comparing.files);
    json_decref(comparing.report);
    if (err) return bd_cmd_fail(err, &detail, asked.json);
    return comparing.misses ? bd_err_exit_code(BD_ERR_DIFFERS) : 0;
}
