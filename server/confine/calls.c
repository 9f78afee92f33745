// The system calls that are left once the daemon is up. What is not here says ENOSYS.

#include <errno.h>
#include <linux/sched.h>
#include <seccomp.h>
#include <stddef.h>
#include <string.h>
#include <sys/socket.h>

#include "base/log.h"
#include "base/sanitizer.h"
#include "confine/confine.h"

// New namespaces are the way to most of the kernel that nobody needs for pictures.
#define NEW_NAMESPACES                                                                             \
    (CLONE_NEWNS | CLONE_NEWCGROUP | CLONE_NEWUTS | CLONE_NEWIPC | CLONE_NEWUSER | CLONE_NEWPID |  \
     CLONE_NEWNET)

// By what they are for. Those of a kind that came later or earlier than what our libraries use
// today stand beside them: other versions of the same libraries use those.
static const int memory[] = {SCMP_SYS(brk),          SCMP_SYS(madvise),   SCMP_SYS(membarrier),
                             SCMP_SYS(memfd_create), SCMP_SYS(mincore),   SCMP_SYS(mlock),
                             SCMP_SYS(mlock2),       SCMP_SYS(mmap),      SCMP_SYS(mprotect),
                             SCMP_SYS(mremap),       SCMP_SYS(msync),     SCMP_SYS(munlock),
                             SCMP_SYS(munmap),       SCMP_SYS(mbind),     SCMP_SYS(get_mempolicy),
                             SCMP_SYS(pkey_alloc),   SCMP_SYS(pkey_free), SCMP_SYS(pkey_mprotect)};
static const int threads[] = {SCMP_SYS(arch_prctl),
                              SCMP_SYS(exit),
                              SCMP_SYS(exit_group),
                              SCMP_SYS(futex),
                              SCMP_SYS(get_robust_list),
                              SCMP_SYS(getcpu),
                              SCMP_SYS(getpriority),
                              SCMP_SYS(gettid),
                              SCMP_SYS(ioprio_get),
                              SCMP_SYS(ioprio_set),
                              SCMP_SYS(prctl),
                              SCMP_SYS(rseq),
                              SCMP_SYS(sched_get_priority_max),
                              SCMP_SYS(sched_get_priority_min),
                              SCMP_SYS(sched_getaffinity),
                              SCMP_SYS(sched_getattr),
                              SCMP_SYS(sched_getparam),
                              SCMP_SYS(sched_getscheduler),
                              SCMP_SYS(sched_setaffinity),
                              SCMP_SYS(sched_setattr),
                              SCMP_SYS(sched_setparam),
                              SCMP_SYS(sched_setscheduler),
                              SCMP_SYS(sched_yield),
                              SCMP_SYS(set_robust_list),
                              SCMP_SYS(set_tid_address),
                              SCMP_SYS(setpriority)};
static const int signals[] = {
    SCMP_SYS(kill),         SCMP_SYS(pause),         SCMP_SYS(restart_syscall),
    SCMP_SYS(rt_sigaction), SCMP_SYS(rt_sigpending), SCMP_SYS(rt_sigprocmask),
    SCMP_SYS(rt_sigreturn), SCMP_SYS(rt_sigsuspend), SCMP_SYS(rt_sigtimedwait),
    SCMP_SYS(sigaltstack),  SCMP_SYS(signalfd4),     SCMP_SYS(tgkill)};
