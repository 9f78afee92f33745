#include "scene/journal/data_dir.h"

#include <errno.h>
#include <fcntl.h>
#include <ftw.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

static enum bd_err io_err(const char *path, struct bd_err_detail *detail)
{
    return bd_err_set(detail, BD_ERR_IO, "data", "%s: %s", path, strerror(errno));
}

static enum bd_err default_path(char *out, size_t size, struct bd_err_detail *detail)
{
    const char *data_home = getenv("XDG_DATA_HOME");
    const char *home = getenv("HOME");
    int length = -1;
    if (data_home && data_home[0] == '/')
        length = snprintf(out, size, "%s/bounced", data_home);
    else if (home && home[0] == '/')
        length = snprintf(out, size, "%s/.local/share/bounced", home);
    if (length > 0 && (size_t)length < size) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_USAGE, "data",
                      "neither XDG_DATA_HOME nor HOME says where the data goes: use --data");
}

static enum bd_err make_with_parents(const char *path, struct bd_err_detail *detail)
{
    char part[4096];
    for (const char *slash = strchr(path + 1, '/');; slash = strchr(slash + 1, '/')) {
        int length = slash ? (int)(slash - path) : (int)strlen(path);
        snprintf(part, sizeof part, "%.*s", length, path);
        if (mkdir(part, 0700) < 0 && errno != EEXIST) return io_err(part, detail);
        if (!slash) return BD_ERR_OK;
    }
}

static enum bd_err check_owner(const char *path, struct bd_err_detail *detail)
{
    struct stat info;
    if (stat(path, &info) < 0) return io_err(path, detail);
    if (info.st_uid == geteuid() && !(info.st_mode & (S_IRWXG | S_IRWXO))) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_FORBIDDEN, "data",
                      "%s is not ours alone: it must belong to this user, with mode 0700", path);
}

static enum bd_err lock(struct bd_data_dir *dir, struct bd_err_detail *detail)
{
    char path[4128];
    snprintf(path, sizeof path, "%s/lock", dir->path);
    dir->lock = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    if (dir->lock < 0) return io_err(path, detail);
    if (flock(dir->lock, LOCK_EX | LOCK_NB) == 0) return BD_ERR_OK;
    close(dir->lock);
    return bd_err_set(detail, BD_ERR_CONFLICT, "data", "another daemon holds %s", dir->path);
}

enum bd_err bd_data_dir_open(const char *path, struct bd_data_dir *out,
                             struct bd_err_detail *detail)
{
    *out = (struct bd_data_dir){.lock = -1};
    enum bd_err err = BD_ERR_OK;
    if (!path)
        err = default_path(out->path, sizeof out->path, detail);
    else if (path[0] == 0 ||
             (size_t)snprintf(out->path, sizeof out->path, "%s", path) >= sizeof out->path)
        err = bd_err_set(detail, BD_ERR_USAGE, "data", "the data directory's path is too long");
    if (!err) err = make_with_parents(out->path, detail);
    if (!err) err = check_owner(out->path, detail);
    if (!err) err = lock(out, detail);
    return err;
}

enum bd_err bd_data_dir_open_temporary(struct bd_data_dir *out, struct bd_err_detail *detail)
{
    const char *parent = getenv("TMPDIR");
    *out = (struct bd_data_dir){.lock = -1, .is_temporary = true};
    snprintf(out->path, sizeof out->path, "%s/bounced.XXXXXX", parent ? parent : "/tmp");
    if (!mkdtemp(out->path)) return io_err(out->path, detail);
    return lock(out, detail);
}

static int remove_one(const char *path, const struct stat *info, int kind, struct FTW *ftw)
{
    (void)info;
    (void)ftw;
    // Not remove(), which tries a folder as a file first: the parent's files are nobody's of ours
    // (confine/paths.c).
    return kind == FTW_DP ? rmdir(path) : unlink(path);
}

void bd_data_dir_close(struct bd_data_dir *dir)
{
    if (dir->lock < 0) return;
    if (dir->is_temporary) nftw(dir->path, remove_one, 8, FTW_DEPTH | FTW_PHYS | FTW_MOUNT);
    close(dir->lock);
    dir->lock = -1;
}
