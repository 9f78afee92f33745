#include "clients/cli/args.h"
#include "base/nearest.h"

#include <ctype.h>
#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/nearest.h"

static int take_value(struct bd_cli_args *args, const struct bd_cli_option *option,
                      const char *attached, const char **value, struct bd_err_detail *detail)
{
    *value = attached;
    if (option->has_value && !attached) {
        if (args->next >= args->count) {
            bd_err_set(detail, BD_ERR_USAGE, option->name, "--%s needs a value", option->name);
            return BD_CLI_ERROR;
        }
        *value = args->words[args->next++];
    } else if (!option->has_value && attached) {
        bd_err_set(detail, BD_ERR_USAGE, option->name, "--%s takes no value", option->name);
        return BD_CLI_ERROR;
    }
    return option->id;
}

// '-' stands for '_'.
static bool is_name(const char *name, const char *word, size_t length)
{
    for (size_t i = 0; i < length; i++)
        if (!name[i] || (name[i] != word[i] && !(name[i] == '_' && word[i] == '-'))) return false;
    return !name[length];
}

static int next_long(struct bd_cli_args *args, const struct bd_cli_option *table, const char *word,
                     const char **value, struct bd_err_detail *detail)
{
    size_t length = strcspn(word, "=");
    char name[64], hint[BD_NEAREST_HINT_BYTES];
    struct bd_nearest nearest;
    snprintf(name, sizeof name, "%.*s", (int)length, word);
    bd_nearest_begin(&nearest, name);
    for (; table->name; table++) {
        if (is_name(table->name, word, length))
            return take_value(args, table, word[length] ? word + length + 1 : NULL, value, detail);
        bd_nearest_consider(&nearest, table->name);
    }
    bd_err_set(detail, BD_ERR_USAGE, name, "no option --%s%s", name,
               bd_nearest_hint(&nearest, hint));
    return BD_CLI_ERROR;
}

static int next_short(struct bd_cli_args *args, const struct bd_cli_option *table, const char *word,
                      const char **value, struct bd_err_detail *detail)
{
    for (; table->name; table++) {
        if (table->letter != word[0]) continue;
        return take_value(args, table, word[1] ? word + 1 : NULL, value, detail);
    }
    bd_err_set(detail, BD_ERR_USAGE, word, "no option -%s", word);
    return BD_CLI_ERROR;
}

int bd_cli_next(struct bd_cli_args *args, const struct bd_cli_option *table, const char **value,
                struct bd_err_detail *detail)
{
    *value = NULL;
    if (args->next >= args->count) return BD_CLI_END;
    const char *word = args->words[args->next++];
    // A lone dash is an operand: standard input or output by custom.
    if (args->operands_only || word[0] != '-' || !word[1]) {
        *value = word;
        return BD_CLI_OPERAND;
    }
    if (word[1] != '-') return next_short(args, table, word + 1, value, detail);
    if (word[2]) return next_long(args, table, word + 2, value, detail);
    args->operands_only = true;
    return bd_cli_next(args, table, value, detail);
}

enum bd_err bd_cli_uint(const char *option, const char *text, uint64_t least, uint64_t most,
                        uint64_t *out, struct bd_err_detail *detail)
{
    char *end = NULL;
    errno = 0;
    // strtoull takes a sign and leading space, and turns -1 into the largest number.
    uint64_t value = isdigit((unsigned char)text[0]) ? strtoull(text, &end, 10) : 0;
    if (!end || *end || errno || value < least || value > most)
        return bd_err_set(detail, BD_ERR_USAGE, option,
                          "--%s %.40s: a whole number from %" PRIu64 " to %" PRIu64, option, text,
                          least, most);
    *out = value;
    return BD_ERR_OK;
}

enum bd_err bd_cli_number(const char *option, const char *text, double least, double most,
                          double *out, struct bd_err_detail *detail)
{
    char *end = NULL;
    double value = isspace((unsigned char)text[0]) ? 0 : strtod(text, &end);
    if (!end || end == text || *end || !(value >= least && value <= most))
        return bd_err_set(detail, BD_ERR_USAGE, option, "--%s %.40s: a number from %g to %g",
                          option, text, least, most);
    *out = value;
    return BD_ERR_OK;
}
