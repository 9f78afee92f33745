#include "clients/cli/interrupt.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <unistd.h>

static volatile sig_atomic_t signal_count;
static volatile pid_t child_pid;
static int pipe_fds[2] = {-1, -1};

static void on_signal(int number)
{
    (void)number;
    int saved_errno = errno;
    if (++signal_count > 1) {
        if (child_pid > 0) kill(child_pid, SIGKILL);
        _exit(BD_EXIT_INTERRUPTED);
    }
    ssize_t written = write(pipe_fds[1], "", 1);
    (void)written;
    errno = saved_errno;
}

void bd_interrupt_setup(void)
{
    if (pipe2(pipe_fds, O_CLOEXEC | O_NONBLOCK)) abort(); // no descriptors at start: hopeless
    struct sigaction action = {.sa_handler = on_signal};
    sigemptyset(&action.sa_mask);
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
}

void bd_interrupt_set_child(pid_t child)
{
    child_pid = child;
}

bool bd_interrupted(void)
{
    return signal_count > 0;
}

int bd_interrupt_fd(void)
{
    return pipe_fds[0];
}