static const int files[] = {SCMP_SYS(access),
                            SCMP_SYS(chmod),
                            SCMP_SYS(chown),
                            SCMP_SYS(close),
                            SCMP_SYS(close_range),
                            SCMP_SYS(copy_file_range),
                            SCMP_SYS(dup),
                            SCMP_SYS(dup2),
                            SCMP_SYS(dup3),
                            SCMP_SYS(faccessat),
                            SCMP_SYS(faccessat2),
                            SCMP_SYS(fadvise64),
                            SCMP_SYS(fallocate),
                            SCMP_SYS(fchdir),
                            SCMP_SYS(fchmod),
                            SCMP_SYS(fchmodat),
                            SCMP_SYS(fchown),
                            SCMP_SYS(fchownat),
                            SCMP_SYS(fcntl),
                            SCMP_SYS(fdatasync),
                            SCMP_SYS(flock),
                            SCMP_SYS(fstat),
                            SCMP_SYS(fstatfs),
                            SCMP_SYS(fsync),
                            SCMP_SYS(ftruncate),
                            SCMP_SYS(getcwd),
                            SCMP_SYS(getdents64),
                            SCMP_SYS(ioctl),
                            SCMP_SYS(lchown),
                            SCMP_SYS(link),
                            SCMP_SYS(linkat),
                            SCMP_SYS(lseek),
                            SCMP_SYS(lstat),
                            SCMP_SYS(mkdir),
                            SCMP_SYS(mkdirat),
                            SCMP_SYS(newfstatat),
                            SCMP_SYS(open),
                            SCMP_SYS(openat),
                            SCMP_SYS(openat2),
                            SCMP_SYS(pread64),
                            SCMP_SYS(preadv),
                            SCMP_SYS(preadv2),
                            SCMP_SYS(pwrite64),
                            SCMP_SYS(pwritev),
                            SCMP_SYS(pwritev2),
                            SCMP_SYS(read),
                            SCMP_SYS(readahead),
                            SCMP_SYS(readlink),
                            SCMP_SYS(readlinkat),
                            SCMP_SYS(readv),
                            SCMP_SYS(rename),
                            SCMP_SYS(renameat),
                            SCMP_SYS(renameat2),
                            SCMP_SYS(rmdir),
                            SCMP_SYS(sendfile),
                            SCMP_SYS(stat),
                            SCMP_SYS(statfs),
                            SCMP_SYS(statx),
                            SCMP_SYS(symlink),
                            SCMP_SYS(symlinkat),
                            SCMP_SYS(sync_file_range),
                            SCMP_SYS(truncate),
                            SCMP_SYS(umask),
                            SCMP_SYS(unlink),
                            SCMP_SYS(unlinkat),
                            SCMP_SYS(utimensat),
                            SCMP_SYS(write),
                            SCMP_SYS(writev)};
static const int sockets[] = {
    SCMP_SYS(accept),      SCMP_SYS(accept4),     SCMP_SYS(bind),       SCMP_SYS(connect),
    SCMP_SYS(getpeername), SCMP_SYS(getsockname), SCMP_SYS(getsockopt), SCMP_SYS(listen),
    SCMP_SYS(recvfrom),    SCMP_SYS(recvmmsg),    SCMP_SYS(recvmsg),    SCMP_SYS(sendmmsg),
    SCMP_SYS(sendmsg),     SCMP_SYS(sendto),      SCMP_SYS(setsockopt), SCMP_SYS(shutdown)};
static const int waiting[] = {SCMP_SYS(clock_getres),
                              SCMP_SYS(clock_gettime),
                              SCMP_SYS(clock_nanosleep),
                              SCMP_SYS(epoll_create),
                              SCMP_SYS(epoll_create1),
                              SCMP_SYS(epoll_ctl),
                              SCMP_SYS(epoll_pwait),
                              SCMP_SYS(epoll_pwait2),
                              SCMP_SYS(epoll_wait),
                              SCMP_SYS(eventfd2),
                              SCMP_SYS(getitimer),
                              SCMP_SYS(gettimeofday),
                              SCMP_SYS(nanosleep),
                              SCMP_SYS(pipe),
                              SCMP_SYS(pipe2),
                              SCMP_SYS(poll),
                              SCMP_SYS(ppoll),
                              SCMP_SYS(pselect6),
                              SCMP_SYS(select),
                              SCMP_SYS(setitimer),
                              SCMP_SYS(time),
                              SCMP_SYS(timer_create),
                              SCMP_SYS(timer_delete),
                              SCMP_SYS(timer_settime),
                              SCMP_SYS(timerfd_create),
                              SCMP_SYS(timerfd_settime),
                              SCMP_SYS(times)};
// The import child is this program, started anew; it confines itself further, and is waited for.
static const int processes[] = {SCMP_SYS(execve),
                                SCMP_SYS(getegid),
                                SCMP_SYS(geteuid),
                                SCMP_SYS(getgid),
                                SCMP_SYS(getgroups),
                                SCMP_SYS(getpgrp),
                                SCMP_SYS(getpid),
                                SCMP_SYS(getppid),
                                SCMP_SYS(getrandom),
                                SCMP_SYS(getresgid),
                                SCMP_SYS(getresuid),
                                SCMP_SYS(getrlimit),
                                SCMP_SYS(getrusage),
                                SCMP_SYS(getuid),
                                SCMP_SYS(landlock_add_rule),
                                SCMP_SYS(landlock_create_ruleset),
                                SCMP_SYS(landlock_restrict_self),
                                SCMP_SYS(pidfd_open),
                                SCMP_SYS(pidfd_send_signal),
                                SCMP_SYS(prlimit64),
                                SCMP_SYS(seccomp),
                                SCMP_SYS(setrlimit),
                                SCMP_SYS(sysinfo),
                                SCMP_SYS(uname),
                                SCMP_SYS(vfork),
                                SCMP_SYS(wait4),
                                SCMP_SYS(waitid)};
