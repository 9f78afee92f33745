// Private to the files that decode command lines: the options that every command has, and forms that
// several have.

#ifndef BD_CLI_OPTIONS_COMMON_H
#define BD_CLI_OPTIONS_COMMON_H

#include "clients/cli/args.h"
#include "clients/cli/options.h"
#include "protocol/frame_options.h"

enum {
    BD_CLI_OPT_HELP = 1,
    BD_CLI_OPT_SERVER,
    BD_CLI_OPT_TOKEN_FILE,
    BD_CLI_OPT_DEVICE,
    BD_CLI_OPT_JSON,
    BD_CLI_OPT_QUIET,
    BD_CLI_OPT_OWN,         // the first of a command's own
    BD_CLI_OPT_FRAME = 100, // the first of a frame's, in the order of their table
};

#define BD_CLI_COMMON_OPTIONS                                                                      \
    {"help", 'h', false, BD_CLI_OPT_HELP}, {"server", 0, true, BD_CLI_OPT_SERVER},                 \
        {"token-file", 0, true, BD_CLI_OPT_TOKEN_FILE}, {"device", 0, true, BD_CLI_OPT_DEVICE},    \
        {"json", 0, false, BD_CLI_OPT_JSON},                                                       \
    {                                                                                              \
        "quiet", 'q', false, BD_CLI_OPT_QUIET                                                      \
    }

// Which of a frame's options a command has.
bool bd_cli_of_render(const struct bd_frame_option *option);
bool bd_cli_of_replay(const struct bd_frame_option *option);
bool bd_cli_of_reference(const struct bd_frame_option *option);

#define BD_CLI_TABLE_MAX 80
// A command's own options, which come first, and those of frames that it has.
void bd_cli_table_of(const struct bd_cli_option *own,
                     bool (*has)(const struct bd_frame_option *option),
                     struct bd_cli_option out[BD_CLI_TABLE_MAX]);

Bounced__FrameRequest *bd_cli_frame_new(void);
bool bd_cli_is_frame_option(int id);
// One that is; names the option and what it allows.
BD_MUST_CHECK
enum bd_err bd_cli_parse_frame_option(int id, const char *value, Bounced__FrameRequest *frame,
                                      struct bd_err_detail *detail);
// By its name.
BD_MUST_CHECK
enum bd_err bd_cli_set_frame_option(const char *name, const char *text,
                                    Bounced__FrameRequest *frame, struct bd_err_detail *detail);
// What options together allow, and what the picture's format decides.
BD_MUST_CHECK
enum bd_err bd_cli_check_frame(enum bd_cli_format format, Bounced__FrameRequest *frame,
                               struct bd_err_detail *detail);
// By the extension; "-" is PNG, NULL is none.
BD_MUST_CHECK
enum bd_err bd_cli_format_of(const char *path, enum bd_cli_format *out,
                             struct bd_err_detail *detail);

// True if `id` is one of the common options, which is then stored.
bool bd_cli_parse_common(int id, const char *value, struct bd_cli_common *out, bool *help);
BD_MUST_CHECK
enum bd_err bd_cli_check_common(const struct bd_cli_common *common, struct bd_err_detail *detail);

#endif
