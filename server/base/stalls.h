// How long a thread that others wait for did not look at what else there is to do: a histogram
// since the start, and the longest of late.
//
// Not locked. A few words; adding one costs some nanoseconds.

#ifndef BD_BASE_STALLS_H
#define BD_BASE_STALLS_H

#include <stdint.h>

#define BD_STALLS_BUCKET_COUNT 10
// The longest of late is that of this window and of the one before.
#define BD_STALLS_WINDOW_S 60

// Upper ends of the buckets; what is longer than the last is counted behind it.
extern const double bd_stalls_bucket_s[BD_STALLS_BUCKET_COUNT];

struct bd_stalls {
    uint64_t counts[BD_STALLS_BUCKET_COUNT + 1];
    double total_s;
    uint64_t window;     // its number since the clock began
    double longest_s[2]; // of that window, and of the one before
};

void bd_stalls_add(struct bd_stalls *stalls, uint64_t now_ns, uint64_t stall_ns);

// The longest of the last one to two windows; 0 if there was none.
double bd_stalls_longest_s(const struct bd_stalls *stalls, uint64_t now_ns);

#endif
