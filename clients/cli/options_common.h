// Private to the files that decode command lines: the options that every command has, and forms that
// several have.

#ifndef BD_CLI_OPTIONS_COMMON_H
#define BD_CLI_OPTIONS_COMMON_H

#include "clients/cli/args.h"
#include "clients/cli/options.h"

enum {
    BD_CLI_OPT_HELP = 1,
    BD_CLI_OPT_SERVER,
    BD_CLI_OPT_TOKEN_FILE,
    BD_CLI_OPT_DEVICE,
    BD_CLI_OPT_JSON,
    BD_CLI_OPT_QUIET,
    BD_CLI_OPT_OWN, // the first of a command's own
};

#define BD_CLI_COMMON_OPTIONS                                                                      \
    {"help", 'h', false, BD_CLI_OPT_HELP}, {"server", 0, true, BD_CLI_OPT_SERVER},                 \
        {"token-file", 0, true, BD_CLI_OPT_TOKEN_FILE}, {"device", 0, true, BD_CLI_OPT_DEVICE},    \
        {"json", 0, false, BD_CLI_OPT_JSON},                                                       \
    {                                                                                              \
        "quiet", 'q', false, BD_CLI_OPT_QUIET                                                      \
    }

// True if `id` is one of the common options, which is then stored.
bool bd_cli_parse_common(int id, const char *value, struct bd_cli_common *out, bool *help);
BD_MUST_CHECK
enum bd_err bd_cli_check_common(const struct bd_cli_common *common, struct bd_fault *fault);

// "WxH".
BD_MUST_CHECK
enum bd_err bd_cli_parse_size(const char *text, uint32_t *width_px, uint32_t *height_px,
                              struct bd_fault *fault);
// "X,Y,WIDTH,HEIGHT", not empty.
BD_MUST_CHECK
enum bd_err bd_cli_parse_region(const char *text, uint32_t out[4], struct bd_fault *fault);
// Appends "KEY=VALUE" to a list of BD_CLI_SET_MAX.
BD_MUST_CHECK
enum bd_err bd_cli_parse_set(const char *text, const char **sets, uint32_t *set_count,
                             struct bd_fault *fault);

#endif
