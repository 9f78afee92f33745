// A test that is ended from outside, because it took too long, says where each of its threads is.
//
// Linked into every test in C. What was printed before is there too: a line is written when it is
// whole, and not when the program ends.

#include <dirent.h>
#include <execinfo.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#define FRAMES_MAX 48
#define ASK        SIGUSR2

static volatile sig_atomic_t answered;

static void answer(int signal)
{
    (void)signal;
    void *frames[FRAMES_MAX];
    backtrace_symbols_fd(frames, backtrace(frames, FRAMES_MAX), STDERR_FILENO);
    answered = 1;
}

// A thread that blocks every signal is passed over.
static void ask(pid_t thread)
{
    dprintf(STDERR_FILENO, "thread %d\n", (int)thread);
    answered = 0;
    if (syscall(SYS_tgkill, getpid(), thread, ASK) != 0) return;
    for (int i = 0; i < 100 && !answered; i++)
        nanosleep(&(struct timespec){.tv_nsec = 5000000}, NULL);
}

static void say_where(int signal_number)
{
    DIR *threads = opendir("/proc/self/task");
    for (struct dirent *one; threads && (one = readdir(threads));)
        if (one->d_name[0] != '.') ask((pid_t)atoi(one->d_name));
    signal(signal_number, SIG_DFL);
    raise(signal_number);
}

__attribute__((constructor)) static void listen_for_the_end(void)
{
    void *frame;
    backtrace(&frame, 1); // loads what it needs, which a handler must not
    setvbuf(stdout, NULL, _IOLBF, 0);
    // Its own thread may be asked while it asks.
    sigaction(ASK, &(struct sigaction){.sa_handler = answer, .sa_flags = SA_NODEFER}, NULL);
    sigaction(SIGTERM, &(struct sigaction){.sa_handler = say_where}, NULL);
}
