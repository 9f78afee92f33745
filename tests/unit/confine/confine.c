// What a confined process can still do and what it cannot, tried by one: each case in a child of
// its own.

#include <errno.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <pthread.h>
#include <sched.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/log.h"
#include "confine/confine.h"
#include "tests/unit/cmocka_all.h"

// The folder of all, and what is in it: data/, run/ for sockets, tokens/, outside/.
static char root[64];

static const char *in_root(const char *name)
{
    static char paths[4][256];
    static int next;
    char *path = paths[next++ % 4];
    snprintf(path, sizeof paths[0], "%s/%s", root, name);
    return path;
}

static int make_file(const char *name)
{
    int fd = open(in_root(name), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
    if (fd < 0) return errno;
    int bad = write(fd, "x", 1) == 1 ? 0 : errno;
    close(fd);
    return bad;
}

static int look_into(const char *name)
{
    int fd = open(in_root(name), O_RDONLY | O_CLOEXEC);
    if (fd < 0) return errno;
    close(fd);
    return 0;
}

static bool kernel_has_landlock(void)
{
    return syscall(SYS_landlock_create_ruleset, NULL, 0, 1) >= 1;
}

static void confine(enum bd_sandbox sandbox, bool software)
{
    char data[256], token_file[256], listened[256];
    snprintf(data, sizeof data, "%s", in_root("data"));
    snprintf(token_file, sizeof token_file, "%s", in_root("tokens/tokens"));
    snprintf(listened, sizeof listened, "%s", in_root("run/s.sock"));
    const char *sockets[] = {listened, NULL}, *again[] = {token_file, NULL};
    const struct bd_confine_paths paths = {
        .data = data, .data_is_temporary = true, .read_again = again, .sockets = sockets};
    struct bd_err_detail detail = {0};
    bd_confine_privileges();
    if (bd_confine_paths(sandbox, &paths, &detail) ||
        bd_confine_calls(sandbox, software, &detail)) {
        fprintf(stderr, "%s\n", detail.message);
        _exit(1);
    }
}

// Runs `body` in a child, after the confinement; what it returns is 0 if all was as it should be,
// else the line that was not.
static void in_child(int (*body)(void), enum bd_sandbox sandbox)
{
    if (sandbox == BD_SANDBOX_ON && !kernel_has_landlock()) skip();
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        confine(sandbox, true);
        int line = body();
        if (line) fprintf(stderr, "line %d\n", line);
        _exit(line ? 2 : 0);
    }
    int status = 0;
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFEXITED(status));
    assert_int_equal(WEXITSTATUS(status), 0);
}

#define WANT(condition)                                                                            \
    do {                                                                                           \
        if (!(condition)) return __LINE__;                                                         \
    } while (0)

// --- files --------------------------------------------------------------------------------------

static int files_in_and_outside(void)
{
    WANT(make_file("data/new") == 0);
    WANT(mkdir(in_root("data/folder"), 0700) == 0);
    WANT(rename(in_root("data/new"), in_root("data/folder/new")) == 0);
    WANT(truncate(in_root("data/folder/new"), 0) == 0);
    WANT(make_file("outside/new") == EACCES);
    WANT(make_file("outside/there") == EACCES);
    WANT(look_into("outside/there") == EACCES);
    WANT(truncate(in_root("outside/there"), 0) < 0);
    WANT(unlink(in_root("outside/there")) < 0 && errno == EACCES);
    WANT(mkdir(in_root("outside/folder"), 0700) < 0 && errno == EACCES);
    WANT(rename(in_root("data/folder/new"), in_root("outside/new")) < 0);
    WANT(symlink(in_root("outside/there"), in_root("data/link")) == 0);
    WANT(look_into("data/link") == EACCES);
    WANT(unlink(in_root("data/link")) == 0);
    WANT(unlink(in_root("data/folder/new")) == 0 && rmdir(in_root("data/folder")) == 0);
    // The folder itself, which is temporary; its neighbours' files stay.
    WANT(rmdir(in_root("data")) == 0);
    return 0;
}

static int what_the_daemon_needs(void)
{
    WANT(look_into("tokens/tokens") == 0);
    WANT(make_file("tokens/tokens") == EACCES);
    const char *const readable[] = {"/etc/passwd", "/proc/cpuinfo", "/proc/self/maps", "/sys",
                                    "/dev/null"};
    for (size_t i = 0; i < sizeof readable / sizeof readable[0]; i++) {
        int fd = open(readable[i], O_RDONLY | O_CLOEXEC);
        WANT(fd >= 0);
        close(fd);
    }
    return 0;
}

// --- sockets ------------------------------------------------------------------------------------

static int listen_at(const char *path)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    snprintf(address.sun_path, sizeof address.sun_path, "%s", path);
    int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (fd < 0) return errno;
    int bad = bind(fd, (const struct sockaddr *)&address, sizeof address) == 0 ? 0 : errno;
    close(fd);
    return bad;
}

