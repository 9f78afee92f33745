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
    BD_CLI_OPT_SIZE, // the first of a frame's
    BD_CLI_OPT_CAMERA,
    BD_CLI_OPT_TECHNIQUE,
    BD_CLI_OPT_SET,
    BD_CLI_OPT_AA,
    BD_CLI_OPT_LAYERS,
    BD_CLI_OPT_EXPOSURE,
    BD_CLI_OPT_TONEMAP,
    BD_CLI_OPT_SEED,
    BD_CLI_OPT_DEADLINE,
    BD_CLI_OPT_FRESH,
    BD_CLI_OPT_REGION,
    BD_CLI_OPT_OWN, // the first of a command's own
};

#define BD_CLI_COMMON_OPTIONS                                                                      \
    {"help", 'h', false, BD_CLI_OPT_HELP}, {"server", 0, true, BD_CLI_OPT_SERVER},                 \
        {"token-file", 0, true, BD_CLI_OPT_TOKEN_FILE}, {"device", 0, true, BD_CLI_OPT_DEVICE},    \
        {"json", 0, false, BD_CLI_OPT_JSON},                                                       \
    {                                                                                              \
        "quiet", 'q', false, BD_CLI_OPT_QUIET                                                      \
    }

// How a frame is rendered: `render` and `replay` have these.
#define BD_CLI_FRAME_OPTIONS                                                                       \
    {"size", 0, true, BD_CLI_OPT_SIZE}, {"camera", 0, true, BD_CLI_OPT_CAMERA},                    \
        {"technique", 0, true, BD_CLI_OPT_TECHNIQUE}, {"set", 0, true, BD_CLI_OPT_SET},            \
        {"aa", 0, true, BD_CLI_OPT_AA}, {"layers", 0, true, BD_CLI_OPT_LAYERS},                    \
        {"exposure", 0, true, BD_CLI_OPT_EXPOSURE}, {"tonemap", 0, true, BD_CLI_OPT_TONEMAP},      \
        {"seed", 0, true, BD_CLI_OPT_SEED}, {"deadline-ms", 0, true, BD_CLI_OPT_DEADLINE},         \
        {"fresh", 0, true, BD_CLI_OPT_FRESH},                                                      \
    {                                                                                              \
        "region", 0, true, BD_CLI_OPT_REGION                                                       \
    }

bool bd_cli_is_frame_option(int id);
// One that is; names the option and what it allows.
BD_MUST_CHECK
enum bd_err bd_cli_parse_frame_option(int id, const char *value, struct bd_cli_render *out,
                                      struct bd_fault *fault);
// What options together allow, and the default of `aa`. After `format` is known.
BD_MUST_CHECK
enum bd_err bd_cli_check_frame(struct bd_cli_render *out, struct bd_fault *fault);
// By the extension; "-" is PNG, NULL is none.
BD_MUST_CHECK
enum bd_err bd_cli_format_of(const char *path, enum bd_cli_format *out, struct bd_fault *fault);

BD_MUST_CHECK
enum bd_err bd_cli_parse_u32(const char *option, const char *text, uint32_t least, uint32_t most,
                             uint32_t *out, struct bd_fault *fault);

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
