// Decodes the words behind `bounce scene`, `bounce edit` and `bounce watch`.

#include <string.h>

#include "base/assert.h"
#include "clients/cli/options_common.h"

enum {
    OPT_ENVIRONMENT = BD_CLI_OPT_OWN,
    OPT_AFTER,
    OPT_LIMIT,
    OPT_REMOVE,
    OPT_KEEP_GOING,
    OPT_COUNT,
    OPT_BY,
    OPT_ALL,
    OPT_HELP_OPS,
};

static const struct bd_cli_option scene_table[] = {
    BD_CLI_COMMON_OPTIONS,
    {"environment", 0, true, OPT_ENVIRONMENT},
    {"after", 0, true, OPT_AFTER},
    {"limit", 0, true, OPT_LIMIT},
    {"remove", 0, false, OPT_REMOVE},
    {"by", 0, true, OPT_BY},
    {"all", 0, false, OPT_ALL},
    {0},
};

static const struct bd_cli_option edit_table[] = {BD_CLI_COMMON_OPTIONS,
                                                  {"keep-going", 'k', false, OPT_KEEP_GOING},
                                                  {"by", 0, true, OPT_BY},
                                                  {"help-ops", 0, false, OPT_HELP_OPS},
                                                  {0}};

static const struct bd_cli_option watch_table[] = {
    BD_CLI_COMMON_OPTIONS, {"count", 0, true, OPT_COUNT}, {0}};

static enum bd_err store(int id, const char *value, struct bd_cli_scene *out,
                         struct bd_err_detail *detail)
{
    uint64_t limit = 0;
    enum bd_err err = BD_ERR_OK;
    switch (id) {
    case OPT_ENVIRONMENT:
        out->environment = value;
        return BD_ERR_OK;
    case OPT_AFTER:
        out->has_after = true;
        return bd_cli_uint("after", value, 0, INT64_MAX, &out->after, detail);
    case OPT_LIMIT:
        err = bd_cli_uint("limit", value, 1, UINT32_MAX, &limit, detail);
        out->limit = (uint32_t)limit;
        return err;
    case OPT_REMOVE:
        out->remove = true;
        return BD_ERR_OK;
    case OPT_KEEP_GOING:
        out->keep_going = true;
        return BD_ERR_OK;
    case OPT_BY:
        out->by = value;
        return BD_ERR_OK;
    case OPT_ALL:
        out->all = true;
        return BD_ERR_OK;
    case OPT_HELP_OPS:
        out->help_ops = true;
        return BD_ERR_OK;
    case OPT_COUNT:
        return bd_cli_uint("count", value, 1, UINT64_MAX, &out->count, detail);
    default:
        break;
    }
    BD_ASSERT(!"an option of the table that nobody decodes");
    return BD_ERR_INTERNAL;
}

static enum bd_err parse(const struct bd_cli_option *table, const char *const *words, int count,
                         struct bd_cli_scene *out, struct bd_err_detail *detail)
{
    *out = (struct bd_cli_scene){.operands = {"", "", "", ""}};
    struct bd_cli_args args = {.words = words, .count = count};
    const char *value;
    int id;
    while ((id = bd_cli_next(&args, table, &value, detail)) != BD_CLI_END) {
        if (id == BD_CLI_ERROR) return BD_ERR_USAGE;
        if (id == BD_CLI_OPERAND && out->operand_count == BD_CLI_SCENE_OPERANDS)
            return bd_err_set(detail, BD_ERR_USAGE, "", "%.100s: one word too many", value);
        if (id == BD_CLI_OPERAND) {
            out->operands[out->operand_count++] = value;
            continue;
        }
        if (bd_cli_parse_common(id, value, &out->common, &out->help)) continue;
        enum bd_err err = store(id, value, out, detail);
        if (err) return err;
    }
    return bd_cli_check_common(&out->common, detail);
}

static bool is_one_of(const char *verb, const char *const *verbs)
{
    while (*verbs && strcmp(verb, *verbs) != 0) verbs++;
    return *verbs != NULL;
}

// Options that go with some verbs alone.
static enum bd_err check_verb(const struct bd_cli_scene *scene, struct bd_err_detail *detail)
{
    const char *verb = scene->operands[0];
    if (scene->environment && strcmp(verb, "add") != 0)
        return bd_err_set(detail, BD_ERR_USAGE, "environment",
                          "--environment goes with bounce scene add FILE");
    if ((scene->has_after || scene->limit) && strcmp(verb, "log") != 0)
        return bd_err_set(detail, BD_ERR_USAGE, scene->limit ? "limit" : "after",
                          "--after and --limit go with bounce scene log ID");
    if (scene->remove && strcmp(verb, "name") != 0)
        return bd_err_set(detail, BD_ERR_USAGE, "remove",
                          "--remove goes with bounce scene name ID NAME");
    if (scene->all && !is_one_of(verb, (const char *const[]){"undo", "redo", NULL}))
        return bd_err_set(detail, BD_ERR_USAGE, "all", "--all goes with bounce scene undo|redo ID");
    if (scene->by &&
        !is_one_of(verb, (const char *const[]){"undo", "redo", "commit", "revert", NULL}))
        return bd_err_set(detail, BD_ERR_USAGE, "by",
                          "--by goes with bounce edit and bounce scene undo|redo|commit|revert");
    return BD_ERR_OK;
}

enum bd_err bd_cli_parse_scene(const char *const *words, int count, struct bd_cli_scene *out,
                               struct bd_err_detail *detail)
{
    enum bd_err err = parse(scene_table, words, count, out, detail);
    return err || out->help ? err : check_verb(out, detail);
}

enum bd_err bd_cli_parse_edit(const char *const *words, int count, struct bd_cli_scene *out,
                              struct bd_err_detail *detail)
{
    enum bd_err err = parse(edit_table, words, count, out, detail);
    if (err || out->help || out->help_ops || out->operand_count == 2) return err;
    return bd_err_set(detail, BD_ERR_USAGE, "",
                      "bounce edit SCENE_ID FILE.json, or - for "
                      "standard input");
}

enum bd_err bd_cli_parse_watch(const char *const *words, int count, struct bd_cli_scene *out,
                               struct bd_err_detail *detail)
{
    enum bd_err err = parse(watch_table, words, count, out, detail);
    if (err || out->help || out->operand_count <= 1) return err;
    return bd_err_set(detail, BD_ERR_USAGE, "", "bounce watch SCENE_ID, or none for all scenes");
}
