// Work that must not be in the way: imports of scenes, beside frames and the loop.
//
// Linux only. What is lowered stays lowered, since raising again takes rights that a daemon should
// not have (SCHED_IDLE could not be left either without them): lower a thread, or a process, that
// ends with its work.

#ifndef BD_BASE_PRIORITY_H
#define BD_BASE_PRIORITY_H

// A tenth of the processor's share of a thread that is not lowered, where both want it: enough to
// end within the limits of an import on a machine that renders all day, which the lowest (nice 19,
// SCHED_IDLE) would not be.
#define BD_PRIORITY_LOW_NICE 10

// The calling thread, and whatever threads and processes it starts: nice of at least the above,
// SCHED_BATCH (it does not interrupt others when it wakes), the last of the disk's ordinary queue.
// A system that refuses is left as it is: a wish, as any priority.
void bd_priority_lower(void);

#endif
