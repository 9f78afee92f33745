#include "base/priority.h"

#include <errno.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

// linux/ioprio.h, which not every set of headers has.
#define IOPRIO_WHO_PROCESS 1
#define IOPRIO_BEST_EFFORT 2
#define IOPRIO_CLASS_SHIFT 13
#define IOPRIO_LAST        7

void bd_priority_lower(void)
{
    const struct sched_param none = {0};
    // For Linux, 0 is the calling thread in all three.
    errno = 0;
    int nice = getpriority(PRIO_PROCESS, 0);
    if (errno == 0 && nice < BD_PRIORITY_LOW_NICE)
        (void)setpriority(PRIO_PROCESS, 0, BD_PRIORITY_LOW_NICE);
    if (sched_getscheduler(0) == SCHED_OTHER) (void)sched_setscheduler(0, SCHED_BATCH, &none);
    (void)syscall(SYS_ioprio_set, IOPRIO_WHO_PROCESS, 0,
                  IOPRIO_BEST_EFFORT << IOPRIO_CLASS_SHIFT | IOPRIO_LAST);
}
