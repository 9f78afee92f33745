#include "gpu/shader_cache.h"

#include <errno.h>
#include <fcntl.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include "base/log.h"

#define PATH_BYTES 4096

// Mesa maps this file, to count what it keeps: 65,536 keys of 20 bytes behind a number of eight.
// It makes it by setting its size, without a block behind it, and the first key after the disk is
// full is a SIGBUS. What is cached itself is written as files, which may fail.
#define INDEX_FOLDER "mesa_shader_cache"
#define INDEX_BYTES  (8 + 65536 * 20)

static void point(const char *directory)
{
    if (mkdir(directory, 0700) != 0 && errno != EEXIST)
        bd_log(BD_LOG_WARN, "gpu", "no shader cache in %s: %s", directory, strerror(errno));
    setenv("MESA_SHADER_CACHE_DIR", directory, 0);
    setenv("MESA_SHADER_CACHE_MAX_SIZE", "256M", 0);
    setenv("__GL_SHADER_DISK_CACHE", "1", 0);
    setenv("__GL_SHADER_DISK_CACHE_PATH", directory, 0);
    setenv("__GL_SHADER_DISK_CACHE_SIZE", "268435456", 0);
}

// As Mesa finds it. False: it has none.
static bool find_folder(char out[PATH_BYTES])
{
    const char *own = getenv("MESA_SHADER_CACHE_DIR"), *caches = getenv("XDG_CACHE_HOME");
    const char *home = getenv("HOME");
    int length = -1;
    if (own)
        length = snprintf(out, PATH_BYTES, "%s/" INDEX_FOLDER, own);
    else if (caches)
        length = snprintf(out, PATH_BYTES, "%s/" INDEX_FOLDER, caches);
    else if (home)
        length = snprintf(out, PATH_BYTES, "%s/.cache/" INDEX_FOLDER, home);
    return length > 0 && length < PATH_BYTES;
}

// All of the index on the disk, whatever it holds already. 0, or errno.
static int allocate_index(const char *folder)
{
    char path[PATH_BYTES + 16];
    struct stat info;
    snprintf(path, sizeof path, "%s/index", folder);
    int file = open(path, O_RDWR | O_CREAT | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, 0644);
    if (file < 0) return errno;
    int result = fstat(file, &info) ? errno : 0;
    if (!result && !S_ISREG(info.st_mode)) result = EINVAL;
    // Never shorter than it is: other programs may have mapped it.
    const off_t size = !result && info.st_size > INDEX_BYTES ? info.st_size : INDEX_BYTES;
    if (!result) result = posix_fallocate(file, 0, size);
    close(file);
    return result;
}

static int prepare_index(const char *folder, uint64_t reserve_bytes)
{
    struct statvfs info;
    if (statvfs(folder, &info)) return errno;
    if ((uint64_t)info.f_bavail * info.f_frsize < reserve_bytes + INDEX_BYTES) return ENOSPC;
    return allocate_index(folder);
}

static void switch_off(const char *folder, int reason)
{
    bd_log(BD_LOG_WARN, "gpu", "no shader cache in %s: %s; every start compiles its shaders anew",
           folder,
           reason == ENOSPC ? "the disk has less free than disk_reserve_bytes" : strerror(reason));
    setenv("MESA_SHADER_CACHE_DISABLE", "true", 1);
    setenv("__GL_SHADER_DISK_CACHE", "0", 1);
}

void bd_shader_cache_prepare(const char *directory, uint64_t reserve_bytes)
{
    char folder[PATH_BYTES];
    if (directory) point(directory);
    if (!find_folder(folder)) return;
    // Where it cannot be made, the driver makes none either.
    if (mkdir(folder, 0700) != 0 && errno != EEXIST) return;
    int reason = prepare_index(folder, reserve_bytes);
    if (reason) switch_off(folder, reason);
}
