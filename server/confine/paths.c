// Landlock: the file system as the daemon sees it once it is up.

#include <errno.h>
#include <fcntl.h>
#include <libgen.h>
#include <limits.h>
#include <link.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "base/log.h"
#include "confine/confine.h"

// linux/landlock.h, of which headers know no more than their own kernel.
#define RULE_PATH_BENEATH 1
#define ASKS_VERSION      1
enum right {
    EXECUTE = 1 << 0,
    WRITE_FILE = 1 << 1,
    READ_FILE = 1 << 2,
    READ_DIR = 1 << 3,
    REMOVE_DIR = 1 << 4,
    REMOVE_FILE = 1 << 5,
    MAKE_CHAR = 1 << 6,
    MAKE_DIR = 1 << 7,
    MAKE_REG = 1 << 8,
    MAKE_SOCK = 1 << 9,
    MAKE_FIFO = 1 << 10,
    MAKE_BLOCK = 1 << 11,
    MAKE_SYM = 1 << 12,
    REFER = 1 << 13,     // version 2
    TRUNCATE = 1 << 14,  // 3
    IOCTL_DEV = 1 << 15, // 5
};
#define NET_CONNECT_TCP (1 << 1) // 4
// Unix sockets that have no path, and signals, go to no process outside.
#define SCOPES (1 << 0 | 1 << 1) // 6

struct ruleset_attr {
    uint64_t fs, net, scoped;
};
struct path_attr {
    uint64_t rights;
    int32_t folder;
} __attribute__((packed));

#define READS    (EXECUTE | READ_FILE | READ_DIR)
#define OF_FILES (EXECUTE | WRITE_FILE | READ_FILE | TRUNCATE | IOCTL_DEV)
#define WRITES                                                                                     \
    (WRITE_FILE | READ_FILE | READ_DIR | REMOVE_DIR | REMOVE_FILE | MAKE_DIR | MAKE_REG |          \
     MAKE_SYM | REFER | TRUNCATE)

// Where programs, libraries, drivers and what they read lie on the systems that there are. Not
// here: homes, other services' data, other users' temporary files.
static const char *const system_reads[] = {"/usr",  "/lib",  "/lib32", "/lib64", "/bin",
                                           "/sbin", "/etc",  "/opt",   "/nix",   "/gnu",
                                           "/run",  "/proc", "/sys",   NULL};
// Folders, or lists of files and folders with colons between, that drivers and the loader are told
// by.
static const char *const read_variables[] = {"LD_LIBRARY_PATH",
                                             "LD_PRELOAD",
                                             "LIBGL_DRIVERS_PATH",
                                             "GBM_BACKENDS_PATH",
                                             "__EGL_VENDOR_LIBRARY_FILENAMES",
                                             "__EGL_VENDOR_LIBRARY_DIRS",
                                             "XDG_DATA_DIRS",
                                             NULL};
// Where drivers keep their compiled shaders, if they are told. Without that it is below the data
// folder, or, where that goes at the end, where all programs of this user have them.
static const char *const cache_variables[] = {"MESA_SHADER_CACHE_DIR", "MESA_GLSL_CACHE_DIR",
                                              "__GL_SHADER_DISK_CACHE_PATH", NULL};
static const char *const caches_at_home[] = {".cache", ".nv", NULL};

struct rules {
    int fd;
    uint64_t handled;
    int bad; // errno of the first rule that the kernel would not have
};

static uint64_t handled_rights(long version)
{
    uint64_t all = (IOCTL_DEV << 1) - 1;
    if (version < 5) all &= ~(uint64_t)IOCTL_DEV;
    if (version < 3) all &= ~(uint64_t)TRUNCATE;
    if (version < 2) all &= ~(uint64_t)REFER;
    return all;
}

// What does not exist needs no rule.
static void allow(struct rules *rules, const char *path, uint64_t rights)
{
    int fd = open(path, O_PATH | O_CLOEXEC);
    struct stat info;
    if (fd < 0) return;
    rights &= rules->handled;
    if (fstat(fd, &info) == 0 && !S_ISDIR(info.st_mode)) rights &= OF_FILES;
    const struct path_attr rule = {rights, fd};
    if (rights && syscall(SYS_landlock_add_rule, rules->fd, RULE_PATH_BENEATH, &rule, 0) < 0 &&
        !rules->bad)
        rules->bad = errno;
    close(fd);
}

static void allow_each(struct rules *rules, const char *const *paths, uint64_t rights)
{
    for (; *paths; paths++) allow(rules, *paths, rights);
}

// The folder that a path lies in, which need not be there itself.
static void allow_folder_of(struct rules *rules, const char *path, uint64_t rights)
{
    char copy[PATH_MAX];
    if ((size_t)snprintf(copy, sizeof copy, "%s", path) < sizeof copy)
        allow(rules, dirname(copy), rights);
}

// Editors write another file beside it; and it may be a link to one elsewhere.
static void allow_file_that_is_replaced(struct rules *rules, const char *path)
{
    char *real = realpath(path, NULL);
    allow_folder_of(rules, path, READ_FILE);
    if (real) allow_folder_of(rules, real, READ_FILE);
    free(real);
}

