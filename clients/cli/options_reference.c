// The command line of `bounce reference`.

#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "base/assert.h"
#include "clients/cli/options_common.h"
#include "clients/cli/reference_file.h"

#define SPP_MAX            (1u << 24)
#define TIME_LIMIT_MAX_S   31536000.0
#define SPP_STANDARD       64

enum {
    OPT_OUTPUT = BD_CLI_OPT_OWN,
    OPT_SPP,
    OPT_PARAMETER, // the first that is a parameter of the technique
    OPT_PARAMETER_LAST = OPT_PARAMETER + 6,
    OPT_TIME_LIMIT,
    OPT_ENVIRONMENT,
    OPT_FILTER_NOISE,
    OPT_FORCE,
    OPT_REPORT,
};

static const struct bd_cli_option own_table[] = {
    BD_CLI_COMMON_OPTIONS,
    {"output", 'o', true, OPT_OUTPUT},
    {"spp", 0, true, OPT_SPP},
    {"bounces", 0, true, OPT_PARAMETER},
    {"indirect_visibility", 0, true, OPT_PARAMETER + 1},
    {"lights", 0, true, OPT_PARAMETER + 2},
    {"filter", 0, true, OPT_PARAMETER + 3},
    {"alpha", 0, true, OPT_PARAMETER + 4},
    {"clamp", 0, true, OPT_PARAMETER + 5},
    {"model_of", 0, true, OPT_PARAMETER_LAST},
    {"time-limit", 0, true, OPT_TIME_LIMIT},
    {"environment", 0, true, OPT_ENVIRONMENT},
    {"filter-noise", 0, false, OPT_FILTER_NOISE},
    {"force", 0, false, OPT_FORCE},
    {"report", 0, true, OPT_REPORT},
    {0},
};

static enum bd_err usage(struct bd_err_detail *detail, const char *option, const char *message)
{
    return bd_err_set(detail, BD_ERR_USAGE, option, "%s", message);
}

static enum bd_err parse_spp(const char *text, struct bd_cli_reference *out,
                             struct bd_err_detail *detail)
{
    uint64_t spp = 0;
    enum bd_err err = bd_cli_uint("spp", text, 2, SPP_MAX, &spp, detail);
    if (!err && spp % 2)
        err = bd_err_set(detail, BD_ERR_USAGE, "spp",
                         "--spp %.40s: even, since two halves share them", text);
    out->spp = (uint32_t)spp;
    out->has_spp = true;
    return err;
}

// --clamp 5 as --set clamp=5.
static enum bd_err set_parameter(int id, const char *value, struct bd_cli_reference *out,
                                 struct bd_err_detail *detail)
{
    const struct bd_cli_option *option = own_table;
    char pair[256];
    while (option->id != id) option++;
    if ((size_t)snprintf(pair, sizeof pair, "%s=%s", option->name, value) >= sizeof pair)
        return bd_err_set(detail, BD_ERR_USAGE, option->name, "--%s %.60s: too long", option->name,
                          value);
    return bd_cli_set_frame_option("parameters", pair, out->frame, detail);
}

static enum bd_err parse_option(int id, const char *value, struct bd_cli_reference *out,
                                struct bd_err_detail *detail)
{
    if (id >= OPT_PARAMETER && id <= OPT_PARAMETER_LAST)
        return set_parameter(id, value, out, detail);
    if (bd_cli_is_frame_option(id)) return bd_cli_parse_frame_option(id, value, out->frame, detail);
    switch (id) {
    case OPT_OUTPUT: out->output = value; return BD_ERR_OK;
    case OPT_SPP:
        return parse_spp(value, out, detail);
    case OPT_TIME_LIMIT:
        return bd_cli_number("time-limit", value, 0.001, TIME_LIMIT_MAX_S, &out->time_limit_s,
                             detail);
    case OPT_ENVIRONMENT: out->environment = value; return BD_ERR_OK;
    case OPT_FILTER_NOISE: out->filter_noise = true; return BD_ERR_OK;
    case OPT_FORCE: out->force = true; return BD_ERR_OK;
    case OPT_REPORT: out->report = value; return BD_ERR_OK;
    default: break;
    }
    BD_ASSERT(!"an option of the table that nobody decodes");
    return BD_ERR_INTERNAL;
}

static enum bd_err check(struct bd_cli_reference *out, struct bd_err_detail *detail)
{
    if (!out->scene) return usage(detail, "scene", "no SCENE: a .glb or .gltf file, or scene:ID");
    if (!out->output) return usage(detail, "output", "no -o FILE.exr");
    const char *dot = strrchr(out->output, '.');
    if (!dot || strcasecmp(dot, ".exr") != 0)
        return bd_err_set(detail, BD_ERR_USAGE, "output",
                          "-o %.200s: the name must end in .exr, which holds the halves and "
                          "variances; bounce render --technique reference makes pictures",
                          out->output);
    for (size_t i = 0; i < out->frame->n_parameters; i++) { // what the command itself decides
        const char *key = out->frame->parameters[i]->key;
        const char *instead = bd_cli_reference_file_decides(key);
        if (instead)
            return bd_err_set(detail, BD_ERR_USAGE, "parameters", "--set %.60s: %s", key, instead);
    }
    // With a time limit alone: as many as fit.
    if (!out->has_spp) out->spp = out->time_limit_s > 0 ? SPP_MAX : SPP_STANDARD;
    return bd_cli_check_common(&out->common, detail);
}

enum bd_err bd_cli_parse_reference(const char *const *words, int count,
                                   struct bd_cli_reference *out, struct bd_err_detail *detail)
{
    *out = (struct bd_cli_reference){.frame = bd_cli_frame_new()};
    struct bd_cli_option table[BD_CLI_TABLE_MAX];
    bd_cli_table_of(own_table, bd_cli_of_reference, table);
    struct bd_cli_args args = {.words = words, .count = count};
    const char *value;
    int id;
    while ((id = bd_cli_next(&args, table, &value, detail)) != BD_CLI_END) {
        if (id == BD_CLI_ERROR) return BD_ERR_USAGE;
        if (id == BD_CLI_OPERAND) {
            if (out->scene)
                return bd_err_set(detail, BD_ERR_USAGE, "scene",
                                  "one SCENE at a time: %.100s is a second", value);
            out->scene = value;
            continue;
        }
        if (bd_cli_parse_common(id, value, &out->common, &out->help)) continue;
        enum bd_err err = parse_option(id, value, out, detail);
        if (err) return err;
    }
    return out->help ? BD_ERR_OK : check(out, detail);
}
