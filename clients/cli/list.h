// Commands that ask the daemon one thing and print the answer: devices, techniques, scenes.
//
// Thread: main.

#ifndef BD_CLI_LIST_H
#define BD_CLI_LIST_H

#include "clients/cli/conn.h"

struct bd_cli_list {
    enum bd_cli_conn_kind kind;
    Bounced__Envelope *request;
    Bounced__Envelope__BodyCase want;
    // The answer's body, for --json.
    const ProtobufCMessage *(*body)(const Bounced__Envelope *answer);
    void (*print)(const Bounced__Envelope *answer); // the same for people, on standard output
    int (*help)(void);
};

// Carries the command out: its words are the common options. Returns the exit code.
int bd_cli_list(const struct bd_cli_list *list, const char *const *words, int count);

// The message as JSON on standard output.
BD_MUST_CHECK
enum bd_err bd_cli_print_json(const ProtobufCMessage *message, struct bd_err_detail *detail);

#endif
