// Confinement of the daemon: after its start it can do what it needs for pictures, and little else.
//
// Thread: the main one, at the start; bd_confine_paths before any other thread starts.

#ifndef BD_CONFINE_CONFINE_H
#define BD_CONFINE_CONFINE_H

#include <stdbool.h>

#include "base/err.h"

enum bd_sandbox {
    BD_SANDBOX_AUTO, // as far as kernel and device allow; says what is missing
    BD_SANDBOX_ON,   // all of it, or no start
    BD_SANDBOX_OFF,  // no new privileges, and no more
    BD_SANDBOX_LOG,  // as on, but what the filter would refuse is done, and named in the kernel's
                     // log
};

// From here on no program that this process starts gains privileges by being started.
void bd_confine_privileges(void);

// What the daemon needs of the file system beside what every program may read.
struct bd_confine_paths {
    const char *data;              // made, changed and removed below it
    bool data_is_temporary;        // it is removed itself, too
    const char *const *read_again; // files that are read later too, perhaps others by then
    const char *const *sockets;    // files of Unix sockets, NULL at the end: made and removed
};

// Landlock. Without a kernel that has it: BD_ERR_UNSUPPORTED with ON, one line in the log with AUTO
// and LOG. Nothing with OFF.
BD_MUST_CHECK
enum bd_err bd_confine_paths(enum bd_sandbox sandbox, const struct bd_confine_paths *paths,
                             struct bd_err_detail *detail);

// The filter of system calls, for every thread there is. With AUTO for software devices alone: it
// was not tried with other drivers. Fails and speaks as above.
BD_MUST_CHECK
enum bd_err bd_confine_calls(enum bd_sandbox sandbox, bool device_is_software,
                             struct bd_err_detail *detail);

#endif
