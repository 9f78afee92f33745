// `bounce compare`: its answer, in words and as JSON.

#include <math.h>
#include <stdio.h>

#include "clients/cli/compare.h"
#include "clients/cli/print.h"

static const char *debiased(const struct bd_metrics *metrics)
{
    if (metrics->reference_debiased && metrics->image_debiased) return "both";
    if (metrics->reference_debiased) return "reference";
    return metrics->image_debiased ? "image" : "none";
}

static const char *debiased_in_words(const struct bd_metrics *metrics)
{
    if (metrics->reference_debiased && metrics->image_debiased)
        return "without the noise of either";
    if (metrics->reference_debiased) return "without the reference's noise";
    if (metrics->image_debiased)
        return "without the image's noise; the reference has no halves, so its noise counts";
    return "not debiased: the reference has no halves, so its noise counts as error";
}

static void print_figure(const struct bd_metrics *metrics, enum bd_metric metric)
{
    const struct bd_figure *figure = &metrics->figures[metric];
    if (metrics->states[metric] == BD_METRIC_ABSENT) return;
    printf("  %-16s %11.5g", bd_metric_name(metric), figure->value);
    if (metrics->states[metric] == BD_METRIC_WITH_INTERVAL)
        printf(" %11.5g .. %-11.5g", figure->low, figure->high);
    else
        printf(" %26s", "");
    printf("  %s\n", bd_metric_what(metric));
}

void bd_cli_compare_print(const struct bd_cli_compare *compare,
                          const struct bd_cli_compare_files *files, const char *layer,
                          const struct bd_cli_compare_layer *pictures,
                          const struct bd_metrics *metrics)
{
    const struct bd_image *image = pictures->input.image[0];
    bd_cli_print(stdout, "%s of %s against %s, %ux%u", layer, compare->image, compare->reference,
                 image->width_px, image->height_px);
    if (files->region.width_px != files->image->width_px ||
        files->region.height_px != files->image->height_px)
        printf(" at %u,%u", files->region.x_px, files->region.y_px);
    putchar('\n');
    printf("  %s; 95 %% intervals over %zu tiles of %ux%u pixels\n", debiased_in_words(metrics),
           bd_tiles_count(&metrics->tiles), metrics->tiles.tile_px, metrics->tiles.tile_px);
    for (int i = 0; i < BD_METRIC_COUNT; i++) print_figure(metrics, (enum bd_metric)i);
}

// JSON has no infinity: null stands for what cannot be said.
static json_t *number(double value)
{
    return isfinite(value) ? json_real(value) : json_null();
}

static json_t *figure_json(const struct bd_metrics *metrics, enum bd_metric metric)
{
    const struct bd_figure *figure = &metrics->figures[metric];
    enum bd_metric_state state = metrics->states[metric];
    bool interval = state == BD_METRIC_WITH_INTERVAL;
    return json_pack("{s:o, s:o, s:o}", "value",
                     state == BD_METRIC_ABSENT ? json_null() : number(figure->value), "low",
                     interval ? number(figure->low) : json_null(), "high",
                     interval ? number(figure->high) : json_null());
}

bool bd_cli_compare_json(json_t *object, const struct bd_cli_compare_files *files,
                         const char *layer, const struct bd_cli_compare_layer *pictures,
                         const struct bd_metrics *metrics)
{
    const struct bd_image *image = pictures->input.image[0];
    json_t *head = json_pack(
        "{s:s, s:[i,i], s:[i,i], s:s, s:I, s:I, s:i, s:o, s:[o,o]}", "layer", layer, "size",
        (int)image->width_px, (int)image->height_px, "at", (int)files->region.x_px,
        (int)files->region.y_px, "debiased", debiased(metrics), "pixels",
        (json_int_t)metrics->pixel_count, "tiles", (json_int_t)bd_tiles_count(&metrics->tiles),
        "tile_px", (int)metrics->tiles.tile_px, "display_stops", number(metrics->display_stops),
        "hdr_flip_stops", number(metrics->hdr_exposures.start),
        number(metrics->hdr_exposures.stop));
    bool filled = head && json_object_update(object, head) == 0;
    json_decref(head);
    for (int i = 0; filled && i < BD_METRIC_COUNT; i++)
        filled = json_object_set_new(object, bd_metric_name((enum bd_metric)i),
                                     figure_json(metrics, (enum bd_metric)i)) == 0;
    return filled;
}