static void allow_listed(struct rules *rules, const char *list, uint64_t rights)
{
    char path[PATH_MAX];
    while (list && *list) {
        size_t length = strcspn(list, ":");
        if (length > 0 && length < sizeof path) {
            memcpy(path, list, length);
            path[length] = 0;
            allow(rules, path, rights);
        }
        list += length + (list[length] == ':');
    }
}

// The libraries that are loaded, wherever they lie: the import child loads them anew.
static int allow_library(struct dl_phdr_info *library, size_t size, void *user)
{
    (void)size;
    if (library->dlpi_name && library->dlpi_name[0] == '/')
        allow_folder_of(user, library->dlpi_name, READS);
    return 0;
}

// Ourselves, for the import child is this program, and a bundle's libraries (deploy/bundle).
static void allow_program(struct rules *rules)
{
    char self[PATH_MAX];
    ssize_t length = readlink("/proc/self/exe", self, sizeof self - 1);
    if (length <= 0) return;
    self[length] = 0;
    allow(rules, self, READS);
    char *folder = dirname(self);
    strncat(self, "/../lib", sizeof self - strlen(folder) - 1);
    allow(rules, self, READS);
}

// A rule wants a folder, and a driver would make this one only later.
static void allow_cache(struct rules *rules, const char *path)
{
    if (path[0] != '/') return;
    (void)mkdir(path, 0700);
    allow(rules, path, WRITES);
}

static void allow_caches_at_home(struct rules *rules)
{
    const char *home = getenv("HOME"), *caches = getenv("XDG_CACHE_HOME");
    char path[PATH_MAX];
    if (caches && *caches) allow_cache(rules, caches);
    for (const char *const *name = caches_at_home; home && *home && *name; name++)
        if ((size_t)snprintf(path, sizeof path, "%s/%s", home, *name) < sizeof path)
            allow_cache(rules, path);
}

static void allow_caches(struct rules *rules, bool at_home)
{
    for (const char *const *name = cache_variables; *name; name++) {
        const char *path = getenv(*name);
        if (path && *path) allow_cache(rules, path);
    }
    if (at_home) allow_caches_at_home(rules);
}

static void allow_all(struct rules *rules, const struct bd_confine_paths *paths)
{
    allow_each(rules, system_reads, READS);
    for (const char *const *name = read_variables; *name; name++)
        allow_listed(rules, getenv(*name), READS);
    allow_program(rules);
    (void)dl_iterate_phdr(allow_library, rules);
    allow(rules, "/dev", READ_FILE | READ_DIR | WRITE_FILE | IOCTL_DEV);
    allow(rules, "/dev/shm", WRITES);
    allow(rules, "/proc/self", WRITE_FILE);
    allow_caches(rules, paths->data_is_temporary);
    allow(rules, paths->data, WRITES);
    if (paths->data_is_temporary) allow_folder_of(rules, paths->data, REMOVE_DIR);
    for (const char *const *path = paths->read_again; path && *path; path++)
        allow_file_that_is_replaced(rules, *path);
    for (const char *const *path = paths->sockets; path && *path; path++)
        allow_folder_of(rules, *path, MAKE_SOCK | REMOVE_FILE);
}

// 0, or errno.
static int restrict_to(const struct bd_confine_paths *paths, long version)
{
    const struct ruleset_attr attr = {.fs = handled_rights(version),
                                      .net = version >= 4 ? NET_CONNECT_TCP : 0,
                                      .scoped = version >= 6 ? SCOPES : 0};
    const size_t size = version >= 6   ? sizeof attr
                        : version >= 4 ? offsetof(struct ruleset_attr, scoped)
                                       : sizeof attr.fs;
    struct rules rules = {.handled = attr.fs};
    rules.fd = (int)syscall(SYS_landlock_create_ruleset, &attr, size, 0);
    if (rules.fd < 0) return errno;
    allow_all(&rules, paths);
    if (!rules.bad && syscall(SYS_landlock_restrict_self, rules.fd, 0) < 0) rules.bad = errno;
    close(rules.fd);
    return rules.bad;
}

enum bd_err bd_confine_paths(enum bd_sandbox sandbox, const struct bd_confine_paths *paths,
                             struct bd_err_detail *detail)
{
    if (sandbox == BD_SANDBOX_OFF) return BD_ERR_OK;
    long version = syscall(SYS_landlock_create_ruleset, NULL, 0, ASKS_VERSION);
    int bad = version < 1 ? errno : restrict_to(paths, version);
    if (!bad) return BD_ERR_OK;
    if (sandbox == BD_SANDBOX_ON)
        return bd_err_set(detail, BD_ERR_UNSUPPORTED, "sandbox",
                          "the kernel has no Landlock for us: %s", strerror(bad));
    bd_log(BD_LOG_WARN, "confine", "files are not confined, the kernel has no Landlock for us: %s",
           strerror(bad));
    return BD_ERR_OK;
}
