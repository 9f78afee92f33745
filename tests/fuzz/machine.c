#include "tests/fuzz/machine.h"

#include <string.h>
#include <sys/random.h>
#include <time.h>

#define START_S 1000000000 // some time in 2001

static struct {
    bool is_on, is_frozen;
    uint64_t ms, random;
} machine;

void machine_begin(uint64_t seed)
{
    machine.is_on = true;
    machine.ms = 0;
    machine.random = seed;
}

void machine_end(void)
{
    machine.is_on = false;
}

void machine_freeze(bool is_frozen)
{
    machine.is_frozen = is_frozen;
}

void machine_pass_ms(uint64_t ms)
{
    machine.ms += ms;
}

uint64_t machine_now_ms(void)
{
    return machine.ms;
}

// --- what the linker puts in the place of the system's ----------------------------------------

int __real_clock_gettime(clockid_t clock, struct timespec *out);
int __wrap_clock_gettime(clockid_t clock, struct timespec *out);

int __wrap_clock_gettime(clockid_t clock, struct timespec *out)
{
    if (!machine.is_on || (clock == CLOCK_REALTIME && !machine.is_frozen))
        return __real_clock_gettime(clock, out);
    out->tv_sec = START_S + (time_t)(machine.ms / 1000);
    out->tv_nsec = (long)(machine.ms % 1000) * 1000000;
    return 0;
}

ssize_t __real_getrandom(void *out, size_t size, unsigned flags);
ssize_t __wrap_getrandom(void *out, size_t size, unsigned flags);

ssize_t __wrap_getrandom(void *out, size_t size, unsigned flags)
{
    if (!machine.is_on) return __real_getrandom(out, size, flags);
    uint8_t *bytes = out;
    for (size_t i = 0; i < size; i++) {
        machine.random = machine.random * 6364136223846793005u + 1442695040888963407u;
        bytes[i] = (uint8_t)(machine.random >> 56);
    }
    return (ssize_t)size;
}
