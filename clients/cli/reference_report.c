#include "clients/cli/reference_report.h"

#include <inttypes.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "clients/cli/report.h"

static const char *or_none(const char *text)
{
    return text ? text : "";
}

// --- the sum --------------------------------------------------------------------------------

static enum bd_err copy(const Bounced__Report *report, Bounced__Report **out,
                        struct bd_err_detail *detail)
{
    size_t size = bounced__report__get_packed_size(report);
    uint8_t *packed = malloc(size ? size : 1);
    if (packed) bounced__report__pack(report, packed);
    *out = packed ? bounced__report__unpack(NULL, size, packed) : NULL;
    free(packed);
    return *out ? BD_ERR_OK
                : bd_err_set(detail, BD_ERR_NO_MEMORY, "report", "no memory for a report");
}

void bd_cli_reference_report_finish(struct bd_cli_reference_report *report)
{
    if (report->sum) bounced__report__free_unpacked(report->sum, NULL);
    report->sum = NULL;
}

enum bd_err bd_cli_reference_report_begin(struct bd_cli_reference_report *report,
                                          const Bounced__Report *plan, struct bd_err_detail *detail)
{
    return copy(plan, &report->sum, detail);
}

static const Bounced__ReportPass *find_pass(const Bounced__Report *report, const char *name)
{
    for (size_t i = 0; i < report->n_passes; i++)
        if (strcmp(or_none(report->passes[i]->name), name) == 0) return report->passes[i];
    return NULL;
}

double bd_cli_reference_report_pass_ms(const Bounced__Report *report, const char *pass)
{
    const Bounced__ReportPass *found = find_pass(report, pass);
    return found && strcmp(or_none(found->state), "ran") == 0 ? found->ms : 0;
}

// What ran for one piece and was reused for others ran.
static void add_passes(Bounced__Report *piece, const Bounced__Report *before)
{
    for (size_t i = 0; i < piece->n_passes; i++) {
        Bounced__ReportPass *pass = piece->passes[i];
        const Bounced__ReportPass *earlier = find_pass(before, or_none(pass->name));
        if (!earlier || strcmp(or_none(earlier->state), "ran") != 0) continue;
        pass->ms += earlier->ms;
        free(pass->state);
        pass->state = strdup("ran");
        BD_ASSERT(pass->state);
    }
}

static void add_times(Bounced__ReportTime *time, const Bounced__ReportTime *before)
{
    if (!time || !before) return;
    time->total += before->total;
    time->load += before->load;
    time->encode += before->encode;
}

static bool has_flag(const Bounced__Report *report, const char *flag)
{
    for (size_t i = 0; i < report->n_flags; i++)
        if (strcmp(report->flags[i], flag) == 0) return true;
    return false;
}

static void add_flags(Bounced__Report *piece, const Bounced__Report *before)
{
    for (size_t i = 0; i < before->n_flags; i++) {
        if (has_flag(piece, before->flags[i])) continue;
        char **grown = realloc(piece->flags, (piece->n_flags + 1) * sizeof *grown);
        char *flag = strdup(before->flags[i]);
        BD_ASSERT(grown && flag);
        piece->flags = grown;
        grown[piece->n_flags++] = flag;
    }
}

enum bd_err bd_cli_reference_report_add(struct bd_cli_reference_report *report,
                                        const Bounced__Report *piece, struct bd_err_detail *detail)
{
    Bounced__Report *sum = NULL;
    enum bd_err err = copy(piece, &sum, detail);
    if (err) return err;
    add_passes(sum, report->sum);
    add_times(sum->time_ms, report->sum->time_ms);
    add_flags(sum, report->sum);
    bd_cli_reference_report_finish(report);
    report->sum = sum;
    return BD_ERR_OK;
}

static void replace(char **text, const char *value)
{
    free(*text);
    *text = strdup(value);
    BD_ASSERT(*text);
}

char *bd_cli_reference_report_json(struct bd_cli_reference_report *report,
                                   const struct bd_cli_reference_file *file, const char *stopped)
{
    Bounced__Report *sum = report->sum;
    for (size_t i = 0; i < sum->n_parameters; i++) {
        char text[BD_CLI_OWN_MAX];
        if (bd_cli_reference_file_own(file, or_none(sum->parameters[i]->key), text))
            replace(&sum->parameters[i]->value, text);
    }
    sum->has_exposure_stops = 0; // a picture's, not the file's
    replace(&sum->stopped, stopped);
    return bd_cli_report_json(&sum->base);
}

// --- whether a file goes with a plan --------------------------------------------------------

static void join_parameters(const Bounced__Report *plan, char *out, size_t size)
{
    size_t used = 0;
    out[0] = 0;
    for (size_t i = 0; i < plan->n_parameters && used < size; i++) {
        const Bounced__KeyValue *pair = plan->parameters[i];
        if (bd_cli_reference_file_decides(or_none(pair->key))) continue;
        used += (size_t)snprintf(out + used, size - used, "%s%s=%s", used ? " " : "",
                                 or_none(pair->key), or_none(pair->value));
    }
}

static enum bd_err differs(const char *path, const char *what, const char *has, const char *wanted,
                           struct bd_err_detail *detail)
{
    return bd_err_set(detail, BD_ERR_USAGE, what,
                      "%.100s was made with another %s (%.120s, not %.120s); another -o, or "
                      "--force to start anew",
                      path, what, *has ? has : "none", *wanted ? wanted : "none");
}

static enum bd_err match_size(const Bounced__Report *plan, const struct bd_cli_reference_file *file,
                              const char *path, struct bd_err_detail *detail)
{
    uint32_t width_px, height_px;
    char has[32], wanted[32];
    bd_cli_reference_file_size(file, &width_px, &height_px);
    snprintf(has, sizeof has, "%" PRIu32 "x%" PRIu32, width_px, height_px);
    snprintf(wanted, sizeof wanted, "%" PRIu32 "x%" PRIu32, plan->n_size == 2 ? plan->size[0] : 0,
             plan->n_size == 2 ? plan->size[1] : 0);
    return strcmp(has, wanted) == 0 ? BD_ERR_OK : differs(path, "size", has, wanted, detail);
}

enum bd_err bd_cli_reference_report_match(const Bounced__Report *plan, const uint32_t region[4],
                                          const struct bd_cli_reference_file *file,
                                          const char *path, struct bd_err_detail *detail)
{
    char seed[24], area[48] = "", parameters[2048];
    snprintf(seed, sizeof seed, "%" PRIu64, plan->seed);
    if (region[2])
        snprintf(area, sizeof area, "%" PRIu32 ",%" PRIu32 ",%" PRIu32 ",%" PRIu32, region[0],
                 region[1], region[2], region[3]);
    join_parameters(plan, parameters, sizeof parameters);
    const struct {
        const char *key, *wanted;
    } pairs[] = {{"technique", "reference"},
                 {"scene", or_none(plan->scene)},
                 {"camera", or_none(plan->camera)},
                 {"parameters", parameters},
                 {"seed", seed},
                 {"region", area},
                 {"build", or_none(plan->build)}};
    enum bd_err err = match_size(plan, file, path, detail);
    for (size_t i = 0; !err && i < sizeof pairs / sizeof pairs[0]; i++) {
        const char *has = bd_cli_reference_file_says(file, pairs[i].key);
        if (strcmp(has, pairs[i].wanted) != 0)
            err = differs(path, pairs[i].key, has, pairs[i].wanted, detail);
    }
    return err;
}