static int connect_out(void)
{
    struct sockaddr_in address = {
        .sin_family = AF_INET, .sin_port = htons(9), .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (fd < 0) return errno;
    int bad = connect(fd, (const struct sockaddr *)&address, sizeof address) == 0 ? 0 : errno;
    close(fd);
    return bad;
}

static int sockets_of_our_own(void)
{
    WANT(listen_at(in_root("run/s.sock")) == 0);
    WANT(unlink(in_root("run/s.sock")) == 0);
    WANT(listen_at(in_root("outside/s.sock")) == EACCES);
    WANT(socket(AF_PACKET, SOCK_RAW, 0) < 0 && errno == ENOSYS);
    WANT(socket(AF_ALG, SOCK_SEQPACKET, 0) < 0 && errno == ENOSYS);
    // Version 4 and newer of Landlock has TCP too; what listens nobody minds.
    if (syscall(SYS_landlock_create_ruleset, NULL, 0, 1) >= 4) WANT(connect_out() == EACCES);
    return 0;
}

// --- calls --------------------------------------------------------------------------------------

static void *nothing(void *user)
{
    return user;
}

static int calls_that_are_left(void)
{
    pthread_t thread;
    WANT(pthread_create(&thread, NULL, nothing, NULL) == 0);
    WANT(pthread_join(thread, NULL) == 0);
    // A software renderer's code.
    void *code = mmap(NULL, 4096, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    WANT(code != MAP_FAILED && mprotect(code, 4096, PROT_READ | PROT_EXEC) == 0);
    // The import child is started so.
    char program[] = "/bin/true";
    char *words[] = {program, NULL};
    pid_t child;
    int status = -1;
    WANT(posix_spawn(&child, words[0], NULL, NULL, words, words + 1) == 0);
    WANT(waitpid(child, &status, 0) == child && status == 0);
    return 0;
}

static int calls_that_are_gone(void)
{
    static const long gone[] = {SYS_mount,
                                SYS_umount2,
                                SYS_unshare,
                                SYS_setns,
                                SYS_chroot,
                                SYS_bpf,
                                SYS_io_uring_setup,
                                SYS_userfaultfd,
                                SYS_keyctl,
                                SYS_add_key,
                                SYS_kexec_load,
                                SYS_init_module,
                                SYS_pivot_root,
                                SYS_reboot,
                                SYS_swapon,
                                SYS_setuid,
                                SYS_perf_event_open,
                                SYS_open_by_handle_at,
                                SYS_clone3,
                                SYS_sethostname,
                                SYS_settimeofday,
                                SYS_mknod,
                                SYS_acct};
    for (size_t i = 0; i < sizeof gone / sizeof gone[0]; i++) {
        errno = 0;
        long got = syscall(gone[i], 0, 0, 0, 0, 0);
        if (got != -1 || errno != ENOSYS) {
            fprintf(stderr, "call %ld: %ld, %s\n", gone[i], got, strerror(errno));
            return __LINE__;
        }
    }
    WANT(syscall(SYS_clone, CLONE_NEWUSER | 17, 0, 0, 0, 0) == -1 && errno == ENOSYS);
    return 0;
}

// --- how much of it -----------------------------------------------------------------------------

static int nothing_but_privileges(void)
{
    WANT(prctl(PR_GET_NO_NEW_PRIVS, 0, 0, 0, 0) == 1);
    WANT(prctl(PR_GET_SECCOMP, 0, 0, 0, 0) == 0);
    WANT(make_file("outside/new") == 0 && unlink(in_root("outside/new")) == 0);
    return 0;
}

static int privileges_and_filter(void)
{
    WANT(prctl(PR_GET_NO_NEW_PRIVS, 0, 0, 0, 0) == 1);
    WANT(prctl(PR_GET_SECCOMP, 0, 0, 0, 0) == 2);
    return 0;
}

static int calls_are_only_named(void)
{
    WANT(syscall(SYS_unshare, 0) == 0);
    return privileges_and_filter();
}

static void another_driver_is_not_filtered(void **state)
{
    (void)state;
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        confine(BD_SANDBOX_AUTO, false);
        _exit(prctl(PR_GET_SECCOMP, 0, 0, 0, 0));
    }
    int status = 0;
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFEXITED(status));
    assert_int_equal(WEXITSTATUS(status), 0);
}

#define CASE(name, sandbox)                                                                        \
    static void case_##name(void **state)                                                          \
    {                                                                                              \
        (void)state;                                                                               \
        in_child(name, sandbox);                                                                   \
    }
CASE(files_in_and_outside, BD_SANDBOX_ON)
CASE(what_the_daemon_needs, BD_SANDBOX_ON)
CASE(sockets_of_our_own, BD_SANDBOX_ON)
CASE(calls_that_are_left, BD_SANDBOX_ON)
CASE(calls_that_are_gone, BD_SANDBOX_ON)
CASE(nothing_but_privileges, BD_SANDBOX_OFF)
CASE(privileges_and_filter, BD_SANDBOX_AUTO)
CASE(calls_are_only_named, BD_SANDBOX_LOG)

static int make_root(void **state)
{
    (void)state;
    // Where no rule is: below neither a system's folder nor a driver's cache.
    snprintf(root, sizeof root, "/tmp/confine.XXXXXX");
    if (!mkdtemp(root)) return -1;
    static const char *const folders[] = {"data", "run", "tokens", "outside"};
    for (size_t i = 0; i < sizeof folders / sizeof folders[0]; i++)
        if (mkdir(in_root(folders[i]), 0700) < 0) return -1;
    return make_file("tokens/tokens") || make_file("outside/there");
}

static int remove_root(void **state)
{
    (void)state;
    char command[128];
    snprintf(command, sizeof command, "rm -r %s", root);
    return system(command);
}

int main(void)
{
    bd_log_setup(BD_LOG_ERROR, false);
#define TEST(name) cmocka_unit_test_setup_teardown(name, make_root, remove_root)
    const struct CMUnitTest tests[] = {
        TEST(case_files_in_and_outside),      TEST(case_what_the_daemon_needs),
        TEST(case_sockets_of_our_own),        TEST(case_calls_that_are_left),
        TEST(case_calls_that_are_gone),       TEST(case_nothing_but_privileges),
        TEST(case_privileges_and_filter),     TEST(case_calls_are_only_named),
        TEST(another_driver_is_not_filtered),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
