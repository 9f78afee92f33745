// Reports and other answers for people and for programs. Thread: main.

#ifndef BD_CLI_REPORT_H
#define BD_CLI_REPORT_H

#include <protobuf-c/protobuf-c.h>
#include <stdio.h>

#include "base/err.h"
#include "protocol/bounced.pb-c.h"

// The message's JSON form, indented, with a final newline. The caller frees it; NULL without
// memory.
char *bd_cli_report_json(const ProtobufCMessage *message);

// A few lines: what was made, what it cost pass by pass, what was left out and why.
void bd_cli_report_print(const Bounced__Report *report, FILE *out);

// The flags, one line each.
void bd_cli_report_print_flags(const Bounced__Report *report, FILE *out);

#endif
