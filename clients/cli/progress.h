// What is going on, on standard error: one line that is rewritten on a terminal (a bar where the
// end is known), one line a stage elsewhere, nothing with --quiet. Thread: main.

#ifndef BD_CLI_PROGRESS_H
#define BD_CLI_PROGRESS_H

#include <stdbool.h>
#include <stdint.h>

struct bd_cli_progress {
    bool quiet, terminal;
    bool drawn; // the terminal's line holds something
    char stage[32];
    uint64_t start_ns;
};

void bd_cli_progress_init(struct bd_cli_progress *progress, bool quiet);
// A new stage: "import", "render".
void bd_cli_progress_stage(struct bd_cli_progress *progress, const char *stage);
// Redraws with the time since the stage began. Terminal only.
void bd_cli_progress_tick(struct bd_cli_progress *progress);
// Redraws with a bar that is filled to `share` (0 to 1) and a text of one's own behind it. Terminal
// only.
void bd_cli_progress_share(struct bd_cli_progress *progress, double share, const char *text);
// Redraws with a bar. Terminal only.
void bd_cli_progress_bar(struct bd_cli_progress *progress, uint64_t done, uint64_t total);
// Takes the line away; call before other output.
void bd_cli_progress_clear(struct bd_cli_progress *progress);

#endif
