// Ctrl-C: the first asks for an orderly end, the second ends everything at once.
//
// Thread: main; the handler touches nothing but a counter, a pipe and two system calls.

#ifndef BD_CLI_INTERRUPT_H
#define BD_CLI_INTERRUPT_H

#include <stdbool.h>
#include <sys/types.h>

#define BD_EXIT_INTERRUPTED 130

// Catches SIGINT and SIGTERM from now on.
void bd_interrupt_setup(void);
// The process that a second signal kills too; 0 for none.
void bd_interrupt_set_child(pid_t child);
// True once a signal came.
bool bd_interrupted(void);
// Becomes readable, and stays so, once a signal came: for poll.
int bd_interrupt_fd(void);

#endif
