#include "clients/cli/progress.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/text.h"

#define BAR_CELLS 30

void bd_cli_progress_init(struct bd_cli_progress *progress, bool quiet)
{
    *progress = (struct bd_cli_progress){.quiet = quiet, .terminal = isatty(STDERR_FILENO) == 1};
}

void bd_cli_progress_stage(struct bd_cli_progress *progress, const char *stage)
{
    if (progress->quiet || strcmp(progress->stage, stage) == 0) return;
    snprintf(progress->stage, sizeof progress->stage, "%s", stage);
    bd_text_make_plain(progress->stage);
    progress->start_ns = bd_clock_ns();
    if (!progress->terminal) fprintf(stderr, "bounce: %s\n", progress->stage);
}

void bd_cli_progress_tick(struct bd_cli_progress *progress)
{
    if (progress->quiet || !progress->terminal || !progress->stage[0]) return;
    fprintf(stderr, "\r\033[K%s %.1f s", progress->stage, bd_ms_since(progress->start_ns) * 1e-3);
    fflush(stderr);
    progress->drawn = true;
}

void bd_cli_progress_share(struct bd_cli_progress *progress, double share, const char *text)
{
    if (progress->quiet || !progress->terminal) return;
    char cells[BAR_CELLS + 1];
    size_t filled = (size_t)(fmin(fmax(share, 0), 1) * BAR_CELLS);
    memset(cells, ' ', BAR_CELLS);
    memset(cells, '#', filled);
    cells[BAR_CELLS] = 0;
    fprintf(stderr, "\r\033[K%s [%s] %s", progress->stage, cells, text);
    fflush(stderr);
    progress->drawn = true;
}

void bd_cli_progress_bar(struct bd_cli_progress *progress, uint64_t done, uint64_t total)
{
    char text[64];
    if (total == 0) return;
    snprintf(text, sizeof text, "%.1f of %.1f MiB", (double)done * 0x1p-20,
             (double)total * 0x1p-20);
    bd_cli_progress_share(progress, (double)done / (double)total, text);
}

void bd_cli_progress_clear(struct bd_cli_progress *progress)
{
    if (progress->drawn) fputs("\r\033[K", stderr);
    progress->drawn = false;
}
