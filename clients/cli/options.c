#include "clients/cli/options.h"

#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "base/assert.h"
#include "clients/cli/args.h"
#include "clients/cli/options_common.h"

// The limits of the server are tighter; these are what the fields can say.
#define SIDE_PX_MAX 32768u
#define AA_MAX      64u

#define CHECK_PIXELS_MIN 16u
#define CHECK_PIXELS_MAX 65536u
#define TARGET_ERROR_MIN 1e-6 // per cent
#define TARGET_ERROR_MAX 1e4

enum {
    OPT_OUTPUT = BD_CLI_OPT_OWN,
    OPT_SIZE,
    OPT_CAMERA,
    OPT_TECHNIQUE,
    OPT_SET,
    OPT_AA,
    OPT_LAYERS,
    OPT_EXPOSURE,
    OPT_TONEMAP,
    OPT_SEED,
    OPT_DEADLINE,
    OPT_CHECK,
    OPT_TARGET_ERROR,
    OPT_PLAN,
    OPT_REPORT,
    OPT_FRESH,
    OPT_REGION,
    OPT_ENVIRONMENT,
};

static const struct bd_cli_option plain_table[] = {BD_CLI_COMMON_OPTIONS, {0}};

static const struct bd_cli_option render_table[] = {
    BD_CLI_COMMON_OPTIONS,
    {"output", 'o', true, OPT_OUTPUT},
    {"size", 0, true, OPT_SIZE},
    {"camera", 0, true, OPT_CAMERA},
    {"technique", 0, true, OPT_TECHNIQUE},
    {"set", 0, true, OPT_SET},
    {"aa", 0, true, OPT_AA},
    {"layers", 0, true, OPT_LAYERS},
    {"exposure", 0, true, OPT_EXPOSURE},
    {"tonemap", 0, true, OPT_TONEMAP},
    {"seed", 0, true, OPT_SEED},
    {"deadline-ms", 0, true, OPT_DEADLINE},
    {"check", 0, true, OPT_CHECK},
    {"target-error", 0, true, OPT_TARGET_ERROR},
    {"plan", 0, false, OPT_PLAN},
    {"report", 0, true, OPT_REPORT},
    {"fresh", 0, true, OPT_FRESH},
    {"region", 0, true, OPT_REGION},
    {"environment", 0, true, OPT_ENVIRONMENT},
    {0},
};

const char *bd_cli_format_name(enum bd_cli_format format)
{
    switch (format) {
    case BD_CLI_NONE:
        return "none";
    case BD_CLI_PNG:
        return "png";
    case BD_CLI_JPEG:
        return "jpeg";
    case BD_CLI_EXR:
        return "exr";
    }
    BD_ASSERT(!"no such format");
    return NULL;
}

static enum bd_err usage(struct bd_fault *fault, const char *option, const char *message)
{
    return bd_fault_set(fault, BD_ERR_USAGE, option, "%s", message);
}

// True if `id` is one of the common options, which is then stored.
bool bd_cli_parse_common(int id, const char *value, struct bd_cli_common *out, bool *help)
{
    switch (id) {
    case BD_CLI_OPT_HELP:
        *help = true;
        return true;
    case BD_CLI_OPT_SERVER:
        out->server = value;
        return true;
    case BD_CLI_OPT_TOKEN_FILE:
        out->token_file = value;
        return true;
    case BD_CLI_OPT_DEVICE:
        out->device = value;
        return true;
    case BD_CLI_OPT_JSON:
        out->json = true;
        return true;
    case BD_CLI_OPT_QUIET:
        out->quiet = true;
        return true;
    default:
        return false;
    }
}

enum bd_err bd_cli_check_common(const struct bd_cli_common *common, struct bd_fault *fault)
{
    if (common->server && common->device)
        return usage(fault, "device",
                     "--device chooses the device of a private daemon; a running one (--server) "
                     "has chosen");
    return BD_ERR_OK;
}

