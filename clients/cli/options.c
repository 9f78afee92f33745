#include "clients/cli/options.h"

#include <stdio.h>
#include <string.h>

#include "base/assert.h"
#include "base/flags.h"
#include "clients/cli/args.h"
#include "clients/cli/options_common.h"

enum {
    OPT_OUTPUT = BD_CLI_OPT_OWN,
    OPT_REPORT,
    OPT_ENVIRONMENT,
    OPT_FAIL_ON,
    OPT_STRICT,
};

static const struct bd_cli_option plain_table[] = {BD_CLI_COMMON_OPTIONS, {0}};

static const struct bd_cli_option render_table[] = {
    BD_CLI_COMMON_OPTIONS,
    {"output", 'o', true, OPT_OUTPUT},
    {"report", 0, true, OPT_REPORT},
    {"environment", 0, true, OPT_ENVIRONMENT},
    {"fail-on", 0, true, OPT_FAIL_ON},
    {"strict", 0, false, OPT_STRICT},
    {0},
};

static enum bd_err usage(struct bd_err_detail *detail, const char *option, const char *message)
{
    return bd_err_set(detail, BD_ERR_USAGE, option, "%s", message);
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

enum bd_err bd_cli_check_common(const struct bd_cli_common *common, struct bd_err_detail *detail)
{
    if (common->server && common->device)
        return usage(detail, "device",
                     "--device chooses the device of a private daemon; a running one (--server) "
                     "has chosen");
    return BD_ERR_OK;
}

static enum bd_err unknown_flag(const char *text, uint32_t length, struct bd_err_detail *detail)
{
    char known[1100] = "";
    for (int f = 0; f < BD_FLAG_COUNT; f++) {
        size_t used = strlen(known);
        snprintf(known + used, sizeof known - used, ", %s", bd_flag_name((enum bd_flag)f));
    }
    return bd_err_set(detail, BD_ERR_USAGE, "fail-on",
                      "--fail-on %.*s: no such flag; there are none%s", (int)length, text, known);
}

// Flags with commas between, added to those that count anyway; "none" takes all away that stand
// before it.
static enum bd_err parse_fail_on(const char *text, struct bd_cli_render *out,
                                 struct bd_err_detail *detail)
{
    for (const char *rest = text; rest;) {
        uint32_t length = (uint32_t)strcspn(rest, ",");
        enum bd_flag flag = bd_flag_of(rest, length);
        bool is_none = length == 4 && memcmp(rest, "none", 4) == 0;
        if (flag == BD_FLAG_COUNT && !is_none)
            return unknown_flag(rest, length < 40 ? length : 40, detail);
        out->fail_on = is_none ? 0 : out->fail_on | UINT64_C(1) << flag;
        rest = rest[length] ? rest + length + 1 : NULL;
    }
    return BD_ERR_OK;
}

static enum bd_err parse_render_option(int id, const char *value, struct bd_cli_render *out,
                                       struct bd_err_detail *detail)
{
    switch (id) {
    case OPT_OUTPUT:
        out->output = value;
        return BD_ERR_OK;
    case OPT_REPORT:
        out->report = value;
        return BD_ERR_OK;
    case OPT_ENVIRONMENT:
        out->environment = value;
        return BD_ERR_OK;
    case OPT_FAIL_ON:
        return parse_fail_on(value, out, detail);
    case OPT_STRICT:
        out->strict = true;
        return BD_ERR_OK;
    default:
        break;
    }
    BD_ASSERT(!"an option of the table that nobody decodes");
    return BD_ERR_INTERNAL;
}

static enum bd_err check_render(struct bd_cli_render *out, struct bd_err_detail *detail)
{
    if (!out->scene) return usage(detail, "scene", "no SCENE: a .glb or .gltf file, or scene:ID");
    enum bd_err err = bd_cli_check_common(&out->common, detail);
    if (!err) err = bd_cli_format_of(out->output, &out->format, detail);
    if (err) return err;
    bool to_stdout = out->output && strcmp(out->output, "-") == 0;
    const bool plan = out->frame->plan_only;
    if (plan && out->output)
        return usage(detail, "plan_only",
                     "--plan renders nothing, so there is nothing to write to -o");
    if (!out->output && !plan && !out->report && !out->common.json)
        return usage(
            detail, "output",
            "nothing to do: name a picture (-o FILE), or ask for --plan, --report FILE.json "
            "or --json");
    if (to_stdout && out->common.json)
        return usage(detail, "json", "-o - and --json both want standard output");
    return bd_cli_check_frame(out->format, out->frame, detail);
}

enum bd_err bd_cli_parse_render(const char *const *words, int count, struct bd_cli_render *out,
                                struct bd_err_detail *detail)
{
    *out = (struct bd_cli_render){.fail_on = bd_flags_that_fail(), .frame = bd_cli_frame_new()};
    struct bd_cli_option table[BD_CLI_TABLE_MAX];
    bd_cli_table_of(render_table, bd_cli_of_render, table);
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
        enum bd_err err = bd_cli_is_frame_option(id)
                              ? bd_cli_parse_frame_option(id, value, out->frame, detail)
                              : parse_render_option(id, value, out, detail);
        if (err) return err;
    }
    return out->help ? BD_ERR_OK : check_render(out, detail);
}

enum bd_err bd_cli_parse_plain(const char *const *words, int count, struct bd_cli_common *out,
                               const char **operands, int operand_max, int *operand_count,
                               bool *help, struct bd_err_detail *detail)
{
    *out = (struct bd_cli_common){0};
    *operand_count = 0;
    *help = false;
    struct bd_cli_args args = {.words = words, .count = count};
    const char *value;
    int id;
    while ((id = bd_cli_next(&args, plain_table, &value, detail)) != BD_CLI_END) {
        if (id == BD_CLI_ERROR) return BD_ERR_USAGE;
        if (id != BD_CLI_OPERAND) {
            bd_cli_parse_common(id, value, out, help);
            continue;
        }
        if (*operand_count == operand_max)
            return bd_err_set(detail, BD_ERR_USAGE, "", "%.100s: one word too many", value);
        operands[(*operand_count)++] = value;
    }
    return bd_cli_check_common(out, detail);
}
