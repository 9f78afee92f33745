// bin/bounced and bin/bounce of a bundle: picks the C++ runtime and starts the program of its own
// name in libexec/.
//
// The host's graphics driver may be C++ too (Mesa's LLVM), and newer than we are. One process has
// one libstdc++.so.6: with ours loaded first, such a driver would not load. So the host's runtime
// is taken where it is complete and at least as new, ours from lib/runtime elsewhere.
//
// BD_RUNTIME_SYMBOL and BD_RUNTIME_VERSION: a symbol of our libstdc++ that came with its newest
// version.

#include <dlfcn.h>
#include <limits.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static bool host_runtime_serves(void)
{
    void *cxx = dlopen("libstdc++.so.6", RTLD_LAZY);
    return cxx && dlvsym(cxx, BD_RUNTIME_SYMBOL, BD_RUNTIME_VERSION) &&
           dlopen("libgcc_s.so.1", RTLD_LAZY) && dlopen("libz.so.1", RTLD_LAZY);
}

// Appended: what the user has put there comes first.
static void use_own_runtime(const char *root)
{
    const char *given = getenv("LD_LIBRARY_PATH");
    char value[2 * PATH_MAX];
    snprintf(value, sizeof value, "%s%s%s/lib/runtime", given ? given : "",
             given && *given ? ":" : "", root);
    setenv("LD_LIBRARY_PATH", value, 1);
}

int main(int argc, char **argv)
{
    (void)argc;
    char self[PATH_MAX], program[2 * PATH_MAX];
    ssize_t length = readlink("/proc/self/exe", self, sizeof self - 1);
    if (length <= 0) {
        perror("/proc/self/exe");
        return 6;
    }
    self[length] = 0;
    char *name = strrchr(self, '/');
    *name++ = 0;
    char *bin = strrchr(self, '/');
    if (bin) *bin = 0; // self is the bundle's root now
    if (!host_runtime_serves()) use_own_runtime(self);
    snprintf(program, sizeof program, "%s/libexec/%s", self, name);
    execv(program, argv);
    perror(program);
    return 6;
}