enum bd_err bd_cli_parse_size(const char *text, uint32_t *width_px, uint32_t *height_px,
                              struct bd_fault *fault)
{
    unsigned width = 0, height = 0;
    char rest = 0;
    bool digits = strspn(text, "0123456789x") == strlen(text) && strlen(text) < 16;
    if (!digits || sscanf(text, "%ux%u%c", &width, &height, &rest) != 2 || width < 1 ||
        height < 1 || width > SIDE_PX_MAX || height > SIDE_PX_MAX)
        return bd_fault_set(fault, BD_ERR_USAGE, "size",
                            "--size %.40s: WxH in pixels, each from 1 to %u", text, SIDE_PX_MAX);
    *width_px = width;
    *height_px = height;
    return BD_ERR_OK;
}

enum bd_err bd_cli_parse_region(const char *text, uint32_t out[4], struct bd_fault *fault)
{
    char rest = 0;
    bool digits = strspn(text, "0123456789,") == strlen(text) && strlen(text) < 28;
    if (digits && sscanf(text, "%u,%u,%u,%u%c", &out[0], &out[1], &out[2], &out[3], &rest) == 4 &&
        out[2] >= 1 && out[3] >= 1)
        return BD_ERR_OK;
    return bd_fault_set(fault, BD_ERR_USAGE, "region",
                        "--region %.40s: X,Y,WIDTH,HEIGHT in pixels of the picture", text);
}

enum bd_err bd_cli_parse_set(const char *text, const char **sets, uint32_t *set_count,
                             struct bd_fault *fault)
{
    const char *equals = strchr(text, '=');
    if (!equals || equals == text)
        return bd_fault_set(fault, BD_ERR_USAGE, "set", "--set %.60s: KEY=VALUE", text);
    if (*set_count == BD_CLI_SET_MAX)
        return bd_fault_set(fault, BD_ERR_USAGE, "set", "--set: at most %d times", BD_CLI_SET_MAX);
    sets[(*set_count)++] = text;
    return BD_ERR_OK;
}

static enum bd_err parse_layers(const char *text, struct bd_cli_render *out, struct bd_fault *fault)
{
    if (strlen(text) >= sizeof out->layer_text)
        return bd_fault_set(fault, BD_ERR_USAGE, "layers", "--layers: at most %zu characters",
                            sizeof out->layer_text - 1);
    memcpy(out->layer_text, text, strlen(text) + 1);
    out->layer_count = 0;
    for (char *rest = out->layer_text; rest;) {
        char *name = strsep(&rest, ",");
        if (!*name || out->layer_count == BD_CLI_LAYER_MAX)
            return bd_fault_set(fault, BD_ERR_USAGE, "layers",
                                "--layers %.60s: 1 to %d names with commas between, such as "
                                "beauty,direct,normal",
                                text, BD_CLI_LAYER_MAX);
        out->layers[out->layer_count++] = name;
    }
    return BD_ERR_OK;
}

static enum bd_err parse_exposure(const char *text, struct bd_cli_render *out,
                                  struct bd_fault *fault)
{
    double stops;
    out->exposure = text;
    if (strcmp(text, "auto") == 0) return BD_ERR_OK;
    if (bd_cli_number("exposure", text, -100, 100, &stops, NULL) == BD_ERR_OK) return BD_ERR_OK;
    return bd_fault_set(fault, BD_ERR_USAGE, "exposure",
                        "--exposure %.40s: auto, or stops from -100 to 100", text);
}

static enum bd_err parse_tonemap(const char *text, struct bd_cli_render *out,
                                 struct bd_fault *fault)
{
    out->tonemap = text;
    if (strcmp(text, "neutral") == 0 || strcmp(text, "agx") == 0 || strcmp(text, "linear") == 0)
        return BD_ERR_OK;
    return bd_fault_set(fault, BD_ERR_USAGE, "tonemap", "--tonemap %.40s: neutral, agx or linear",
                        text);
}

static enum bd_err parse_u32(const char *option, const char *text, uint32_t least, uint32_t most,
                             uint32_t *out, struct bd_fault *fault)
{
    uint64_t wide = 0;
    enum bd_err err = bd_cli_uint(option, text, least, most, &wide, fault);
    *out = (uint32_t)wide;
    return err;
}

