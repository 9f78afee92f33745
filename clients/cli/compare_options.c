// `bounce compare`: its command line.

#include <stdio.h>
#include <string.h>

#include "base/assert.h"
#include "clients/cli/args.h"
#include "clients/cli/compare.h"

enum {
    OPT_HELP = 1,
    OPT_JSON,
    OPT_QUIET,
    OPT_HALF,
    OPT_LAYER,
    OPT_MAP,
    OPT_TOLERANCE,
    OPT_PPD,
    OPT_IGNORE,
};

static const struct bd_cli_option table[] = {
    {"help", 'h', false, OPT_HELP},        {"json", 0, false, OPT_JSON},
    {"quiet", 'q', false, OPT_QUIET},      {"half", 0, true, OPT_HALF},
    {"layer", 0, true, OPT_LAYER},         {"map", 0, true, OPT_MAP},
    {"tolerance", 0, true, OPT_TOLERANCE}, {"ppd", 0, true, OPT_PPD},
    {"ignore", 0, true, OPT_IGNORE},       {0},
};

static enum bd_err no_such_metric(const char *text, struct bd_err_detail *detail)
{
    char names[400] = "";
    size_t used = 0;
    for (int i = 0; i < BD_METRIC_COUNT && used < sizeof names; i++)
        if (bd_metric_goal((enum bd_metric)i) != BD_GOAL_NONE)
            used += (size_t)snprintf(names + used, sizeof names - used, " %s",
                                     bd_metric_name((enum bd_metric)i));
    return bd_err_set(detail, BD_ERR_USAGE, "tolerance",
                      "--tolerance %.40s: no such figure; there are:%s", text, names);
}

// The end of the interval that is worse: low where more is better.
static const char *worse_end(enum bd_metric metric)
{
    return bd_metric_goal(metric) == BD_GOAL_MORE ? "low" : "high";
}

static enum bd_err decode_tolerance(const char *text, struct bd_cli_tolerance *out,
                                    struct bd_err_detail *detail)
{
    size_t length = strcspn(text, "=");
    char name[32];
    if (!text[length] || length >= sizeof name)
        return bd_err_set(detail, BD_ERR_USAGE, "tolerance",
                          "--tolerance %.60s: NAME=VALUE, such as rel_rmse=0.02", text);
    snprintf(name, sizeof name, "%.*s", (int)length, text);
    char *end = strchr(name, '.');
    if (end) *end++ = 0;
    if (!bd_metric_from_name(name, &out->metric) || bd_metric_goal(out->metric) == BD_GOAL_NONE)
        return no_such_metric(text, detail);
    if (end && strcmp(end, worse_end(out->metric)) != 0)
        return bd_err_set(detail, BD_ERR_USAGE, "tolerance",
                          "--tolerance %.60s: the worse end of its interval is %s.%s", text, name,
                          worse_end(out->metric));
    out->text = text;
    out->at_end = end != NULL;
    return bd_cli_number("tolerance", text + length + 1, -1e30, 1e30, &out->limit, detail);
}

static enum bd_err add_tolerance(const char *text, struct bd_cli_compare *out,
                                 struct bd_err_detail *detail)
{
    if (out->tolerance_count == BD_CLI_COMPARE_TOLERANCE_MAX)
        return bd_err_set(detail, BD_ERR_USAGE, "tolerance", "--tolerance: at most %d times",
                          BD_CLI_COMPARE_TOLERANCE_MAX);
    return decode_tolerance(text, &out->tolerances[out->tolerance_count++], detail);
}

static enum bd_err add_layer(const char *name, struct bd_cli_compare *out,
                             struct bd_err_detail *detail)
{
    if (!*name || strlen(name) > 40)
        return bd_err_set(detail, BD_ERR_USAGE, "layer",
                          "--layer %.60s: one name of 1 to 40 characters, such as direct", name);
    for (uint32_t i = 0; i < out->layer_count; i++)
        if (strcmp(out->layers[i], name) == 0) return BD_ERR_OK;
    if (out->layer_count == BD_CLI_COMPARE_LAYER_MAX)
        return bd_err_set(detail, BD_ERR_USAGE, "layer", "--layer: at most %d",
                          BD_CLI_COMPARE_LAYER_MAX);
    out->layers[out->layer_count++] = name;
    return BD_ERR_OK;
}

