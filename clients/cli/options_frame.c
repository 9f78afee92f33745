// The options of a frame, by their table (protocol/frame_options.h).

#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "base/assert.h"
#include "clients/cli/options_common.h"

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

bool bd_cli_of_render(const struct bd_frame_option *option)
{
    return strcmp(option->name, "encoding") != 0; // the output's name says it
}

bool bd_cli_of_replay(const struct bd_frame_option *option)
{
    return bd_cli_of_render(option) && !option->of_one;
}

bool bd_cli_of_reference(const struct bd_frame_option *option)
{
    static const char *const names[] = {"size", "camera", "pose", "region", "seed", "parameters"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
        if (strcmp(option->name, names[i]) == 0) return true;
    return false;
}

void bd_cli_table_of(const struct bd_cli_option *own,
                     bool (*has)(const struct bd_frame_option *option),
                     struct bd_cli_option out[BD_CLI_TABLE_MAX])
{
    uint32_t count = 0;
    for (; own->name; own++) out[count++] = *own;
    for (uint32_t i = 0; i < bd_frame_option_count; i++) {
        const struct bd_frame_option *option = &bd_frame_options[i];
        const bool has_value = !bd_frame_option_is_flag(option);
        const int id = BD_CLI_OPT_FRAME + (int)i;
        if (!has(option)) continue;
        BD_ASSERT(count + 3 <= BD_CLI_TABLE_MAX);
        out[count++] = (struct bd_cli_option){option->name, 0, has_value, id};
        if (option->alias) out[count++] = (struct bd_cli_option){option->alias, 0, has_value, id};
    }
    out[count] = (struct bd_cli_option){0};
}

Bounced__FrameRequest *bd_cli_frame_new(void)
{
    Bounced__FrameRequest *frame = malloc(sizeof *frame);
    BD_ASSERT(frame);
    bounced__frame_request__init(frame);
    return frame;
}

void bd_cli_frame_finish(Bounced__FrameRequest **frame)
{
    if (*frame) bounced__frame_request__free_unpacked(*frame, NULL);
    *frame = NULL;
}

bool bd_cli_is_frame_option(int id)
{
    return id >= BD_CLI_OPT_FRAME;
}

enum bd_err bd_cli_parse_frame_option(int id, const char *value, Bounced__FrameRequest *frame,
                                      struct bd_err_detail *detail)
{
    const struct bd_frame_option *option = &bd_frame_options[id - BD_CLI_OPT_FRAME];
    return bd_frame_option_set(option, value ? value : "1", frame, detail);
}

enum bd_err bd_cli_set_frame_option(const char *name, const char *text,
                                    Bounced__FrameRequest *frame, struct bd_err_detail *detail)
{
    return bd_frame_option_set(bd_frame_option_named(name, detail), text, frame, detail);
}

enum bd_err bd_cli_format_of(const char *path, enum bd_cli_format *out,
                             struct bd_err_detail *detail)
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
    return bd_err_set(detail, BD_ERR_USAGE, "output",
                      "-o %.200s: the name must end in .png, .jpg, .jpeg or .exr", path);
}

enum bd_err bd_cli_check_frame(enum bd_cli_format format, Bounced__FrameRequest *frame,
                               struct bd_err_detail *detail)
{
    bool looked_at = format == BD_CLI_PNG || format == BD_CLI_JPEG;
    if (frame->n_layers > 1 && looked_at)
        return bd_err_set(detail, BD_ERR_USAGE, "layers",
                          "--layers: PNG and JPEG hold one layer; an .exr holds all");
    // Sub-frames are for pictures that are looked at; what is measured wants the bare pixel. The
    // reference samples a pixel by itself.
    bool traced = frame->technique && strcmp(frame->technique, "reference") == 0;
    if (!frame->has_aa) frame->aa = looked_at && !traced ? 16 : 1;
    frame->has_aa = 1;
    return bd_cli_set_frame_option("encoding", bd_cli_format_name(format), frame, detail);
}
