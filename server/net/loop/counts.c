// What the daemon counts.

#include "net/loop/counts.h"

#include <stdio.h>
#include <string.h>

#include "frame/report.h"

static void count_pass(struct bd_counts *counts, const char *name, double ms, bool ran)
{
    uint32_t i = 0;
    while (i < counts->pass_count && strcmp(counts->passes[i].name, name) != 0) i++;
    if (i == BD_COUNTS_PASS_MAX) return; // the list of names is fixed and shorter
    if (i == counts->pass_count)
        snprintf(counts->passes[counts->pass_count++].name, sizeof counts->passes[i].name, "%s",
                 name);
    counts->passes[i].seconds += ms * 1e-3;
    counts->passes[i].ran += ran;
    counts->passes[i].reused += !ran;
}

void bd_counts_frame(struct bd_counts *counts, const struct bd_report *report)
{
    counts->frames++;
    for (uint32_t i = 0; i < report->pass_count; i++)
        if (report->passes[i].state != BD_PASS_PLANNED)
            count_pass(counts, report->passes[i].name, report->passes[i].ms,
                       report->passes[i].state == BD_PASS_RAN);
}
