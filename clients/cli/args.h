// Command-line words, one at a time: options by a table, operands, errors that name the option.
//
// Understands `--name value`, `--name=value`, `-x value`, `-xvalue` and `--`. Knows nothing of
// what options mean. Thread: main.

#ifndef BD_CLI_ARGS_H
#define BD_CLI_ARGS_H

#include <stdbool.h>
#include <stdint.h>

#include "base/err.h"

struct bd_cli_option {
    const char *name; // without the dashes; NULL ends a table
    char letter;      // of the short form, 0 if there is none
    bool has_value;
    int id; // 1 or more
};

#define BD_CLI_END     0
#define BD_CLI_OPERAND (-1)
#define BD_CLI_ERROR   (-2) // `detail` is filled, with BD_ERR_USAGE

struct bd_cli_args {
    const char *const *words; // of main, from the first that belongs to the command
    int count;
    int next;
    bool operands_only; // behind `--`
};

// The id of the next option, or one of the constants above. `*value` is the option's value or the
// operand.
int bd_cli_next(struct bd_cli_args *args, const struct bd_cli_option *table, const char **value,
                struct bd_err_detail *detail);

// Numbers in full: no spaces, nothing behind them. Errors name `option` and its range.
BD_MUST_CHECK
enum bd_err bd_cli_uint(const char *option, const char *text, uint64_t least, uint64_t most,
                        uint64_t *out, struct bd_err_detail *detail);
BD_MUST_CHECK
enum bd_err bd_cli_number(const char *option, const char *text, double least, double most,
                          double *out, struct bd_err_detail *detail);

#endif
