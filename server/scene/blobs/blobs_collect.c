// Blobs that nobody asked for in a while go, and with them marks and what was set aside.

#include <dirent.h>
#include <fcntl.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "scene/blobs/blobs_internal.h"

struct round {
    struct bd_blobs_base *base;
    time_t before;
    uint32_t count;
};

typedef void visit_fn(struct round *round, int directory, const char *name);

static void each(struct round *round, int parent, const char *name, visit_fn *visit)
{
    int directory = openat(parent, name, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    DIR *list = directory < 0 ? NULL : fdopendir(directory);
    if (!list) {
        if (directory >= 0) close(directory);
        return;
    }
    for (struct dirent *entry; (entry = readdir(list));) visit(round, dirfd(list), entry->d_name);
    closedir(list);
}

static bool is_old(const struct round *round, const struct stat *info)
{
    return info->st_atime < round->before && info->st_mtime < round->before;
}

// Under the lock: whoever wants it says so before he looks whether it is there.
static void take_old(struct round *round, int directory, const char *name)
{
    struct stat info;
    pthread_mutex_lock(&round->base->lock);
    if (fstatat(directory, name, &info, AT_SYMLINK_NOFOLLOW) == 0 && !S_ISDIR(info.st_mode) &&
        is_old(round, &info) && unlinkat(directory, name, 0) == 0)
        round->count++;
    pthread_mutex_unlock(&round->base->lock);
}

static void visit_mark(struct round *round, int directory, const char *name)
{
    if (bd_blob_name_is_valid(name)) take_old(round, directory, name);
}

static void visit_file(struct round *round, int directory, const char *name)
{
    bool is_aside = strncmp(name, BD_BLOBS_DAMAGED_PREFIX, strlen(BD_BLOBS_DAMAGED_PREFIX)) == 0;
    if (is_aside || bd_blob_name_is_valid(name)) take_old(round, directory, name);
    if (strncmp(name, BD_BLOBS_OWNER_PREFIX, strlen(BD_BLOBS_OWNER_PREFIX)) == 0)
        each(round, directory, name, visit_mark);
}

uint32_t bd_blobs_collect(struct bd_blobs *blobs, uint64_t seconds)
{
    struct round round = {.base = blobs->base, .before = time(NULL) - (time_t)seconds};
    if (seconds > 0) each(&round, blobs->base->directory, ".", visit_file);
    return round.count;
}
