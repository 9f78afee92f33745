// Parameters of a request on the wire, from "KEY=VALUE" words. Thread: main.

#ifndef BD_CLI_SETS_H
#define BD_CLI_SETS_H

#include "base/err.h"
#include "protocol/bounced.pb-c.h"

#define BD_CLI_SETS_MAX 48

// Holds pointers into itself: filled in place, never copied. Starts as {0}.
struct bd_cli_sets {
    size_t count;
    Bounced__KeyValue items[BD_CLI_SETS_MAX];
    Bounced__KeyValue *pointers[BD_CLI_SETS_MAX];
};

// `word` has an equals sign, and its key a name (clients/cli/options.h has checked that).
BD_MUST_CHECK
enum bd_err bd_cli_sets_add(struct bd_cli_sets *sets, const char *word, struct bd_fault *fault);
// Two words instead of one.
BD_MUST_CHECK
enum bd_err bd_cli_sets_add_pair(struct bd_cli_sets *sets, const char *key, const char *value,
                                 struct bd_fault *fault);
void bd_cli_sets_finish(struct bd_cli_sets *sets);

// The request borrows them.
void bd_cli_sets_fill(struct bd_cli_sets *sets, Bounced__FrameRequest *request);

#endif