// Cuts ":model" or ":full" off a figure; they say what both options measure against.
static enum bd_err parse_against(const char *option, const char *text, char *figure,
                                 size_t figure_size, struct bd_cli_render *out,
                                 struct bd_fault *fault)
{
    const char *colon = strchr(text, ':');
    size_t length = colon ? (size_t)(colon - text) : strlen(text);
    if (length >= figure_size) length = figure_size - 1;
    memcpy(figure, text, length);
    figure[length] = 0;
    if (!colon) return BD_ERR_OK;
    const char *against = colon + 1;
    if (strcmp(against, "model") != 0 && strcmp(against, "full") != 0)
        return bd_fault_set(fault, BD_ERR_USAGE, option, "--%s %.40s: against is model or full",
                            option, text);
    if (out->against && strcmp(out->against, against) != 0)
        return bd_fault_set(fault, BD_ERR_USAGE, option,
                            "--check and --target-error measure against one thing, not against %s "
                            "and %s",
                            out->against, against);
    out->against = against;
    return BD_ERR_OK;
}

static enum bd_err parse_check(const char *text, struct bd_cli_render *out, struct bd_fault *fault)
{
    char figure[40];
    enum bd_err err = parse_against("check", text, figure, sizeof figure, out, fault);
    return err ? err
               : parse_u32("check", figure, CHECK_PIXELS_MIN, CHECK_PIXELS_MAX, &out->check, fault);
}

static enum bd_err parse_target_error(const char *text, struct bd_cli_render *out,
                                      struct bd_fault *fault)
{
    char figure[40];
    enum bd_err err = parse_against("target-error", text, figure, sizeof figure, out, fault);
    return err ? err
               : bd_cli_number("target-error", figure, TARGET_ERROR_MIN, TARGET_ERROR_MAX,
                               &out->target_error, fault);
}

static enum bd_err parse_render_option(int id, const char *value, struct bd_cli_render *out,
                                       struct bd_fault *fault)
{
    switch (id) {
    case OPT_OUTPUT:
        out->output = value;
        return BD_ERR_OK;
    case OPT_SIZE:
        return bd_cli_parse_size(value, &out->width_px, &out->height_px, fault);
    case OPT_CAMERA:
        out->camera = value;
        return BD_ERR_OK;
    case OPT_TECHNIQUE:
        out->technique = value;
        return BD_ERR_OK;
    case OPT_SET:
        return bd_cli_parse_set(value, out->sets, &out->set_count, fault);
    case OPT_AA:
        return parse_u32("aa", value, 1, AA_MAX, &out->aa, fault);
    case OPT_LAYERS:
        return parse_layers(value, out, fault);
    case OPT_EXPOSURE:
        return parse_exposure(value, out, fault);
    case OPT_TONEMAP:
        return parse_tonemap(value, out, fault);
    case OPT_SEED:
        return bd_cli_uint("seed", value, 0, UINT64_MAX, &out->seed, fault);
    case OPT_DEADLINE:
        return parse_u32("deadline-ms", value, 1, UINT32_MAX, &out->deadline_ms, fault);
    case OPT_CHECK:
        return parse_check(value, out, fault);
    case OPT_TARGET_ERROR:
        return parse_target_error(value, out, fault);
    case OPT_PLAN:
        out->plan = true;
        return BD_ERR_OK;
    case OPT_REPORT:
        out->report = value;
        return BD_ERR_OK;
    case OPT_REGION:
        return bd_cli_parse_region(value, out->region, fault);
    case OPT_ENVIRONMENT:
        out->environment = value;
        return BD_ERR_OK;
    case OPT_FRESH:
        out->fresh = value;
        return BD_ERR_OK;
    default:
        break;
    }
    BD_ASSERT(!"an option of the table that nobody decodes");
    return BD_ERR_INTERNAL;
}

