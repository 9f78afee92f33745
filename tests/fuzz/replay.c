// Stands in for libFuzzer where it is not built in: gives a target each file of the folders named,
// in order of name, and the empty input.

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"

#include "target.h"

static int is_file(const struct dirent *entry)
{
    return entry->d_name[0] != '.';
}

static void replay(const char *folder, const char *name)
{
    char path[4096];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "rb");
    BD_ASSERT(file);
    fseek(file, 0, SEEK_END);
    size_t size = (size_t)ftell(file);
    rewind(file);
    // Exactly as large as the input: one byte beyond is the sanitizer's.
    uint8_t *bytes = malloc(size ? size : 1);
    BD_ASSERT(bytes);
    BD_ASSERT_CMP(fread(bytes, 1, size, file), ==, size);
    fclose(file);
    LLVMFuzzerTestOneInput(bytes, size);
    free(bytes);
}

int main(int argc, char **argv)
{
    int count = 0;
    LLVMFuzzerTestOneInput((const uint8_t *)"", 0);
    for (int i = 1; i < argc; i++) {
        struct dirent **entries;
        int found = scandir(argv[i], &entries, is_file, alphasort);
        if (found < 0) {
            fprintf(stderr, "%s: no such folder\n", argv[i]);
            return 2;
        }
        for (int j = 0; j < found; j++) {
            replay(argv[i], entries[j]->d_name);
            free(entries[j]);
        }
        free(entries);
        count += found;
    }
    printf("%d inputs\n", count);
    return count > 0 ? 0 : 1;
}
