#include "tests/journal/files.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "base/assert.h"

#define PATH_BYTES 512

struct file_bytes file_read(const char *directory, const char *name)
{
    char path[PATH_BYTES];
    struct file_bytes out = {NULL, 0};
    snprintf(path, sizeof path, "%s/%s", directory, name);
    FILE *file = fopen(path, "rb");
    if (!file) return out;
    fseek(file, 0, SEEK_END);
    out.size = (size_t)ftell(file);
    rewind(file);
    out.data = malloc(out.size + 1);
    BD_ASSERT(out.data && fread(out.data, 1, out.size, file) == out.size);
    fclose(file);
    return out;
}

void file_write(const char *directory, const char *name, const void *data, size_t size)
{
    char path[PATH_BYTES];
    snprintf(path, sizeof path, "%s/%s", directory, name);
    FILE *file = fopen(path, "wb");
    BD_ASSERT(file && fwrite(data, 1, size, file) == size && fclose(file) == 0);
}

bool file_exists(const char *directory, const char *name)
{
    char path[PATH_BYTES];
    snprintf(path, sizeof path, "%s/%s", directory, name);
    return access(path, F_OK) == 0;
}

void files_remove(const char *directory)
{
    DIR *list = opendir(directory);
    BD_ASSERT(list);
    for (struct dirent *entry; (entry = readdir(list));) {
        char path[PATH_BYTES];
        snprintf(path, sizeof path, "%s/%.200s", directory, entry->d_name);
        if (entry->d_name[0] != '.') unlink(path);
    }
    closedir(list);
}
