// What the daemon's loop leaves to threads, children and real time, done on one thread, when the
// input says so.
//
// Programs that use this are linked with --wrap for each of the functions in pool.c. A piece of
// work runs, and later comes back to the loop, one at a time, oldest first; timers fire when the
// clock (machine.h) is moved past them; glTF is read in this process.

#ifndef BD_TESTS_FUZZ_POOL_H
#define BD_TESTS_FUZZ_POOL_H

#include <stdbool.h>
#include <stdint.h>

// Nothing is left over from before: to be called first.
void pool_begin(void);

// False if there was none.
bool pool_run_one(void);
bool pool_return_one(void);

// Moves the clock and fires the timers that are due, in order.
void pool_pass_ms(uint64_t ms);

// How much work is under way, in one stage or the other.
uint32_t pool_count(void);

#endif
