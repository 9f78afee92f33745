// The report of `bounce reference`, put together from those of its pieces; and whether a file was
// made by the options of a plan. Thread: main.

#ifndef BD_CLI_REFERENCE_REPORT_H
#define BD_CLI_REFERENCE_REPORT_H

#include "base/err.h"
#include "clients/cli/reference_file.h"
#include "protocol/bounced.pb-c.h"

struct bd_cli_reference_report {
    Bounced__Report *sum; // owned
};

// Starts with the plan's, in case nothing is traced. Begin once; finish takes what never began.
BD_MUST_CHECK
enum bd_err bd_cli_reference_report_begin(struct bd_cli_reference_report *report,
                                          const Bounced__Report *plan,
                                          struct bd_err_detail *detail);
void bd_cli_reference_report_finish(struct bd_cli_reference_report *report);

// Adds a piece: its times to those before, its flags to those that are new.
BD_MUST_CHECK
enum bd_err bd_cli_reference_report_add(struct bd_cli_reference_report *report,
                                        const Bounced__Report *piece, struct bd_err_detail *detail);

// The whole as JSON with a final newline, for what `file` is; the caller frees it. NULL without
// memory.
char *bd_cli_reference_report_json(struct bd_cli_reference_report *report,
                                   const struct bd_cli_reference_file *file, const char *stopped);

// What a pass took, 0 if it did not run.
double bd_cli_reference_report_pass_ms(const Bounced__Report *report, const char *pass);

// BD_ERR_USAGE, with the first thing that differs, unless `file` (read from `path`) is of the same
// scene, size, region, seed and options, by the same build.
BD_MUST_CHECK
enum bd_err bd_cli_reference_report_match(const Bounced__Report *plan, const uint32_t region[4],
                                          const struct bd_cli_reference_file *file,
                                          const char *path, struct bd_err_detail *detail);

#endif
