// The log: one line an event on stderr, as text or as JSON. Any thread; lines never interleave.
//
// Log once, where the cause is known. What a client did wrong goes to the client, and here only
// at debug level.

#ifndef BD_BASE_LOG_H
#define BD_BASE_LOG_H

#include <stdbool.h>

#include "base/err.h"

enum bd_log_level { BD_LOG_DEBUG, BD_LOG_INFO, BD_LOG_WARN, BD_LOG_ERROR };

// Call before the first thread starts. Default: text, info and above.
void bd_log_setup(enum bd_log_level least, bool json);

// `area` is the room or file that speaks: "gpu", "net/http".
void bd_log(enum bd_log_level level, const char *area, const char *format, ...) BD_PRINTF(3, 4);

#endif
