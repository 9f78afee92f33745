// The options of a frame, which `bounce render` and `bounce replay` share.

#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "base/assert.h"
#include "clients/cli/options_common.h"

// The limits of the server are tighter; these are what the fields can say.
#define SIDE_PX_MAX 32768u
#define AA_MAX      64u

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

enum bd_err bd_cli_parse_u32(const char *option, const char *text, uint32_t least, uint32_t most,
                             uint32_t *out, struct bd_fault *fault)
{
    uint64_t wide = 0;
    enum bd_err err = bd_cli_uint(option, text, least, most, &wide, fault);
    *out = (uint32_t)wide;
    return err;
}

bool bd_cli_is_frame_option(int id)
{
    return id >= BD_CLI_OPT_SIZE && id < BD_CLI_OPT_OWN;
}

enum bd_err bd_cli_parse_frame_option(int id, const char *value, struct bd_cli_render *out,
                                      struct bd_fault *fault)
{
    switch (id) {
    case BD_CLI_OPT_SIZE:
        return bd_cli_parse_size(value, &out->width_px, &out->height_px, fault);
    case BD_CLI_OPT_CAMERA:
        out->camera = value;
        return BD_ERR_OK;
    case BD_CLI_OPT_TECHNIQUE:
        out->technique = value;
        return BD_ERR_OK;
    case BD_CLI_OPT_SET:
        return bd_cli_parse_set(value, out->sets, &out->set_count, fault);
    case BD_CLI_OPT_AA:
        return bd_cli_parse_u32("aa", value, 1, AA_MAX, &out->aa, fault);
    case BD_CLI_OPT_LAYERS:
        return parse_layers(value, out, fault);
    case BD_CLI_OPT_EXPOSURE:
        return parse_exposure(value, out, fault);
    case BD_CLI_OPT_TONEMAP:
        return parse_tonemap(value, out, fault);
    case BD_CLI_OPT_SEED:
        return bd_cli_uint("seed", value, 0, UINT64_MAX, &out->seed, fault);
    case BD_CLI_OPT_DEADLINE:
        return bd_cli_parse_u32("deadline-ms", value, 1, UINT32_MAX, &out->deadline_ms, fault);
    case BD_CLI_OPT_FRESH:
        out->fresh = value;
        return BD_ERR_OK;
    case BD_CLI_OPT_REGION:
        return bd_cli_parse_region(value, out->region, fault);
    default:
        break;
    }
    BD_ASSERT(!"an option of the table that nobody decodes");
    return BD_ERR_INTERNAL;
}

enum bd_err bd_cli_format_of(const char *path, enum bd_cli_format *out, struct bd_fault *fault)
{
    static const struct {
        const char *extension;
        enum bd_cli_format format;
    } known[] = {
        {".png", BD_CLI_PNG}, {".jpg", BD_CLI_JPEG}, {".jpeg", BD_CLI_JPEG}, {".exr", BD_CLI_EXR}};
    *out = BD_CLI_NONE;
    if (!path) return BD_ERR_OK;
    if (strcmp(path, "-") == 0) {
        *out = BD_CLI_PNG;
        return BD_ERR_OK;
    }
    const char *slash = strrchr(path, '/');
    const char *dot = strrchr(slash ? slash : path, '.');
    for (size_t i = 0; dot && i < sizeof known / sizeof known[0]; i++)
        if (strcasecmp(dot, known[i].extension) == 0) *out = known[i].format;
    if (*out != BD_CLI_NONE) return BD_ERR_OK;
    return bd_fault_set(fault, BD_ERR_USAGE, "output",
                        "-o %.200s: the name must end in .png, .jpg, .jpeg or .exr", path);
}

enum bd_err bd_cli_check_frame(struct bd_cli_render *out, struct bd_fault *fault)
{
    bool looked_at = out->format == BD_CLI_PNG || out->format == BD_CLI_JPEG;
    if (out->layer_count > 1 && looked_at)
        return bd_fault_set(fault, BD_ERR_USAGE, "layers",
                            "--layers: PNG and JPEG hold one layer; an .exr holds all");
    // Sub-frames are for pictures that are looked at; what is measured wants the bare pixel. The
    // reference samples a pixel by itself.
    bool traced = out->technique && strcmp(out->technique, "reference") == 0;
    if (!out->aa) out->aa = looked_at && !traced ? 16 : 1;
    return BD_ERR_OK;
}
