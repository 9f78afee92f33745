// Time and chance of a process that is fuzzed: the same input, the same run.
//
// Programs that use this are linked with --wrap=clock_gettime and --wrap=getrandom. Between
// machine_begin and machine_end the monotonic clock stands still but for machine_pass_ms, and
// random bytes are always the same ones. The calendar stays as it is (libFuzzer finds by it inputs
// that take too long), unless the machine is frozen.

#ifndef BD_TESTS_FUZZ_MACHINE_H
#define BD_TESTS_FUZZ_MACHINE_H

#include <stdbool.h>
#include <stdint.h>

// Other seeds, other chances.
void machine_begin(uint64_t seed);
void machine_end(void);

// The calendar too: for files that are made at the start of the process.
void machine_freeze(bool is_frozen);

void machine_pass_ms(uint64_t ms);
uint64_t machine_now_ms(void);

#endif
