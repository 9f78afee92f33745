// Decodes the words behind `bounce replay`.

#include <string.h>

#include "base/assert.h"
#include "clients/cli/options_common.h"

enum {
    OPT_SCENE = BD_CLI_OPT_OWN,
    OPT_TO,
    OPT_CHECK,
    OPT_RENDER,
    OPT_FRAMES,
    OPT_EVERY,
    OPT_AT,
    OPT_FORMAT,
};

static const struct bd_cli_option replay_table[] = {
    BD_CLI_COMMON_OPTIONS,           {"scene", 0, true, OPT_SCENE},
    {"to", 0, true, OPT_TO},         {"check", 0, false, OPT_CHECK},
    {"render", 0, true, OPT_RENDER}, {"frames", 0, true, OPT_FRAMES},
    {"every", 0, true, OPT_EVERY},   {"at", 0, true, OPT_AT},
    {"format", 0, true, OPT_FORMAT}, {0},
};

// What decides together, once all words are read.
struct words {
    const char *format;
    const char *frame_option; // one that was given
};

static enum bd_err store(int id, const char *value, struct bd_cli_replay *out, struct words *words,
                         struct bd_err_detail *detail)
{
    switch (id) {
    case OPT_SCENE:
        out->scene = value;
        return BD_ERR_OK;
    case OPT_TO:
        return bd_cli_uint("to", value, 1, INT64_MAX, &out->to, detail);
    case OPT_CHECK:
        out->check = true;
        return BD_ERR_OK;
    case OPT_RENDER:
        out->render = value;
        return BD_ERR_OK;
    case OPT_FRAMES:
        out->frames = value;
        return BD_ERR_OK;
    case OPT_EVERY:
        return bd_cli_uint("every", value, 1, INT64_MAX, &out->every, detail);
    case OPT_AT:
        if (out->at_count == BD_CLI_AT_MAX)
            return bd_err_set(detail, BD_ERR_USAGE, "at", "--at: at most %d times", BD_CLI_AT_MAX);
        return bd_cli_uint("at", value, 1, INT64_MAX, &out->at[out->at_count++], detail);
    case OPT_FORMAT:
        words->format = value;
        return BD_ERR_OK;
    default:
        break;
    }
    BD_ASSERT(!"an option of the table that nobody decodes");
    return BD_ERR_INTERNAL;
}

static enum bd_err find_format(const struct words *words, struct bd_cli_replay *out,
                               struct bd_err_detail *detail)
{
    static const struct {
        const char *name;
        enum bd_cli_format format;
    } known[] = {{"png", BD_CLI_PNG}, {"jpg", BD_CLI_JPEG}, {"exr", BD_CLI_EXR}};
    enum bd_cli_format *format = &out->frame.format;
    enum bd_err err = bd_cli_format_of(out->render, format, detail);
    if (err) return err;
    if (!words->format) {
        if (out->frames && !out->render) *format = BD_CLI_PNG;
        return BD_ERR_OK;
    }
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++)
        if (strcmp(words->format, known[i].name) == 0) {
            if (out->frames && (!out->render || *format == known[i].format)) {
                *format = known[i].format;
                return BD_ERR_OK;
            }
            return bd_err_set(detail, BD_ERR_USAGE, "format",
                              "--format is for --frames, and the same as --render's");
        }
    return bd_err_set(detail, BD_ERR_USAGE, "format", "--format %.40s: png, jpg or exr",
                      words->format);
}

static enum bd_err check(const struct words *words, struct bd_cli_replay *out,
                         struct bd_err_detail *detail)
{
    enum bd_err err = bd_cli_check_common(&out->frame.common, detail);
    if (err) return err;
    if (!out->journal)
        return bd_err_set(detail, BD_ERR_USAGE, "journal",
                          "no JOURNAL: a journal.sqlite, or the data directory around it");
    if (out->render && strcmp(out->render, "-") == 0)
        return bd_err_set(detail, BD_ERR_USAGE, "render",
                          "--render -: standard output is for the revisions");
    if ((out->every || out->at_count) && !out->frames)
        return bd_err_set(detail, BD_ERR_USAGE, out->every ? "every" : "at",
                          "--%s goes with --frames DIR", out->every ? "every" : "at");
    if (out->every && out->at_count)
        return bd_err_set(detail, BD_ERR_USAGE, "at", "--at and --every: one of them");
    if (words->frame_option && !out->render && !out->frames)
        return bd_err_set(detail, BD_ERR_USAGE, "render",
                          "%.60s is about frames, and none is asked for: --render FILE or "
                          "--frames DIR",
                          words->frame_option);
    if (!out->every) out->every = 1;
    err = find_format(words, out, detail);
    return err ? err : bd_cli_check_frame(out->frame.format, out->frame.frame, detail);
}

enum bd_err bd_cli_parse_replay(const char *const *words, int count, struct bd_cli_replay *out,
                                struct bd_err_detail *detail)
{
    *out = (struct bd_cli_replay){.frame.frame = bd_cli_frame_new()};
    struct bd_cli_option table[BD_CLI_TABLE_MAX];
    bd_cli_table_of(replay_table, bd_cli_of_replay, table);
    struct words seen = {0};
    struct bd_cli_args args = {.words = words, .count = count};
    const char *value;
    int id;
    while ((id = bd_cli_next(&args, table, &value, detail)) != BD_CLI_END) {
        if (id == BD_CLI_ERROR) return BD_ERR_USAGE;
        if (id == BD_CLI_OPERAND && out->journal)
            return bd_err_set(detail, BD_ERR_USAGE, "", "%.100s: one word too many", value);
        if (id == BD_CLI_OPERAND) {
            out->journal = value;
            continue;
        }
        if (bd_cli_parse_common(id, value, &out->frame.common, &out->help)) continue;
        bool is_frame = bd_cli_is_frame_option(id);
        if (is_frame) seen.frame_option = words[args.next - 1];
        enum bd_err err = is_frame ? bd_cli_parse_frame_option(id, value, out->frame.frame, detail)
                                   : store(id, value, out, &seen, detail);
        if (err) return err;
    }
    return out->help ? BD_ERR_OK : check(&seen, out, detail);
}
