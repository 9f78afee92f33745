// libuv closes its descriptors by syscall(SYS_close), which the thread sanitizer does not see: when
// the system gives the same number to somebody else, it takes the two for one and tells of a race.
// In front of libc's, this syscall() closes by close(), which it does see. Linked into what is built
// with that sanitizer only.

#include <dlfcn.h>
#include <stdarg.h>
#include <sys/syscall.h>
#include <unistd.h>

typedef long (*syscall_function)(long number, ...);

static syscall_function next;

__attribute__((constructor)) static void find_next(void)
{
    *(void **)&next = dlsym(RTLD_NEXT, "syscall");
}

long syscall(long number, ...)
{
    va_list list;
    long a[6];
    va_start(list, number);
    for (int i = 0; i < 6; i++) a[i] = va_arg(list, long);
    va_end(list);
    if (number == SYS_close) return close((int)a[0]);
    if (!next) find_next(); // before constructors ran, there is one thread
    return next(number, a[0], a[1], a[2], a[3], a[4], a[5]);
}

// A daemon's imports are confined, and end where they are to read a file of suppressions: what a daemon
// without a renderer needs of suppressions.txt, which is there for its reason, is built in.
const char *__tsan_default_suppressions(void);
const char *__tsan_default_suppressions(void)
{
    return "race:libEGL_mesa.so.0\n";
}