// How the leak sanitizer looks at the other threads at the end, and reports get their names.
static const int for_sanitizers[] = {SCMP_SYS(fork), SCMP_SYS(getdents), SCMP_SYS(ptrace),
                                     SCMP_SYS(process_vm_readv), SCMP_SYS(personality)};

#define GROUP(calls)                                                                               \
    {                                                                                              \
        calls, sizeof(calls) / sizeof((calls)[0])                                                  \
    }
static const struct {
    const int *calls;
    size_t count;
} groups[] = {GROUP(memory),  GROUP(threads), GROUP(signals),  GROUP(files),
              GROUP(sockets), GROUP(waiting), GROUP(processes)};

static int allow_sockets(scmp_filter_ctx filter)
{
    // Ours; a driver's way to its service; the C library's to names and numbers of interfaces.
    static const int families[] = {AF_UNIX, AF_INET, AF_INET6, AF_NETLINK};
    int bad = 0;
    for (size_t i = 0; i < sizeof families / sizeof families[0]; i++) {
        const struct scmp_arg_cmp family = {
            .arg = 0, .op = SCMP_CMP_EQ, .datum_a = (scmp_datum_t)families[i]};
        bad |= seccomp_rule_add(filter, SCMP_ACT_ALLOW, SCMP_SYS(socket), 1, family);
    }
    const struct scmp_arg_cmp local = {.arg = 0, .op = SCMP_CMP_EQ, .datum_a = AF_UNIX};
    return bad | seccomp_rule_add(filter, SCMP_ACT_ALLOW, SCMP_SYS(socketpair), 1, local);
}

static int allow_all(scmp_filter_ctx filter)
{
    int bad = 0;
    for (size_t g = 0; g < sizeof groups / sizeof groups[0]; g++)
        for (size_t i = 0; i < groups[g].count; i++)
            bad |= seccomp_rule_add(filter, SCMP_ACT_ALLOW, groups[g].calls[i], 0);
    const size_t extra = sizeof for_sanitizers / sizeof for_sanitizers[0];
    for (size_t i = 0; BD_UNDER_SANITIZER && i < extra; i++)
        bad |= seccomp_rule_add(filter, SCMP_ACT_ALLOW, for_sanitizers[i], 0);
    const struct scmp_arg_cmp plain = SCMP_A0(SCMP_CMP_MASKED_EQ, NEW_NAMESPACES, 0);
    bad |= seccomp_rule_add(filter, SCMP_ACT_ALLOW, SCMP_SYS(clone), 1, plain);
    return bad | allow_sockets(filter);
}

// 0, or a negated errno.
static int load(uint32_t otherwise)
{
    scmp_filter_ctx filter = seccomp_init(otherwise);
    if (!filter) return -ENOMEM;
    int bad = seccomp_attr_set(filter, SCMP_FLTATR_CTL_TSYNC, 1);
    // A call costs a few comparisons, not one for each row.
    if (!bad) bad = seccomp_attr_set(filter, SCMP_FLTATR_CTL_OPTIMIZE, 2);
    if (!bad) bad = allow_all(filter);
    if (!bad) bad = seccomp_load(filter);
    seccomp_release(filter);
    return bad;
}

enum bd_err bd_confine_calls(enum bd_sandbox sandbox, bool device_is_software,
                             struct bd_err_detail *detail)
{
    if (sandbox == BD_SANDBOX_OFF) return BD_ERR_OK;
    if (sandbox == BD_SANDBOX_AUTO && !device_is_software) {
        bd_log(BD_LOG_INFO, "confine",
               "no filter of system calls: not tried with this driver; "
               "--sandbox on has it all the same");
        return BD_ERR_OK;
    }
    int bad = load(sandbox == BD_SANDBOX_LOG ? SCMP_ACT_LOG : SCMP_ACT_ERRNO(ENOSYS));
    if (!bad) return BD_ERR_OK;
    if (sandbox == BD_SANDBOX_ON)
        return bd_err_set(detail, BD_ERR_UNSUPPORTED, "sandbox",
                          "the kernel takes no filter of system calls: %s", strerror(-bad));
    bd_log(BD_LOG_WARN, "confine", "no filter of system calls: %s", strerror(-bad));
    return BD_ERR_OK;
}
