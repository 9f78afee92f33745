// A frame, asked for as the command line says. Thread: main.

#ifndef BD_CLI_FRAME_H
#define BD_CLI_FRAME_H

#include "base/err.h"
#include "clients/cli/conn.h"
#include "clients/cli/options.h"
#include "clients/cli/progress.h"

// Fills `render`, which names its scene already, with the frame of `options`, and waits for the
// RenderReply; progress is asked for unless --quiet. Finish `*answer` either way.
BD_MUST_CHECK
enum bd_err bd_cli_frame_ask(struct bd_cli_conn *conn, Bounced__Render *render,
                             const struct bd_cli_render *options, struct bd_cli_progress *progress,
                             struct bd_cli_answer *answer, struct bd_err_detail *detail);

#endif
