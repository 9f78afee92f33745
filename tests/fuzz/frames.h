// Stands in for the scheduler (sched/sched.h): a frame ends when it is told to, on the thread that
// says so. A frame of technique "fail" fails.

#ifndef BD_TESTS_FUZZ_FRAMES_H
#define BD_TESTS_FUZZ_FRAMES_H

#include <stdbool.h>

struct bd_sched;

// Ends the oldest job. False if there is none.
bool frames_end_one(struct bd_sched *sched);

#endif
