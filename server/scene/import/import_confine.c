#include "scene/import/import_confine.h"

#include <errno.h>
#include <fcntl.h>
#include <seccomp.h>
#include <signal.h>
#include <stddef.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>

#include "base/sanitizer.h"

static void limit(int resource, uint64_t soft, uint64_t hard)
{
    setrlimit((__rlimit_resource_t)resource, &(struct rlimit){soft, hard});
}

// The sanitizer's shadow memory is larger than any limit of ours, so under it there is none. The
// wall clock is the parent's to watch.
void bd_import_set_limits(const struct bd_import_limits *limits)
{
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    limit(RLIMIT_CORE, 0, 0);
    limit(RLIMIT_CPU, limits->cpu_seconds, limits->cpu_seconds + 1);
    if (!BD_UNDER_SANITIZER) {
        limit(RLIMIT_DATA, limits->memory_bytes, limits->memory_bytes);
        limit(RLIMIT_NOFILE, 0, 0);
        limit(RLIMIT_STACK, 8 << 20, 8 << 20);
    }
}

// What is left: memory, the two descriptors, ending. The rest is refused and not fatal, since which
// harmless calls a libc makes (qsort asks for the size of the memory) changes with its version.
// New memory is never executable, and no memory becomes so.
bool bd_import_confine(void)
{
    static const int allowed[] = {
        SCMP_SYS(read),       SCMP_SYS(write),          SCMP_SYS(close),
        SCMP_SYS(munmap),     SCMP_SYS(mremap),         SCMP_SYS(madvise),
        SCMP_SYS(brk),        SCMP_SYS(futex),          SCMP_SYS(exit),
        SCMP_SYS(exit_group), SCMP_SYS(getrandom),      SCMP_SYS(rt_sigreturn),
        SCMP_SYS(sysinfo),    SCMP_SYS(rt_sigprocmask), SCMP_SYS(clock_gettime),
        SCMP_SYS(getpid),     SCMP_SYS(gettid),         SCMP_SYS(sched_yield)};
    // Without these, and reading files, a sanitizer's report has no names of functions.
    static const int for_reports[] = {
        SCMP_SYS(readlink),    SCMP_SYS(newfstatat), SCMP_SYS(fstat),       SCMP_SYS(lseek),
        SCMP_SYS(sigaltstack), SCMP_SYS(tgkill),     SCMP_SYS(rt_sigaction)};
    scmp_filter_ctx filter = seccomp_init(SCMP_ACT_ERRNO(EPERM));
    if (!filter) return false;
    // Threads that are there already decode as well.
    int bad = seccomp_attr_set(filter, SCMP_FLTATR_CTL_TSYNC, 1);
    for (size_t i = 0; i < sizeof allowed / sizeof allowed[0]; i++)
        bad |= seccomp_rule_add(filter, SCMP_ACT_ALLOW, allowed[i], 0);
    // Memory that is shared, or grows by itself, the kernel does not count for RLIMIT_DATA.
    bad |= seccomp_rule_add(filter, SCMP_ACT_ALLOW, SCMP_SYS(mmap), 2,
                            SCMP_A2(SCMP_CMP_MASKED_EQ, PROT_EXEC, 0),
                            SCMP_A3(SCMP_CMP_MASKED_EQ, MAP_SHARED | MAP_GROWSDOWN, 0));
    bad |= seccomp_rule_add(filter, SCMP_ACT_ALLOW, SCMP_SYS(mprotect), 1,
                            SCMP_A2(SCMP_CMP_MASKED_EQ, PROT_EXEC, 0));
    for (size_t i = 0; BD_UNDER_SANITIZER && i < sizeof for_reports / sizeof for_reports[0]; i++)
        bad |= seccomp_rule_add(filter, SCMP_ACT_ALLOW, for_reports[i], 0);
    if (BD_UNDER_SANITIZER)
        bad |= seccomp_rule_add(filter, SCMP_ACT_ALLOW, SCMP_SYS(openat), 1,
                                SCMP_A2(SCMP_CMP_MASKED_EQ, O_ACCMODE | O_CREAT, O_RDONLY));
    if (!bad) bad = seccomp_load(filter);
    seccomp_release(filter);
    return bad == 0;
}
