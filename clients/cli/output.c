#include "clients/cli/output.h"

#include <errno.h>
#include <fcntl.h>
#include <libgen.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static enum bd_err io_err(struct bd_err_detail *detail, const char *path)
{
    return bd_err_set(detail, BD_ERR_IO, "output", "cannot write %.200s: %s", path,
                      strerror(errno));
}

static bool is_stdout(const char *path)
{
    return strcmp(path, "-") == 0;
}

// True if something is there that a rename would replace by a file of another kind.
static bool is_special(const char *path)
{
    struct stat info;
    return stat(path, &info) == 0 && !S_ISREG(info.st_mode);
}

enum bd_err bd_cli_output_check(const char *path, struct bd_err_detail *detail)
{
    if (is_stdout(path)) {
        if (!isatty(STDOUT_FILENO)) return BD_ERR_OK;
        return bd_err_set(detail, BD_ERR_USAGE, "output",
                          "-o -: standard output is a terminal; pipe it, or name a file");
    }
    struct stat info;
    if (stat(path, &info) == 0 && S_ISDIR(info.st_mode)) {
        errno = EISDIR;
        return io_err(detail, path);
    }
    char *copy = strdup(path);
    if (!copy) return io_err(detail, path);
    bool writable =
        is_special(path) ? access(path, W_OK) == 0 : access(dirname(copy), W_OK | X_OK) == 0;
    enum bd_err err = writable ? BD_ERR_OK : io_err(detail, path);
    free(copy);
    return err;
}

static bool write_all(int fd, const void *bytes, size_t size)
{
    const uint8_t *next = bytes;
    while (size > 0) {
        ssize_t wrote = write(fd, next, size);
        if (wrote < 0 && errno == EINTR) continue;
        if (wrote < 0) return false;
        next += wrote;
        size -= (size_t)wrote;
    }
    return true;
}

static enum bd_err write_directly(int fd, const char *path, const void *bytes, size_t size,
                                  struct bd_err_detail *detail)
{
    if (fd < 0 || !write_all(fd, bytes, size)) return io_err(detail, path);
    return BD_ERR_OK;
}

static enum bd_err write_special(const char *path, const void *bytes, size_t size,
                                 struct bd_err_detail *detail)
{
    int fd = open(path, O_WRONLY | O_CLOEXEC);
    enum bd_err err = write_directly(fd, path, bytes, size, detail);
    if (fd >= 0) close(fd);
    return err;
}

// mkstemp makes the file private; this gives it the mode that open() would have.
static void widen_mode(int fd)
{
    mode_t mask = umask(0);
    umask(mask);
    fchmod(fd, 0666 & ~mask);
}

static enum bd_err write_beside(const char *path, const void *bytes, size_t size,
                                struct bd_err_detail *detail)
{
    char *temporary = NULL;
    if (asprintf(&temporary, "%s.XXXXXX", path) < 0)
        return bd_err_set(detail, BD_ERR_NO_MEMORY, "output", "no memory for a name");
    enum bd_err err = BD_ERR_OK;
    int fd = mkostemp(temporary, O_CLOEXEC);
    if (fd < 0) {
        err = io_err(detail, path);
        goto release_name;
    }
    widen_mode(fd);
    bool wrote = write_all(fd, bytes, size);
    // Quotas and network file systems speak up only when the file is closed.
    if (close(fd)) wrote = false;
    if (!wrote || rename(temporary, path)) {
        err = io_err(detail, path);
        unlink(temporary);
    }
release_name:
    free(temporary);
    return err;
}

enum bd_err bd_cli_output_write(const char *path, const void *bytes, size_t size,
                                struct bd_err_detail *detail)
{
    if (is_stdout(path)) return write_directly(STDOUT_FILENO, "-", bytes, size, detail);
    if (is_special(path)) return write_special(path, bytes, size, detail);
    return write_beside(path, bytes, size, detail);
}
