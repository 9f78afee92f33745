// Lines for people. Thread: main.

#ifndef BD_CLI_PRINT_H
#define BD_CLI_PRINT_H

#include <jansson.h>
#include <stdbool.h>
#include <stdio.h>

#include "base/err.h"

// As fprintf, for a piece of a line with names, messages and other words that users of the daemon
// or writers of files have chosen: what comes out is plain (base/text.h), so that they can neither
// command the terminal nor make up lines. The line's end is the caller's, by putc.
void bd_cli_print(FILE *out, const char *format, ...) BD_PRINTF(2, 3);

// The whole line.
void bd_cli_print_line(FILE *out, const char *format, ...) BD_PRINTF(2, 3);

// As json_dumpf, with escapes for what would not be plain, and a line's end. False only without
// memory.
bool bd_cli_print_json_line(FILE *out, const json_t *json, size_t flags);

#endif
