// `bounce stability` and `bounce bench`: commands written in Python (clients/harness/). This file
// finds the package and becomes its interpreter, so that Ctrl-C and the exit code are the package's
// own.

#include <errno.h>
#include <libgen.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "clients/cli/commands.h"
#include "clients/cli/transport.h"

#define PATH_BYTES   BD_TRANSPORT_PATH_BYTES
#define ARGUMENT_MAX 256

static bool is_package(const char *folder)
{
    char path[PATH_BYTES];
    int length = snprintf(path, sizeof path, "%s/__main__.py", folder);
    return length < PATH_BYTES && access(path, R_OK) == 0;
}

static bool find_self(char *path)
{
    ssize_t length = readlink("/proc/self/exe", path, PATH_BYTES - 1);
    if (length <= 0) return false;
    path[length] = 0;
    return true;
}

// Installed or bundled beside our executable, or where a build tree links it.
static bool find_near(const char *self, char *package)
{
    static const char *const places[] = {"../share/bounced/harness", "../harness/harness"};
    char copy[PATH_BYTES];
    snprintf(copy, sizeof copy, "%s", self);
    const char *folder = dirname(copy);
    for (size_t i = 0; i < sizeof places / sizeof places[0]; i++) {
        int length = snprintf(package, PATH_BYTES, "%s/%s", folder, places[i]);
        if (length < PATH_BYTES && is_package(package)) return true;
    }
    return false;
}

static enum bd_err find_package(const char *self, char *package, struct bd_err_detail *detail)
{
    const char *named = getenv("BOUNCE_HARNESS");
    if (named && *named) {
        snprintf(package, PATH_BYTES, "%s", named);
        if (is_package(package)) return BD_ERR_OK;
        return bd_err_set(detail, BD_ERR_NOT_FOUND, "BOUNCE_HARNESS",
                          "$BOUNCE_HARNESS, %.200s: no __main__.py to read there", named);
    }
    if (find_near(self, package)) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_NOT_FOUND, "BOUNCE_HARNESS",
                      "the Python package of this command is not installed beside this program "
                      "(share/bounced/harness); name its folder by $BOUNCE_HARNESS");
}

// Puts `folder` before what the user has in PYTHONPATH.
static void find_modules_in(const char *folder)
{
    const char *given = getenv("PYTHONPATH");
    char value[2 * PATH_BYTES];
    snprintf(value, sizeof value, "%s%s%s", folder, given && *given ? ":" : "", given ? given : "");
    setenv("PYTHONPATH", value, 1);
}

static const char *python(void)
{
    const char *named = getenv("BOUNCE_PYTHON");
    return named && *named ? named : "/usr/bin/python3";
}

// Comes back only if the interpreter cannot be started.
static enum bd_err become_python(char *package, const char *command, const char *const *words,
                                 int count, struct bd_err_detail *detail)
{
    char name_of[PATH_BYTES], folder_of[PATH_BYTES];
    snprintf(name_of, sizeof name_of, "%s", package);
    snprintf(folder_of, sizeof folder_of, "%s", package);
    const char *argv[ARGUMENT_MAX + 5] = {python(), "-m", basename(name_of), command};
    if (count > ARGUMENT_MAX)
        return bd_err_set(detail, BD_ERR_USAGE, "", "more than %d arguments", ARGUMENT_MAX);
    memcpy(argv + 4, words, (size_t)count * sizeof *words);
    find_modules_in(dirname(folder_of));
    execv(python(), (char *const *)argv);
    return bd_err_set(detail, BD_ERR_UNSUPPORTED, "",
                      "%s: %s; this command is written in Python 3 (Debian: python3 "
                      "python3-numpy, or name another by $BOUNCE_PYTHON)",
                      python(), strerror(errno));
}

static int run(const char *command, const char *const *words, int count)
{
    char self[PATH_BYTES], given[PATH_BYTES], package[PATH_BYTES], daemon[PATH_BYTES];
    struct bd_err_detail detail = {0};
    enum bd_err err = BD_ERR_OK;
    if (!find_self(self)) err = bd_err_set(&detail, BD_ERR_IO, "", "/proc is not there");
    if (!err) err = find_package(self, given, &detail);
    // A symbolic link, or a folder named "..", is no name of a module.
    if (!err && !realpath(given, package))
        err =
            bd_err_set(&detail, BD_ERR_IO, "BOUNCE_HARNESS", "%.200s: %s", given, strerror(errno));
    if (!err) err = bd_transport_find_daemon(daemon, &detail);
    if (!err) {
        setenv("BOUNCE", self, 1);
        setenv("BOUNCED", daemon, 1);
        err = become_python(package, command, words, count, &detail);
    }
    return bd_cmd_fail(err, &detail, false);
}

int bd_cmd_stability(const char *const *words, int count)
{
    return run("stability", words, count);
}

int bd_cmd_bench(const char *const *words, int count)
{
    return run("bench", words, count);
}
