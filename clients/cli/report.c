#include "clients/cli/report.h"

#include <inttypes.h>
#include <jansson.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "base/text.h"
#include "clients/cli/print.h"
#include "protocol/json.h"

char *bd_cli_report_json(const ProtobufCMessage *message)
{
    json_t *json = bd_json_from_message(message);
    if (!json) return NULL;
    char *text = bd_text_escape_json(json_dumps(json, JSON_INDENT(2)));
    json_decref(json);
    char *line = text ? realloc(text, strlen(text) + 2) : NULL;
    if (!line) free(text);
    return line ? strcat(line, "\n") : NULL;
}

static const char *or_none(const char *text)
{
    return text ? text : "";
}

static bool is_plan(const Bounced__Report *report)
{
    for (size_t i = 0; i < report->n_passes; i++)
        if (strcmp(or_none(report->passes[i]->state), "planned") == 0) return true;
    return false;
}

static void print_heading(const Bounced__Report *report, FILE *out)
{
    bd_cli_print(out, "%s", or_none(report->technique));
    if (report->n_size == 2)
        fprintf(out, " %" PRIu32 "x%" PRIu32, report->size[0], report->size[1]);
    if (report->camera && report->camera[0]) bd_cli_print(out, ", camera %s", report->camera);
    if (report->has_aa) fprintf(out, ", aa %" PRIu32, report->aa);
    if (report->counts)
        fprintf(out, ", %" PRIu64 " lights, %" PRIu64 " vpls, %" PRIu64 " triangles",
                report->counts->lights, report->counts->vpls, report->counts->triangles);
    if (report->has_exposure_stops) fprintf(out, ", %+.2f stops", report->exposure_stops);
    fputc('\n', out);
    if (report->device)
        bd_cli_print_line(out, "on %s%s", or_none(report->device->name),
                          report->device->software ? " (software)" : "");
}

static void print_passes(const Bounced__Report *report, FILE *out)
{
    for (size_t i = 0; i < report->n_passes; i++) {
        const Bounced__ReportPass *pass = report->passes[i];
        if (strcmp(or_none(pass->state), "ran") == 0 && report->aa > 1 && pass->sub_frames > 0)
            bd_cli_print_line(out, "  %-17s %9.2f ms, %u of %u sub-frames", or_none(pass->name),
                              pass->ms, pass->sub_frames, report->aa);
        else if (strcmp(or_none(pass->state), "ran") == 0)
            bd_cli_print_line(out, "  %-17s %9.2f ms", or_none(pass->name), pass->ms);
        else
            bd_cli_print_line(out, "  %-17s %9s", or_none(pass->name), or_none(pass->state));
    }
    // What a frame left out stands in its report; who asks for a plan wants to see it.
    for (size_t i = 0; is_plan(report) && i < report->n_omitted; i++)
        bd_cli_print_line(out, "  %-17s   omitted: %s", or_none(report->omitted[i]->pass),
                          or_none(report->omitted[i]->reason));
}

static void print_time(const Bounced__ReportTime *time, FILE *out)
{
    fprintf(out, "%.0f ms: load %.0f, compile %.0f, gpu %.0f, readback %.0f, encode %.0f",
            time->total, time->load, time->compile, time->gpu, time->readback, time->encode);
    if (time->check > 0) fprintf(out, ", check %.0f", time->check);
    fputc('\n', out);
}

static void print_error(const Bounced__ReportError *error, FILE *out)
{
    // Nothing is a part of black: there it is radiance.
    bool relative = strcmp(or_none(error->metric), "rmse") != 0;
    const char *unit = relative ? "%" : "cd/m^2", *truth = relative ? "" : ", which is black";
    double scale = relative ? 100 : 1, low = scale * error->low, high = scale * error->high;
    fprintf(out, "error %.3g %s", scale * error->value, unit);
    if (isfinite(high))
        fprintf(out, " (%.3g - %.3g %s)", low, high, unit);
    else
        fprintf(out, " (%.3g %s or more: a few pixels carry it)", low, unit);
    bd_cli_print_line(out, " against %s%s, %" PRIu64 " pixels", or_none(error->against), truth,
                      error->samples);
}

void bd_cli_report_print(const Bounced__Report *report, FILE *out)
{
    print_heading(report, out);
    print_passes(report, out);
    if (report->time_ms && !is_plan(report)) print_time(report->time_ms, out);
    if (report->has_own_estimate)
        fprintf(out, "%.3g %% off by its own estimate, %.3g %% of what a picture shows\n",
                100 * report->own_estimate, 100 * report->shown_estimate);
    for (size_t i = 0; i < report->n_error; i++) print_error(report->error[i], out);
    if (report->nonfinite_pixels)
        fprintf(out, "%" PRIu64 " pixels are not finite\n", report->nonfinite_pixels);
    if (report->stopped && strcmp(report->stopped, "complete") != 0)
        bd_cli_print_line(out, "stopped: %s", report->stopped);
}

void bd_cli_report_print_flags(const Bounced__Report *report, FILE *out)
{
    for (size_t i = 0; i < report->n_flags; i++)
        bd_cli_print_line(out, "bounce: flag: %s", report->flags[i]);
}
