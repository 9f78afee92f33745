// Results to files and to standard output. A file appears whole or not at all. Thread: main.

#ifndef BD_CLI_OUTPUT_H
#define BD_CLI_OUTPUT_H

#include <stddef.h>

#include "base/err.h"

// Whether a result could be put there, asked before the work is done: "-" must not be a terminal
// (BD_ERR_USAGE), a path's folder must be writable (BD_ERR_IO).
BD_MUST_CHECK
enum bd_err bd_cli_output_check(const char *path, struct bd_err_detail *detail);

// Writes beside `path` and renames over it; "-" and what is no regular file (a FIFO, /dev/null)
// are written to directly.
BD_MUST_CHECK
enum bd_err bd_cli_output_write(const char *path, const void *bytes, size_t size,
                                struct bd_err_detail *detail);

#endif
