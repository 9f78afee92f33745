// Monotonic time. Any thread.

#ifndef BD_BASE_CLOCK_H
#define BD_BASE_CLOCK_H

#include <stdint.h>
#include <time.h>

static inline uint64_t bd_clock_ns(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000000u + (uint64_t)now.tv_nsec;
}

static inline double bd_ms_since(uint64_t start_ns)
{
    return (double)(bd_clock_ns() - start_ns) * 1e-6;
}

#endif