static enum bd_err format_of_output(struct bd_cli_render *out, struct bd_fault *fault)
{
    static const struct {
        const char *extension;
        enum bd_cli_format format;
    } known[] = {
        {".png", BD_CLI_PNG}, {".jpg", BD_CLI_JPEG}, {".jpeg", BD_CLI_JPEG}, {".exr", BD_CLI_EXR}};
    if (!out->output) return BD_ERR_OK;
    if (strcmp(out->output, "-") == 0) {
        out->format = BD_CLI_PNG;
        return BD_ERR_OK;
    }
    const char *slash = strrchr(out->output, '/');
    const char *dot = strrchr(slash ? slash : out->output, '.');
    for (size_t i = 0; dot && i < sizeof known / sizeof known[0]; i++)
        if (strcasecmp(dot, known[i].extension) == 0) out->format = known[i].format;
    if (out->format != BD_CLI_NONE) return BD_ERR_OK;
    return bd_fault_set(fault, BD_ERR_USAGE, "output",
                        "-o %.200s: the name must end in .png, .jpg, .jpeg or .exr", out->output);
}

static enum bd_err check_render(struct bd_cli_render *out, struct bd_fault *fault)
{
    if (!out->scene) return usage(fault, "scene", "no SCENE: a .glb or .gltf file, or scene:ID");
    enum bd_err err = bd_cli_check_common(&out->common, fault);
    if (!err) err = format_of_output(out, fault);
    if (err) return err;
    bool to_stdout = out->output && strcmp(out->output, "-") == 0;
    if (out->plan && out->output)
        return usage(fault, "plan", "--plan renders nothing, so there is nothing to write to -o");
    if (!out->output && !out->plan && !out->report && !out->common.json)
        return usage(
            fault, "output",
            "nothing to do: name a picture (-o FILE), or ask for --plan, --report FILE.json "
            "or --json");
    if (to_stdout && out->common.json)
        return usage(fault, "json", "-o - and --json both want standard output");
    if (out->layer_count > 1 && (out->format == BD_CLI_PNG || out->format == BD_CLI_JPEG))
        return usage(fault, "layers", "--layers: PNG and JPEG hold one layer; an .exr holds all");
    // Sub-frames are for pictures that are looked at; what is measured wants the bare pixel.
    bool looked_at = out->format == BD_CLI_PNG || out->format == BD_CLI_JPEG;
    // The reference samples a pixel by itself.
    bool traced = out->technique && strcmp(out->technique, "reference") == 0;
    if (!out->aa) out->aa = looked_at && !traced ? 16 : 1;
    return BD_ERR_OK;
}

enum bd_err bd_cli_parse_render(const char *const *words, int count, struct bd_cli_render *out,
                                struct bd_fault *fault)
{
    *out = (struct bd_cli_render){0};
    struct bd_cli_args args = {.words = words, .count = count};
    const char *value;
    int id;
    while ((id = bd_cli_next(&args, render_table, &value, fault)) != BD_CLI_END) {
        if (id == BD_CLI_ERROR) return BD_ERR_USAGE;
        if (id == BD_CLI_OPERAND) {
            if (out->scene)
                return bd_fault_set(fault, BD_ERR_USAGE, "scene",
                                    "one SCENE at a time: %.100s is a second", value);
            out->scene = value;
            continue;
        }
        if (bd_cli_parse_common(id, value, &out->common, &out->help)) continue;
        enum bd_err err = parse_render_option(id, value, out, fault);
        if (err) return err;
    }
    return out->help ? BD_ERR_OK : check_render(out, fault);
}

enum bd_err bd_cli_parse_plain(const char *const *words, int count, struct bd_cli_common *out,
                               const char **operands, int operand_max, int *operand_count,
                               bool *help, struct bd_fault *fault)
{
    *out = (struct bd_cli_common){0};
    *operand_count = 0;
    *help = false;
    struct bd_cli_args args = {.words = words, .count = count};
    const char *value;
    int id;
    while ((id = bd_cli_next(&args, plain_table, &value, fault)) != BD_CLI_END) {
        if (id == BD_CLI_ERROR) return BD_ERR_USAGE;
        if (id != BD_CLI_OPERAND) {
            bd_cli_parse_common(id, value, out, help);
            continue;
        }
        if (*operand_count == operand_max)
            return bd_fault_set(fault, BD_ERR_USAGE, "", "%.100s: one word too many", value);
        operands[(*operand_count)++] = value;
    }
    return bd_cli_check_common(out, fault);
}
