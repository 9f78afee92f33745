// The private daemon's half of transport.h: finding it, starting it, seeing it off.

#include <errno.h>
#include <fcntl.h>
#include <libgen.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "clients/cli/transport.h"

#define PRIVATE_FD 3

static bool is_executable(const char *path)
{
    return access(path, X_OK) == 0;
}

// Beside our own executable (installed, bundled), or where the build tree puts it.
static bool find_near(char *path)
{
    static const char *const places[] = {"bounced", "../../server/bounced"};
    char self[BD_TRANSPORT_PATH_BYTES];
    ssize_t length = readlink("/proc/self/exe", self, sizeof self - 1);
    if (length <= 0) return false;
    self[length] = 0;
    const char *folder = dirname(self);
    for (size_t i = 0; i < sizeof places / sizeof places[0]; i++) {
        int wrote = snprintf(path, BD_TRANSPORT_PATH_BYTES, "%s/%s", folder, places[i]);
        if (wrote < BD_TRANSPORT_PATH_BYTES && is_executable(path)) return true;
    }
    return false;
}

static bool find_on_path(char *path)
{
    const char *rest = getenv("PATH");
    while (rest && *rest) {
        size_t length = strcspn(rest, ":");
        int wrote = snprintf(path, BD_TRANSPORT_PATH_BYTES, "%.*s/bounced", (int)length, rest);
        if (length && wrote < BD_TRANSPORT_PATH_BYTES && is_executable(path)) return true;
        rest += length + (rest[length] == ':');
    }
    return false;
}

enum bd_err bd_transport_find_daemon(char path[BD_TRANSPORT_PATH_BYTES],
                                     struct bd_err_detail *detail)
{
    const char *named = getenv("BOUNCED");
    if (named && *named) {
        snprintf(path, BD_TRANSPORT_PATH_BYTES, "%s", named);
        if (is_executable(path)) return BD_ERR_OK;
        return bd_err_set(detail, BD_ERR_UNREACHABLE, "BOUNCED", "$BOUNCED, %.200s: %s", named,
                          strerror(errno));
    }
    if (find_near(path) || find_on_path(path)) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_UNREACHABLE, "server",
                      "no daemon is running, and no bounced to start one lies beside this "
                      "program or on PATH; name it by $BOUNCED");
}

// In the child, between fork and exec: nothing that another thread or a buffer could disturb.
static void become_daemon(const char *path, const struct bd_private_options *options, int fd)
{
    setpgid(0, 0);
    int null_fd = open("/dev/null", O_RDONLY);
    if (null_fd >= 0) dup2(null_fd, STDIN_FILENO);
    dup2(STDERR_FILENO, STDOUT_FILENO); // our standard output is for results
    if (fd == PRIVATE_FD)
        fcntl(fd, F_SETFD, 0);
    else
        dup2(fd, PRIVATE_FD);
    // Its one client asks for large answers on purpose: a reference of 4K pixels is 1.8 GB.
    const char *argv[] = {"bounced",
                          "--private",
                          "3",
                          "--limit",
                          "reply_bytes=4294967295",
                          "--log",
                          options->quiet ? "errors" : "text",
                          "--code",
                          options->quick_code ? "quick" : "fast",
                          options->device ? "--device" : NULL,
                          options->device,
                          NULL};
    execv(path, (char *const *)argv);
    _exit(127);
}

enum bd_err bd_transport_start_private(const struct bd_private_options *options, int *fd,
                                       pid_t *child, struct bd_err_detail *detail)
{
    char path[BD_TRANSPORT_PATH_BYTES];
    enum bd_err err = bd_transport_find_daemon(path, detail);
    if (err) return err;
    int pair[2];
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair))
        return bd_err_set(detail, BD_ERR_UNREACHABLE, "server", "no socket pair: %s",
                          strerror(errno));
    *child = fork();
    if (*child == 0) become_daemon(path, options, pair[1]);
    close(pair[1]);
    *fd = pair[0];
    if (*child > 0) return BD_ERR_OK;
    close(pair[0]);
    return bd_err_set(detail, BD_ERR_UNREACHABLE, "server", "cannot start %.200s: %s", path,
                      strerror(errno));
}

// True once `child` ended, within `limit_ms`.
static bool wait_for(pid_t child, int limit_ms, int *status)
{
    const struct timespec pause = {.tv_nsec = 2000000};
    for (int waited_ms = 0;; waited_ms += 2) {
        pid_t rv = waitpid(child, status, WNOHANG);
        if (rv == child) return true;
        if (rv < 0 && errno != EINTR) return true; // not ours any more: nothing to wait for
        if (waited_ms >= limit_ms) return false;
        nanosleep(&pause, NULL);
    }
}

int bd_transport_reap(pid_t child, int patience_ms)
{
    int status = 0;
    if (wait_for(child, patience_ms, &status)) return status;
    kill(child, SIGTERM);
    if (wait_for(child, 2000, &status)) return status;
    kill(child, SIGKILL);
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) continue;
    return status;
}
