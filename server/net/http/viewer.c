#include "net/http/viewer.h"

#include <string.h>

const struct bd_viewer_file *bd_viewer_find(const char *path)
{
    for (uint32_t i = 0; i < bd_viewer_file_count; i++)
        if (strcmp(path, bd_viewer_files[i].path) == 0) return &bd_viewer_files[i];
    return NULL;
}