static enum bd_err parse_ignore(const char *value, struct bd_cli_compare *out,
                                struct bd_err_detail *detail)
{
    out->ignore_filter = true;
    if (strcmp(value, "filter") == 0) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_USAGE, "ignore", "--ignore %.40s: only filter", value);
}

static enum bd_err parse_option(int id, const char *value, struct bd_cli_compare *out,
                                struct bd_err_detail *detail)
{
    switch (id) {
    case OPT_HELP:
        out->help = true;
        return BD_ERR_OK;
    case OPT_JSON:
        out->json = true;
        return BD_ERR_OK;
    case OPT_QUIET:
        out->quiet = true;
        return BD_ERR_OK;
    case OPT_HALF:
        out->half = value;
        return BD_ERR_OK;
    case OPT_LAYER:
        return add_layer(value, out, detail);
    case OPT_MAP:
        out->map = value;
        return BD_ERR_OK;
    case OPT_TOLERANCE:
        return add_tolerance(value, out, detail);
    case OPT_PPD:
        return bd_cli_number("ppd", value, BD_FLIP_PPD_MIN, BD_FLIP_PPD_MAX, &out->ppd, detail);
    case OPT_IGNORE:
        return parse_ignore(value, out, detail);
    default:
        break;
    }
    BD_ASSERT(!"an option of the table that nobody decodes");
    return BD_ERR_INTERNAL;
}

static enum bd_err add_operand(const char *word, struct bd_cli_compare *out,
                               struct bd_err_detail *detail)
{
    const char **place = !out->reference ? &out->reference : &out->image;
    if (*place)
        return bd_err_set(detail, BD_ERR_USAGE, "image",
                          "%.100s: compare takes one REFERENCE and one IMAGE", word);
    *place = word;
    return BD_ERR_OK;
}

static enum bd_err check(struct bd_cli_compare *out, struct bd_err_detail *detail)
{
    const char *dot = out->map ? strrchr(out->map, '.') : NULL;
    if (!out->reference || !out->image)
        return bd_err_set(detail, BD_ERR_USAGE, out->reference ? "image" : "reference",
                          "usage: bounce compare REFERENCE IMAGE (bounce compare --help)");
    if (out->map && strcmp(out->map, "-") != 0 && (!dot || strcmp(dot, ".png") != 0))
        return bd_err_set(detail, BD_ERR_USAGE, "map", "--map %.100s: a file.png", out->map);
    if (out->map && out->layer_count > 1)
        return bd_err_set(detail, BD_ERR_USAGE, "map", "--map shows one layer, not %u",
                          out->layer_count);
    if (out->map && strcmp(out->map, "-") == 0)
        return bd_err_set(detail, BD_ERR_USAGE, "map",
                          "--map -: standard output has the figures; name a file");
    return BD_ERR_OK;
}

enum bd_err bd_cli_parse_compare(const char *const *words, int count, struct bd_cli_compare *out,
                                 struct bd_err_detail *detail)
{
    struct bd_cli_args args = {.words = words, .count = count};
    *out = (struct bd_cli_compare){.ppd = BD_FLIP_PPD_DEFAULT};
    // First, so that an error in what stands before it is an object too.
    for (int i = 0; i < count; i++)
        if (strcmp(words[i], "--json") == 0) out->json = true;
    const char *value;
    int id;
    while ((id = bd_cli_next(&args, table, &value, detail)) != BD_CLI_END) {
        if (id == BD_CLI_ERROR) return BD_ERR_USAGE;
        enum bd_err err = id == BD_CLI_OPERAND ? add_operand(value, out, detail)
                                               : parse_option(id, value, out, detail);
        if (err) return err;
    }
    if (out->help) return BD_ERR_OK;
    if (!out->layer_count) out->layers[out->layer_count++] = "beauty";
    return check(out, detail);
}
